"""Steps 2 to 4 of the pipeline for one block: timings, schedule and channels."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, NoReturn

import numpy as np

from bml_schema import Block, SyncRef, without
from bml_schema.errors import listed
from bml_schema.reading.dropped_references import without_constraints, without_references
from realizer.animation.channel import Channel
from realizer.behaviours.kind import BehaviourKind, PlanningContext
from realizer.core import work
from realizer.playback.references import external_refs
from realizer.playback.resources import ResourceClaim, after_interrupts, claims, conflicts, interrupts, trims
from realizer.scheduling import Member, schedule_together
from realizer.scheduling.schedule_block import RULES, Trial, settle
from realizer.scheduling.timing import UNKNOWN, Schedule, Timing, Warning
from realizer.speech.utterance import WARP

# s; a speech whose sync points move by no more than this is not synthesized again.
TIME_TOLERANCE = 1e-6
# s; the rate of a speech is not computed from shorter gaps.
MIN_RATE_GAP = 0.02


@dataclass(frozen=True)
class Plan:
    """A block that can be played."""

    block: Block  # without the dropped behaviours and the references to them
    # `failed` if a required behaviour cannot be played; the other attributes are then empty
    schedule: Schedule
    # behaviour id -> channels in seconds from block start
    channels: Mapping[str, tuple[Channel, ...]] = field(default_factory=dict)
    # the exclusive resources of its behaviours, on the clock of `schedule.start`
    claims: Sequence[ResourceClaim] = ()
    timings: Mapping[str, Timing] = field(default_factory=dict)  # behaviour id -> the timing that it prefers
    # the new schedules of linked blocks, each in seconds from its own start
    other_schedules: Sequence[Schedule] = ()
    # (block, behaviour) -> when a speech that plays has to end; only its final silence is cut
    trims: Mapping[tuple[str, str], float] = field(default_factory=dict)


def plan(
    block: Block,
    kinds: Mapping[str, BehaviourKind],
    context: PlanningContext,
    *,
    start: float = 0.0,
    external_times: Callable[[SyncRef], float | None] = lambda ref: None,
    existing_claims: Iterable[ResourceClaim] = (),
    others: Sequence[Member] = (),
    may_stretch: bool = True,
) -> Plan:
    """Schedule a block and expand it; drop behaviours that cannot be played, with one warning each.

    Args:
        context: with the utterances of the block's speech behaviours.
        start: seconds on the session clock.
        external_times: returns the time of a sync point of another block, in seconds from this block's
            start; None if it is unknown.
        existing_claims: claims of earlier blocks of this character, on the session clock.
        others: playing blocks that are solved with it, in seconds from this block's start.
        may_stretch: whether the plan may require speech of other lengths.
    """
    builder = _PlanBuilder(block, kinds, context, may_stretch)
    try:
        with work.limited(context.max_planning):
            builder.add_problems()
            builder.find_timings()
            schedule, *moved = builder.schedule(start, external_times, tuple(existing_claims), others)
            channels = builder.expand(schedule)
    except work.WorkLimitError as error:
        from realizer.core.settings import limit_hint

        text = f"{error}: wanted fewer behaviours, or fewer constraints {limit_hint('max_planning')}"
        warning = Warning(block.id, "IMPOSSIBLE_TO_SCHEDULE", text)
        fields: dict[str, Any] = {"warnings": (warning,), "failed": True, "over_limit": True}
    except _NoPlan as refusal:
        fields = refusal.fields
    else:
        return Plan(builder.block, schedule, channels, builder.claims, builder.timings, moved, builder.trims)
    return Plan(block, Schedule(block.id, {}, {}, start=start, **fields))


class _NoPlan(Exception):
    """The block has no plan; `fields` are the fields of its Schedule that say why."""

    def __init__(self, **fields: Any) -> None:
        super().__init__(str(fields))
        self.fields = fields


class _PlanBuilder:
    """The state of planning one block: its remaining behaviours, and the warnings so far."""

    def __init__(
        self, block: Block, kinds: Mapping[str, BehaviourKind], context: PlanningContext, may_stretch: bool
    ) -> None:
        self.may_stretch = may_stretch
        self.original = self.block = block
        self.kinds = kinds
        self.context = context
        self.timings: dict[str, Timing] = {}
        self.warnings: list[Warning] = []
        self.claims: tuple[ResourceClaim, ...] = ()
        self.trims: dict[tuple[str, str], float] = {}
        # Speeches that are placed one after the other, as `Member.sequences`; None if they must not be.
        self.sequences: list[tuple[str | float, str | float]] | None = []
        # Pairs of speeches, of which the second waits for the first.
        self.turns: dict[tuple[str, str], None] = {}

    def add_problems(self) -> None:
        for problem in self.block.problems:
            of_constraint = "/constraint[" in problem.path
            warning = Warning(problem.id, problem.type, str(problem), constraint=of_constraint)
            if problem.fatal:
                self.refuse(warning)
            self.warnings.append(warning)

    def find_timings(self) -> None:
        """Step 2: check the behaviours, and find the timings that they prefer."""
        dropped: list[tuple[str, Warning]] = []
        context, utterances = self.context, self.context.utterances
        for node in work.counted(self.block.behaviours, 5):
            kind = self.kinds.get(node.tag)
            if kind is None:
                text = f"<{node.tag.rpartition('}')[2]}> is not known here"
                dropped.append((node.id, self.warning("BEHAVIOR_TYPE_NOT_SUPPORTED", node.id, text)))
                continue
            faults = kind.check(node, context)
            fatal = next((fault for fault in faults if fault.fatal), None)
            if fatal is not None:
                dropped.append((node.id, self.warning(fatal.type, node.id, fatal.text)))
            elif kind.speech_request is not None and node.id not in utterances:
                text = "speech: no voice could say it"
                dropped.append((node.id, self.warning("CANNOT_CREATE_BEHAVIOR", node.id, text)))
            else:
                self.warnings += [self.warning(fault.type, node.id, fault.text) for fault in faults]
                self.timings[node.id] = kind.timing(node, context)
        self.drop(dropped)

    def schedule(
        self,
        start: float,
        external_times: Callable[[SyncRef], float | None],
        existing_claims: Sequence[ResourceClaim],
        others: Sequence[Member],
    ) -> list[Schedule]:
        """Step 3: solve for the times, and let things give way by `GIVES_WAY` until all that is left fits.

        In a block that refers to a time that is not known yet, behaviours hold their poses until then.
        """
        if any(_is_unknown_yet(external_times, ref) for ref in external_refs(self.block)):
            self.timings = {b: timing.with_hold for b, timing in self.timings.items()}
        self.start, self.existing_claims = start, existing_claims
        trial = Trial([self.member(), *others], external_times, self.context.grace)
        settle(trial, [*RULES, *(partial(rule, self) for rule in GIVES_WAY)])
        # A dropped constraint must not bind the block when it is planned again, or others with it.
        self.block = without_references(self.block, self.solved[0].released)
        self.block = without_constraints(self.block, self.lost_constraints)
        more = (*self.solved[0].warnings, *self.waits(), *self.reviews())
        self.solved[0] = replace(self.solved[0], warnings=more)
        return self.solved

    def member(self) -> Member:
        """Return what is left of the block, to be scheduled."""
        priorities = {node.id: node.priority for node in self.block.behaviours if node.priority}
        sequences = (*(self.sequences or ()), *self.turns)
        return Member(self.block, self.timings, priorities=priorities, sequences=sequences)

    def begin_again(self, trial: Trial) -> bool:
        """Let what is left be solved again; constraints that were lost count again."""
        trial.begin_again([self.member(), *trial.members[1:]])
        return True

    def stretch_speech(self, trial: Trial) -> bool:
        """The rate of speech goes, if more of the block fits then: it has to be planned with such speech."""
        self.solved = trial.schedules()
        if self.is_incomplete and self.may_stretch and (lengths := self.better_lengths(trial)):
            raise _NoPlan(lengths=lengths)
        return False

    def leave_sequence(self, trial: Trial) -> bool:
        """The order of speeches that overlap goes, if with it something else does not fit."""
        if not (self.is_incomplete and self.sequences):
            return False
        self.sequences = None
        return self.begin_again(trial)

    def leave_out_unplaced(self, trial: Trial) -> bool:
        """A behaviour that could not be placed goes, and what refers to it; the block, if it is required."""
        schedule = self.solved[0]
        warnings = [
            replace(w, text=self.with_place(self.behaviour_of(w), w.text))
            for w in work.counted(schedule.warnings, 5)
        ]
        if schedule.failed:
            self.refuse(warnings[0])
        self.lost_constraints = [self.block.constraints[n] for n in schedule.lost_constraints]
        unscheduled = self.timings.keys() - schedule.times.keys()
        about = [(self.behaviour_of(w), w) for w in warnings]
        self.drop([(id, w) for id, w in about if id in unscheduled])
        all_warnings = (*self.warnings, *(w for id, w in about if id not in unscheduled))
        schedule = replace(schedule, start=self.start, warnings=all_warnings)
        self.solved[0] = schedule
        self.claims = tuple(claims(self.block, schedule, self.kinds, self.context))
        remaining = after_interrupts(self.existing_claims, interrupts(self.block, schedule))
        # Speech may begin in a final silence of its own block if that speech cannot be faster.
        self.conflicts = conflicts(self.claims, remaining, self.start, in_silence=self.sequences is None)
        self.trims = {} if self.conflicts else dict(trims(self.claims, remaining))
        return False

    def speak_in_sequence(self, trial: Trial) -> bool:
        """The time of speeches that overlap a little goes: they are placed one after the other.

        That is tried once, for all that is found.
        """
        new = {pair for conflict in self.conflicts if (pair := conflict.sequence) is not None}
        if self.sequences is None or not (new := new.difference(self.sequences)):
            return False
        self.sequences += new
        return self.begin_again(trial)

    def speak_in_turn(self, trial: Trial) -> bool:
        """The time of speech goes that has none of its own, or that ends after the speech it begins in."""
        known = len(self.turns)
        self.turns |= dict.fromkeys(self.found_turns())
        return len(self.turns) > known and self.begin_again(trial)

    def found_turns(self) -> Iterator[tuple[str, str]]:
        """Yield pairs of speeches of this block that conflict: one, and one that can wait for its end."""
        last, released = "", {*self.solved[0].released}
        for conflict in self.conflicts:
            claim, winner = conflict.claim, conflict.winner
            if claim.resource != "voice" or winner.block != claim.block:
                continue
            points = {f"{claim.behaviour}:{point}" for point, _ in self.block[claim.behaviour].references}
            if points <= released:
                yield winner.behaviour, claim.behaviour
                if last:
                    yield last, claim.behaviour
                last = claim.behaviour
            elif winner.begin < claim.begin and winner.end < claim.end:
                yield winner.behaviour, claim.behaviour
            elif claim.begin < winner.begin and claim.end < winner.end:
                yield claim.behaviour, winner.behaviour

    def waits(self) -> Iterator[Warning]:
        """Yield a warning for each speech that waits for another one."""
        schedule = self.solved[0]
        for later, earlier in {later: earlier for earlier, later in self.turns}.items():
            if later in schedule.times and f"{later}:start" not in schedule.released:
                begin = float(schedule.times[later][0])
                text = f"start: wanted a time at which nothing else is said; {later} waits for {earlier}"
                yield self.warning("IMPOSSIBLE_TO_SCHEDULE", later, f"{text} until {begin:.3g} s")

    def reviews(self) -> Iterator[Warning]:
        """Yield a warning for each behaviour whose times are not what it says itself."""
        for node in self.block.behaviours:
            review = self.kinds[node.tag].review
            if review is not None and (text := review(node, self.solved[0].times[node.id])):
                yield self.warning("IMPOSSIBLE_TO_SCHEDULE", node.id, text)

    def drop_losers(self, trial: Trial) -> bool:
        """A behaviour goes that wants what another one has: one of an earlier block, or of higher rank."""
        losers = ((found.claim.behaviour, str(found)) for found in work.counted(self.conflicts, 10))
        self.drop((id, self.warning("CANNOT_CREATE_BEHAVIOR", id, text)) for id, text in losers)
        return bool(self.conflicts) and self.begin_again(trial)

    @property
    def is_incomplete(self) -> bool:
        """Whether some of the block could not be placed."""
        return self.solved[0].failed or self.solved[0].fit < (len(self.timings), 0)

    def expand(self, schedule: Schedule) -> dict[str, tuple[Channel, ...]]:
        """Step 4: return the channels of the scheduled behaviours, in seconds from block start."""
        channels: dict[str, tuple[Channel, ...]] = {}
        for node in self.block.behaviours if self.context.animates else ():
            if node.id in schedule.times:
                work.count(50)
                channels[node.id] = self.kinds[node.tag].expand(node, schedule.times[node.id], self.context)
        return channels

    def better_lengths(self, trial: Trial) -> dict[str, dict[str, float]]:
        """Return lengths of speech, as of a Schedule, with which more behaviours fit; {} for none."""
        own, rigid = self.member(), self.solved[0]
        nodes = [node for node in self.block.behaviours if node.id in own.timings]
        found = {node.id: self.kinds[node.tag].stretch(node, self.context) for node in nodes}
        stretchable = {b: timing for b, timing in found.items() if timing is not None}
        if not stretchable:
            return {}

        def solved(timings: Mapping[str, Timing]) -> Schedule:
            members = [replace(own, timings=timings), *trial.members[1:]]
            return schedule_together(members, outside=trial.outside, grace=trial.grace)[0]

        stretched = solved({**own.timings, **stretchable})
        if stretched.failed or stretched.fit <= rigid.fit:
            return {}
        if self.sequences and stretched.released:
            return {}  # without the sequence, nothing may have to be given up
        points = {b: stretched.times[b] - stretched.times[b][0] for b in stretchable if b in stretched.times}
        natural = {b: np.append(0.0, np.cumsum(own.timings[b].preferred)) for b in points}
        # Some voices have one rate for a whole speech. Of the rates of the stretched gaps, take the one with
        # which most behaviours can be scheduled.
        best = rigid.fit
        for b in points if len(points) == 1 else ():
            if stretchable[b].most is None or self.context.utterances[b].stretch == WARP:
                continue
            gaps = own.timings[b].preferred
            rates = np.diff(points[b])[gaps > MIN_RATE_GAP] / gaps[gaps > MIN_RATE_GAP]
            for rate in sorted({round(float(r), 9) for r in rates}, key=lambda r: abs(r - 1.0)):
                at_rate = solved({**own.timings, b: replace(own.timings[b], preferred=gaps * rate)})
                if not at_rate.failed and at_rate.fit > best:
                    best = at_rate.fit
                    points[b] = natural[b] * rate
        return {
            b: dict(zip(stretchable[b].points[1:], map(float, points[b][1:]), strict=True))
            for b in points
            if np.abs(points[b] - natural[b]).max() > TIME_TOLERANCE
        }

    def drop(self, warnings: Iterable[tuple[str, Warning]]) -> None:
        """Drop behaviours, by id, and the references to them; each one's warning names both."""
        dropped = dict(warnings)
        if not dropped:
            return
        for id in (node.id for node in self.block.behaviours if node.id in dropped):
            if id in self.block.required:
                self.refuse(dropped[id], f" (required {id})")
        self.block, removed_references, fatal = without(self.block, dropped.keys())
        # The new warnings replace earlier ones about the behaviours.
        replaced = {warning.id for warning in dropped.values()}
        self.warnings = [w for w in self.warnings if w.id not in replaced]
        for id, warning in work.counted(dropped.items(), 5):
            self.timings.pop(id, None)
            if id in fatal:
                self.refuse(warning, f" (a required constraint names {id})")
            if names := removed_references.get(id):
                warning = replace(warning, text=f"{warning.text}; with it went {listed(names)}")
            self.warnings.append(warning)

    def refuse(self, warning: Warning, more: str = "") -> NoReturn:
        warning = replace(warning, id=self.original.id, text=warning.text + more)
        raise _NoPlan(warnings=(warning,), failed=True)

    def behaviour_of(self, warning: Warning) -> str:
        """Return the behaviour that a warning is about, or ""."""
        block, _, behaviour = warning.id.partition(":")
        return behaviour if block == self.original.id else ""

    def warning(self, type: str, behaviour: str, text: str) -> Warning:
        return Warning(f"{self.block.id}:{behaviour}", type, self.with_place(behaviour, text))

    def with_place(self, behaviour: str, text: str) -> str:
        place = self.original.places.get(behaviour)
        return text if place is None else place.with_place(text)


# What else gives way in a new block, in this order, after the `RULES` of what is scheduled together.
GIVES_WAY: tuple[Callable[[_PlanBuilder, Trial], bool], ...] = (
    _PlanBuilder.stretch_speech,
    _PlanBuilder.leave_sequence,
    _PlanBuilder.leave_out_unplaced,
    _PlanBuilder.speak_in_sequence,
    _PlanBuilder.speak_in_turn,
    _PlanBuilder.drop_losers,
)


def _is_unknown_yet(external_times: Callable[[SyncRef], float | None], ref: SyncRef) -> bool:
    """Whether a reference is to an anticipated point, such as the end of an open speech."""
    with suppress(LookupError):
        return (external_times(ref) or 0.0) > UNKNOWN
    return False
