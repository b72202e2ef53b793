"""Steps 2 to 4 for one block: timings, schedule and channels."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bml_schema import Block, SyncRef, without
from realizer.animation.channel import Channel
from realizer.behaviours.kind import BehaviourKind, PlanningContext
from realizer.playback.resources import ResourceClaim, claims, conflicts
from realizer.scheduling import Member, schedule_together
from realizer.scheduling.timing import Schedule, Timing, Warning
from realizer.speech.utterance import WARP

# s; a speech whose points differ by no more is not spoken again.
SAME = 1e-6
# s; shorter gaps of a speech say nothing about its rate.
SHORT = 0.02
_MAX_LISTED = 10  # references named in a warning as gone with their behaviour


@dataclass(frozen=True)
class Plan:
    """A block that can be played.

    Attributes:
        block: without the behaviours that were dropped, and what referred to them.
        schedule: `failed` when something required cannot be played; nothing else holds anything then.
        channels: behaviour id -> channels in seconds from block start.
        claims: what its behaviours need for themselves, on the clock of `schedule.start`.
        timings: what its behaviours want of time.
        other_schedules: the schedules that others have beside it, each from its own start.
    """

    block: Block
    schedule: Schedule
    channels: Mapping[str, tuple[Channel, ...]] = field(default_factory=dict)
    claims: Sequence[ResourceClaim] = ()
    timings: Mapping[str, Timing] = field(default_factory=dict)
    other_schedules: Sequence[Schedule] = ()


def plan(
    block: Block,
    kinds: Mapping[str, BehaviourKind],
    context: PlanningContext,
    *,
    start: float = 0.0,
    outside: Callable[[SyncRef], float | None] = lambda ref: None,
    existing_claims: Iterable[ResourceClaim] = (),
    others: Sequence[Member] = (),
) -> Plan:
    """Schedule a block and expand it; what cannot be played is dropped with one warning each.

    Args:
        context: with the utterances of the block's speech behaviours.
        start: when the block starts, seconds on the session clock.
        outside: sync points of other blocks -> seconds from this block's start, None where unknown.
        existing_claims: what behaviours of earlier blocks of this character need for themselves, on the
            session clock.
        others: blocks that play and are tied to this one: solved with it, seconds from this block's start.
    """
    work = _PlanBuilder(block, kinds, context)
    try:
        work.add_problems()
        work.time()
        schedule, *moved = work.schedule(start, outside, tuple(existing_claims), others)
    except _NeedsStretch as bends:
        return Plan(block, Schedule(block.id, {}, {}, start=start, lengths=bends.lengths))
    except _RequiredPartFailed as failed:
        warning = replace(failed.warning, id=block.id)
        return Plan(block, Schedule(block.id, {}, {}, start=start, warnings=(warning,), failed=True))
    return Plan(work.block, schedule, work.expand(schedule), work.claims, work.timings, moved)


class _RequiredPartFailed(Exception):
    """Something required cannot be played: the block goes, with this warning."""

    def __init__(self, warning: Warning) -> None:
        super().__init__(warning.text)
        self.warning = warning


class _NeedsStretch(Exception):
    """More of the block fits if speech lasts longer or shorter."""

    def __init__(self, lengths: Mapping[str, Mapping[str, float]]) -> None:
        super().__init__(str(lengths))
        self.lengths = lengths


class _PlanBuilder:
    """A block while it is planned: what is left of it, and the warnings so far."""

    def __init__(self, block: Block, kinds: Mapping[str, BehaviourKind], context: PlanningContext) -> None:
        self.original = self.block = block
        self.kinds = kinds
        self.context = context
        self.timings: dict[str, Timing] = {}
        self.warnings: list[Warning] = []
        self.claims: tuple[ResourceClaim, ...] = ()

    def add_problems(self) -> None:
        """What the parser dropped."""
        for problem in self.block.problems:
            warning = Warning(problem.id, problem.type, str(problem))
            if problem.fatal:
                raise _RequiredPartFailed(warning)
            self.warnings.append(warning)

    def time(self) -> None:
        """Step 2: what the behaviours' kinds have against them, and what the others want of time."""
        gone: list[tuple[str, Warning]] = []
        context, utterances = self.context, self.context.utterances
        for node in self.block.behaviours:
            kind = self.kinds.get(node.tag)
            if kind is None:
                said = f"<{node.tag.rpartition('}')[2]}> is not known here"
                gone.append((node.id, self.warning("BEHAVIOR_TYPE_NOT_SUPPORTED", node.id, said)))
                continue
            found = kind.check(node, context)
            fatal = next((fault for fault in found if fault.fatal), None)
            if fatal is not None:
                gone.append((node.id, self.warning(fatal.type, node.id, fatal.text)))
            elif kind.speech_request is not None and node.id not in utterances:
                said = "speech: no voice could say it"
                gone.append((node.id, self.warning("CANNOT_CREATE_BEHAVIOR", node.id, said)))
            else:
                self.warnings += [self.warning(fault.type, node.id, fault.text) for fault in found]
                self.timings[node.id] = kind.timing(node, context)
        self.drop(gone)

    def schedule(
        self,
        start: float,
        outside: Callable[[SyncRef], float | None],
        existing_claims: Sequence[ResourceClaim],
        others: Sequence[Member],
    ) -> list[Schedule]:
        """Step 3: the times of what fits together, and of the others; solved again without what does not."""
        while True:
            priorities = {node.id: node.priority for node in self.block.behaviours if node.priority}
            own = Member(self.block, self.timings, priorities=priorities)
            found, *moved = schedule_together([own, *others], outside=outside)
            if found.failed or len(found.times) < len(self.timings):
                self.try_stretching(own, others, outside, found)
            warnings = [
                replace(w, text=self.with_place(self.behaviour_of(w), w.text)) for w in found.warnings
            ]
            if found.failed:
                raise _RequiredPartFailed(warnings[0])
            gone = self.timings.keys() - found.times.keys()
            self.drop([(self.behaviour_of(w), w) for w in warnings if self.behaviour_of(w) in gone])
            self.warnings += [w for w in warnings if self.behaviour_of(w) not in gone]
            whole = tuple(self.warnings)
            found = replace(found, start=start, character=self.block.character_id, warnings=whole)
            self.claims = tuple(claims(self.block, found, self.kinds, self.context))
            lost = conflicts(self.claims, existing_claims, start)
            if not lost:
                return [found, *moved]
            losers = ((loss.claim.behaviour, str(loss)) for loss in lost)
            self.drop((id, self.warning("CANNOT_CREATE_BEHAVIOR", id, said)) for id, said in losers)

    def expand(self, schedule: Schedule) -> dict[str, tuple[Channel, ...]]:
        """Step 4: what the scheduled behaviours show, in seconds from block start."""
        return {
            node.id: self.kinds[node.tag].expand(node, schedule.times[node.id], self.context)
            for node in self.block.behaviours
            if node.id in schedule.times
        }

    def try_stretching(
        self,
        own: Member,
        others: Sequence[Member],
        outside: Callable[[SyncRef], float | None],
        rigid: Schedule,
    ) -> None:
        """Where speech is in the way and could be spoken at another rate: raise _Bends if more fits then."""
        bent = dict(own.timings)
        for node in self.block.behaviours:
            if node.id in bent and (timing := self.kinds[node.tag].stretch(node, self.context)) is not None:
                bent[node.id] = timing
        could = {b: timing for b, timing in bent.items() if timing is not own.timings[b]}
        if not could:
            return
        found = schedule_together([replace(own, timings=bent), *others], outside=outside)[0]
        if found.failed or len(found.times) <= len(rigid.times):
            return
        at = {b: found.times[b] - found.times[b][0] for b in could if b in found.times}
        natural = {b: np.append(0.0, np.cumsum(own.timings[b].preferred)) for b in at}
        # A voice has one rate for all of a speech: of those its gaps ask for, the one that lets most fit.
        most = len(rigid.times)
        for b in at if len(at) == 1 else ():
            if could[b].most is None or self.context.utterances[b].stretch == WARP:
                continue
            gaps = own.timings[b].preferred
            asked = np.diff(at[b])[gaps > SHORT] / gaps[gaps > SHORT]
            for rate in sorted({round(float(r), 9) for r in asked}, key=lambda r: abs(r - 1.0)):
                evened = replace(own.timings[b], preferred=gaps * rate)
                fits = schedule_together(
                    [replace(own, timings={**own.timings, b: evened}), *others], outside=outside
                )[0]
                if not fits.failed and len(fits.times) > most:
                    most = len(fits.times)
                    at[b] = natural[b] * rate
        lengths = {
            b: dict(zip(could[b].points[1:], map(float, at[b][1:]), strict=True))
            for b in at
            if np.abs(at[b] - natural[b]).max() > SAME
        }
        if lengths:
            raise _NeedsStretch(lengths)

    def drop(self, gone: Iterable[tuple[str, Warning]]) -> None:
        """Take behaviours out, and what refers to them; each has one warning, which names what went too."""
        dropped = dict(gone)
        if not dropped:
            return
        for id in (node.id for node in self.block.behaviours if node.id in dropped):
            if id in self.block.required:
                warning = dropped[id]
                raise _RequiredPartFailed(replace(warning, text=f"{warning.text} (required {id})"))
        self.block, lost, fatal = without(self.block, dropped.keys())
        for id, warning in dropped.items():
            self.timings.pop(id, None)
            if id in fatal:
                raise _RequiredPartFailed(
                    replace(warning, text=f"{warning.text} (a required constraint names {id})")
                )
            if names := lost.get(id):
                more = len(names) - _MAX_LISTED
                listed = ", ".join(names[:_MAX_LISTED]) + (f" and {more} more" if more > 0 else "")
                warning = replace(warning, text=f"{warning.text}; with it went {listed}")
            # What else was to be said of it no longer matters.
            self.warnings = [w for w in self.warnings if w.id != warning.id]
            self.warnings.append(warning)

    def behaviour_of(self, warning: Warning) -> str:
        """The behaviour a warning is about; "" where it is about something else."""
        block, _, behaviour = warning.id.partition(":")
        return behaviour if block == self.original.id else ""

    def warning(self, type: str, behaviour: str, text: str) -> Warning:
        """What is to be said of a behaviour."""
        return Warning(f"{self.block.id}:{behaviour}", type, self.with_place(behaviour, text))

    def with_place(self, behaviour: str, text: str) -> str:
        """A sentence with the place of its behaviour."""
        place = self.original.places.get(behaviour)
        return text if place is None else place.with_place(text)
