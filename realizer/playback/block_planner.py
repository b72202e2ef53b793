"""Steps 2 to 4 of the pipeline for one block: timings, schedule and channels."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NoReturn

import numpy as np

from bml_schema import Block, SyncRef, without
from bml_schema.dropped_references import listed
from realizer.animation.channel import Channel
from realizer.behaviours.kind import BehaviourKind, PlanningContext
from realizer.playback.resources import ResourceClaim, after_interrupts, claims, conflicts, interrupts, trims
from realizer.scheduling import Member, schedule_together
from realizer.scheduling.timing import Schedule, Timing, Warning
from realizer.speech.utterance import WARP

# s; a speech whose points move by no more is not synthesized again.
SAME = 1e-6
# s; shorter gaps of a speech are too short to determine its rate.
SHORT = 0.02


@dataclass(frozen=True)
class Plan:
    """A block that can be played.

    Attributes:
        block: without the dropped behaviours and the references to them.
        schedule: `failed` if something required cannot be played; the other attributes are empty then.
        channels: behaviour id -> channels in seconds from block start.
        claims: the exclusive resources of its behaviours, on the clock of `schedule.start`.
        timings: the timings that its behaviours prefer.
        other_schedules: the new schedules of the other blocks, each from its own start.
        trims: (block, behaviour) -> when a speech that plays has to end, which cuts its closing silence.
    """

    block: Block
    schedule: Schedule
    channels: Mapping[str, tuple[Channel, ...]] = field(default_factory=dict)
    claims: Sequence[ResourceClaim] = ()
    timings: Mapping[str, Timing] = field(default_factory=dict)
    other_schedules: Sequence[Schedule] = ()
    trims: Mapping[tuple[str, str], float] = field(default_factory=dict)


def plan(
    block: Block,
    kinds: Mapping[str, BehaviourKind],
    context: PlanningContext,
    *,
    start: float = 0.0,
    outside: Callable[[SyncRef], float | None] = lambda ref: None,
    existing_claims: Iterable[ResourceClaim] = (),
    others: Sequence[Member] = (),
    may_stretch: bool = True,
) -> Plan:
    """Schedule a block and expand it; drop with one warning each what cannot be played.

    Args:
        context: with the utterances of the block's speech behaviours.
        start: when the block starts, seconds on the session clock.
        outside: sync points of other blocks -> seconds from this block's start, None if unknown.
        existing_claims: claims of earlier blocks of this character, on the session clock.
        others: playing blocks that are tied to this one: solved with it, seconds from this block's start.
        may_stretch: whether the plan may require speech of other lengths.
    """
    builder = _PlanBuilder(block, kinds, context, may_stretch)
    try:
        builder.add_problems()
        builder.time()
        schedule, *moved = builder.schedule(start, outside, tuple(existing_claims), others)
    except _NoPlan as why:
        return Plan(block, Schedule(block.id, {}, {}, start=start, **why.schedule))
    return Plan(
        builder.block,
        schedule,
        builder.expand(schedule),
        builder.claims,
        builder.timings,
        moved,
        builder.trims,
    )


class _NoPlan(Exception):
    """The block cannot be planned so; `schedule` has why, as fields of Schedule."""

    def __init__(self, **schedule: Any) -> None:
        super().__init__(str(schedule))
        self.schedule = schedule


class _PlanBuilder:
    """A block while it is planned: its remaining behaviours, and the warnings so far."""

    def __init__(
        self,
        block: Block,
        kinds: Mapping[str, BehaviourKind],
        context: PlanningContext,
        may_stretch: bool,
    ) -> None:
        self.may_stretch = may_stretch
        self.original = self.block = block
        self.kinds = kinds
        self.context = context
        self.timings: dict[str, Timing] = {}
        self.warnings: list[Warning] = []
        self.claims: tuple[ResourceClaim, ...] = ()
        self.trims: dict[tuple[str, str], float] = {}

    def add_problems(self) -> None:
        """Add the warnings of the parser."""
        for problem in self.block.problems:
            of_constraint = "/constraint[" in problem.path
            warning = Warning(problem.id, problem.type, str(problem), constraint=of_constraint)
            if problem.fatal:
                self.refuse(warning)
            self.warnings.append(warning)

    def time(self) -> None:
        """Step 2: check the behaviours, and get the timings that they prefer."""
        gone: list[tuple[str, Warning]] = []
        context, utterances = self.context, self.context.utterances
        for node in self.block.behaviours:
            kind = self.kinds.get(node.tag)
            if kind is None:
                text = f"<{node.tag.rpartition('}')[2]}> is not known here"
                gone.append((node.id, self.warning("BEHAVIOR_TYPE_NOT_SUPPORTED", node.id, text)))
                continue
            faults = kind.check(node, context)
            fatal = next((fault for fault in faults if fault.fatal), None)
            if fatal is not None:
                gone.append((node.id, self.warning(fatal.type, node.id, fatal.text)))
            elif kind.speech_request is not None and node.id not in utterances:
                text = "speech: no voice could say it"
                gone.append((node.id, self.warning("CANNOT_CREATE_BEHAVIOR", node.id, text)))
            else:
                self.warnings += [self.warning(fault.type, node.id, fault.text) for fault in faults]
                self.timings[node.id] = kind.timing(node, context)
        self.drop(gone)

    def schedule(
        self,
        start: float,
        outside: Callable[[SyncRef], float | None],
        existing_claims: Sequence[ResourceClaim],
        others: Sequence[Member],
    ) -> list[Schedule]:
        """Step 3: solve for the times, again without conflicting behaviours until none is left.

        Speeches that overlap a little are placed one after the other, if the document and the voice allow it.
        """
        sequences: list[tuple[str | float, str | float]] = []
        may_sequence = True
        while True:
            priorities = {node.id: node.priority for node in self.block.behaviours if node.priority}
            own = Member(self.block, self.timings, priorities=priorities, sequences=tuple(sequences))
            schedule, *moved = self.solve(own, others, outside)
            if schedule.failed or len(schedule.times) < len(self.timings):
                if self.may_stretch:
                    self.try_stretching(own, others, outside, schedule)
                if sequences:
                    sequences, may_sequence = [], False
                    continue
            warnings = [
                replace(w, text=self.with_place(self.behaviour_of(w), w.text)) for w in schedule.warnings
            ]
            if schedule.failed:
                self.refuse(warnings[0])
            gone = self.timings.keys() - schedule.times.keys()
            self.drop([(self.behaviour_of(w), w) for w in warnings if self.behaviour_of(w) in gone])
            self.warnings += [w for w in warnings if self.behaviour_of(w) not in gone]
            character, all_warnings = self.block.character_id, tuple(self.warnings)
            schedule = replace(schedule, start=start, character=character, warnings=all_warnings)
            self.claims = tuple(claims(self.block, schedule, self.kinds, self.context))
            left = after_interrupts(existing_claims, interrupts(self.block, schedule))
            lost = conflicts(self.claims, left, start)
            if not lost:
                self.trims = dict(trims(self.claims, left))
                return [schedule, *moved]
            wanted = {pair for conflict in lost if (pair := conflict.sequence) is not None}
            if may_sequence and wanted.difference(sequences):
                sequences = [*sequences, *wanted.difference(sequences)]
                continue
            losers = ((loss.claim.behaviour, str(loss)) for loss in lost)
            self.drop((id, self.warning("CANNOT_CREATE_BEHAVIOR", id, text)) for id, text in losers)

    def expand(self, schedule: Schedule) -> dict[str, tuple[Channel, ...]]:
        """Step 4: return the channels of the scheduled behaviours, in seconds from block start."""
        return {
            node.id: self.kinds[node.tag].expand(node, schedule.times[node.id], self.context)
            for node in self.block.behaviours
            if node.id in schedule.times
        }

    def solve(
        self, own: Member, others: Sequence[Member], outside: Callable[[SyncRef], float | None]
    ) -> list[Schedule]:
        return schedule_together([own, *others], outside=outside, grace=self.context.grace)

    def try_stretching(
        self,
        own: Member,
        others: Sequence[Member],
        outside: Callable[[SyncRef], float | None],
        rigid: Schedule,
    ) -> None:
        """Raise _NoPlan with lengths if speech at another rate lets more behaviours fit."""
        flexible = dict(own.timings)
        for node in self.block.behaviours:
            if (
                node.id in flexible
                and (timing := self.kinds[node.tag].stretch(node, self.context)) is not None
            ):
                flexible[node.id] = timing
        could = {b: timing for b, timing in flexible.items() if timing is not own.timings[b]}
        if not could:
            return
        stretched = self.solve(replace(own, timings=flexible), others, outside)[0]
        if stretched.failed or len(stretched.times) <= len(rigid.times):
            return
        at = {b: stretched.times[b] - stretched.times[b][0] for b in could if b in stretched.times}
        natural = {b: np.append(0.0, np.cumsum(own.timings[b].preferred)) for b in at}
        # A voice has one rate for a whole speech: of the rates of its gaps, the one that lets most fit.
        most = len(rigid.times)
        for b in at if len(at) == 1 else ():
            if could[b].most is None or self.context.utterances[b].stretch == WARP:
                continue
            gaps = own.timings[b].preferred
            rates = np.diff(at[b])[gaps > SHORT] / gaps[gaps > SHORT]
            for rate in sorted({round(float(r), 9) for r in rates}, key=lambda r: abs(r - 1.0)):
                evened = replace(own.timings[b], preferred=gaps * rate)
                fits = self.solve(replace(own, timings={**own.timings, b: evened}), others, outside)[0]
                if not fits.failed and len(fits.times) > most:
                    most = len(fits.times)
                    at[b] = natural[b] * rate
        lengths = {
            b: dict(zip(could[b].points[1:], map(float, at[b][1:]), strict=True))
            for b in at
            if np.abs(at[b] - natural[b]).max() > SAME
        }
        if lengths:
            raise _NoPlan(lengths=lengths)

    def drop(self, gone: Iterable[tuple[str, Warning]]) -> None:
        """Drop behaviours and the references to them, with one warning each that names both."""
        dropped = dict(gone)
        if not dropped:
            return
        for id in (node.id for node in self.block.behaviours if node.id in dropped):
            if id in self.block.required:
                self.refuse(dropped[id], f" (required {id})")
        self.block, lost, fatal = without(self.block, dropped.keys())
        for id, warning in dropped.items():
            self.timings.pop(id, None)
            if id in fatal:
                self.refuse(warning, f" (a required constraint names {id})")
            if names := lost.get(id):
                warning = replace(warning, text=f"{warning.text}; with it went {listed(names)}")
            # Earlier warnings about it do not matter any more.
            self.warnings = [w for w in self.warnings if w.id != warning.id]
            self.warnings.append(warning)

    def refuse(self, warning: Warning, more: str = "") -> NoReturn:
        """Refuse the block because something required cannot be played."""
        warning = replace(warning, id=self.original.id, text=warning.text + more)
        raise _NoPlan(warnings=(warning,), failed=True)

    def behaviour_of(self, warning: Warning) -> str:
        """Return the behaviour that a warning is about, or ""."""
        block, _, behaviour = warning.id.partition(":")
        return behaviour if block == self.original.id else ""

    def warning(self, type: str, behaviour: str, text: str) -> Warning:
        """Return a warning about a behaviour, with its place."""
        return Warning(f"{self.block.id}:{behaviour}", type, self.with_place(behaviour, text))

    def with_place(self, behaviour: str, text: str) -> str:
        """Return a sentence with the place of its behaviour."""
        place = self.original.places.get(behaviour)
        return text if place is None else place.with_place(text)
