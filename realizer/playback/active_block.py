"""An accepted block on the session clock, while it waits or plays."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from typing import Literal

import numpy as np

from bml_schema import Block, SyncRef, without
from realizer.animation.channel import Channel, Gain, Layer, later
from realizer.animation.curves import crossfade
from realizer.animation.idle.prosody import KnownMotion
from realizer.behaviours.kind import BehaviourKind, PlanningContext
from realizer.core import work
from realizer.core.array_types import Float64
from realizer.playback.block_planner import Plan
from realizer.playback.block_states import BlockEvent, State, next_state
from realizer.playback.character import RELAX, BaseShift
from realizer.playback.references import external_refs
from realizer.playback.resources import claims
from realizer.playback.scheduled_speech import SPEECH_FADE, ScheduledSpeech
from realizer.scheduling.timing import UNKNOWN, Schedule
from realizer.speech.utterance import Utterance

# Rounding of times that are solved again.
SAME = 1e-9  # s


# Attribute of a block -> the time for which another block waits.
BlockMoment = Literal["end", "subsides_at", "speaks_until"]


@dataclass(frozen=True, eq=False)
class Dependency:
    """A block that another one waits for: for its end, until it subsides, or until its speech is over."""

    block: ActiveBlock
    moment: BlockMoment = "end"

    @property
    def until(self) -> float:
        time: float = getattr(self.block, self.moment)
        return time


@dataclass(eq=False)
class ActiveBlock:
    """An accepted block, until it has ended and its last frames are past."""

    plan: Plan  # its schedule has the start, which is inf while unknown (the block was not activated)
    kinds: Mapping[str, BehaviourKind]
    context: PlanningContext  # the context of its planning
    character: int  # index of its character
    number: int  # order of arrival, from 1
    not_before: float  # its earliest start, seconds on the session clock
    # blocks that it waits for; empty once it has started
    dependencies: list[Dependency] = field(default_factory=list)
    state: State = State.LURKING
    stopped_at: float | None = None  # when it was cut off, or None
    # channels, shifts, speech: by behaviour, on the session clock; empty while the start is unknown
    channels: dict[str, tuple[Channel, ...]] = field(default_factory=dict)
    shifts: dict[str, BaseShift] = field(default_factory=dict)
    speech: dict[str, ScheduledSpeech] = field(default_factory=dict)
    # behaviour -> when its place on the session clock became known
    known_since: dict[str, float] = field(default_factory=dict)
    followers: list[ActiveBlock] = field(default_factory=list)  # blocks that wait for it
    whole_schedule: Schedule | None = None  # its schedule before some of it was cut off; None if nothing was
    # at one instant it reports before blocks of a higher order, as of `set_order`
    order: tuple[int, int, int] = field(init=False)
    external_refs: tuple[SyncRef, ...] = field(init=False)  # its references into other blocks
    first_schedule: Schedule = field(init=False)  # its schedule when it was accepted

    def __post_init__(self) -> None:
        self.first_schedule = self.plan.schedule
        self.external_refs = external_refs(self.block)
        self.order = self.number, 0, self.number
        for wait in self.dependencies:
            wait.block.followers.append(self)

    @property
    def block(self) -> Block:
        return self.plan.block

    @property
    def schedule(self) -> Schedule:
        return self.plan.schedule

    @property
    def latest(self) -> Schedule:
        """Its present schedule, with the warnings of the first one too."""
        return self._with_first_warnings(self.schedule)

    @property
    def whole(self) -> Schedule:
        """The same as if nothing of it had been cut off."""
        return self._with_first_warnings(self.whole_schedule or self.schedule)

    def _with_first_warnings(self, schedule: Schedule) -> Schedule:
        first = self.first_schedule
        if schedule.start == float("inf"):
            return first
        more = tuple(w for w in schedule.warnings if w not in first.warnings)
        return replace(schedule, warnings=first.warnings + more)

    @property
    def has_begun(self) -> bool:
        return self.state in (State.IN_EXEC, State.SUBSIDING)

    @property
    def is_done(self) -> bool:
        return self.state in (State.DONE, State.INTERRUPTED, State.REVOKED)

    @property
    def is_revoked(self) -> bool:
        return self.state is State.REVOKED

    @property
    def is_waiting(self) -> bool:
        return self.state in (State.PENDING, State.LURKING)

    @property
    def start(self) -> float:
        """When it starts or started, seconds on the session clock; inf while unknown."""
        return self.schedule.start

    @property
    def has_known_start(self) -> bool:
        """Whether its start is known: it waits neither for activation nor for the end of an open speech."""
        return self.start < self.not_before + UNKNOWN

    @property
    def end(self) -> float:
        return self.schedule.end if self.stopped_at is None else self.stopped_at

    def words_spoken(self, now: float) -> str | None:
        """Return the words heard completely before its speech was cut off; None if it was not."""
        spoken = [b for b in self.context.utterances if b in self.first_schedule.times]
        speeches = [self.speech[b] for b in spoken if b in self.speech]
        if len(speeches) == len(spoken) and all(s.is_complete(now) for s in speeches):
            return None
        order = sorted(speeches, key=lambda s: s.start)
        return " ".join(word for s in order for word in s.words(now))

    @property
    def invisible_after(self) -> float:
        """The time after which it is no longer visible."""
        return self.end + (RELAX if self.state is State.INTERRUPTED else 0.0)

    @property
    def subsides_at(self) -> float:
        """When every behaviour is past its relax, or its end if it has no relax."""
        if self.stopped_at is not None:
            return self.stopped_at
        last, schedule = 0.0, self.schedule
        for points, times in work.counted(
            zip(schedule.points.values(), schedule.times.values(), strict=True)
        ):
            last = max(last, float(times[points.index("relax") if "relax" in points else -1]))
        return self.start + last

    @property
    def speaks_until(self) -> float:
        """When all has ended but what only moves the face."""
        if self.stopped_at is not None:
            return self.stopped_at
        moving = self.channels.keys() | self.shifts.keys()
        times = self.schedule.times.items()
        return self.start + max(
            (float(t[-1]) for b, t in times if b in self.speech or b not in moving), default=0.0
        )

    @property
    def earliest(self) -> float:
        """Its earliest start; inf while it or a block that it waits for is not activated."""
        if self.state is State.PENDING:
            return float("inf")
        return max([self.not_before, *(wait.until for wait in self.dependencies)])

    def refers_to(self, other: ActiveBlock) -> bool:
        return any(ref.block == other.block.id for ref in self.external_refs)

    def change_state(self, event: BlockEvent) -> None:
        self.state = next_state(self.state, event)

    def set_order(self) -> None:
        """Set its order: blocks report as they arrived, but behind those that they wait for."""
        behind = (
            (first, depth + 1, self.number) for first, depth, _ in (w.block.order for w in self.dependencies)
        )
        self.order = max([(self.number, 0, self.number), *behind])

    def add_dependency(self, wait: Dependency) -> None:
        self.dependencies.append(wait)
        wait.block.followers.append(self)

    def pass_on_dependencies(self) -> None:
        """Let the blocks that were appended to it wait for what it waits for, because it will not start."""
        own = [
            w.block for w in self.dependencies if w.block.character == self.character and not w.block.is_done
        ]
        for other in self.followers if own else ():
            if other.is_waiting and other.block.composition == "APPEND" and other.character == self.character:
                for dependency in own:
                    if dependency.number < other.number:
                        other.add_dependency(Dependency(dependency))

    def apply_plan(self, plan: Plan, start: float, now: float) -> None:
        """Place a plan on the session clock at `now`, with its channels, base states and speech."""
        if plan.block is not self.block:
            self.external_refs = external_refs(plan.block)
        if start != plan.schedule.start:
            delay = start - plan.schedule.start
            shifted = tuple(claim.shifted(delay) for claim in plan.claims)
            plan = replace(plan, schedule=replace(plan.schedule, start=start), claims=shifted)
        before, self.plan = self.schedule, plan
        self.channels, self.shifts, self.speech = {}, {}, {}
        if start == float("inf"):
            return
        for behaviour, times in self.schedule.times.items():
            work.count(20)
            node = self.block[behaviour]
            kind = self.kinds[node.tag]
            own = self._placed(behaviour, plan.channels.get(behaviour, ()))
            begin, end = start + float(times[0]), start + float(times[-1])
            if start != before.start or not np.array_equal(times, before.times.get(behaviour, ())):
                self.known_since[behaviour] = now
            self.known_since.setdefault(behaviour, now)
            if kind.region is not None:
                self.shifts[behaviour] = BaseShift.of(begin, end, kind.region, own)
            elif own:
                self.channels[behaviour] = own
            sound = kind.sound(node, self.context)
            if sound is not None:
                is_complete = end - begin >= sound.duration - 1e-6
                self.speech[behaviour] = ScheduledSpeech(
                    begin, float("inf") if is_complete else end, sound, self.character
                )

    def unfinished(self, now: float) -> set[str]:
        return {b for b, times in self.schedule.times.items() if self.start + float(times[-1]) > now}

    def retime(self, schedule: Schedule, now: float) -> list[str]:
        """Change the times of sync points that have not passed; visible curves continue without a jump.

        The schedule is from the same start, and unchanged before `now`. Return the behaviours whose times
        changed.
        """
        changed = [
            b
            for b, times in schedule.times.items()
            if not np.allclose(times, self.schedule.times[b], rtol=0.0, atol=SAME)
        ]
        if not changed:
            return []
        times = {b: schedule.times[b] if b in changed else t for b, t in self.schedule.times.items()}
        before = self.schedule
        own = replace(before, times=times)
        self.plan = replace(self.plan, schedule=own)
        for behaviour in changed:
            node = self.block[behaviour]
            expanded = self.kinds[node.tag].expand(node, times[behaviour], self.context)
            new = self._placed(behaviour, expanded)
            begun = self.start + float(before.times[behaviour][0]) < now
            region = self.kinds[node.tag].region
            if region is not None:
                old = self.shifts[behaviour].channels
                begin, end = (self.start + float(times[behaviour][k]) for k in (0, -1))
                self.shifts[behaviour] = BaseShift.of(
                    begin, end, region, crossfade(old, new, now) if begun else new
                )
            elif new:
                old = self.channels.get(behaviour, ())
                moves = begun or any(channel.span[0] < now for channel in old)
                self.channels[behaviour] = crossfade(old, new, now) if moves else new
            if not begun:
                self.known_since[behaviour] = now
            if behaviour in self.speech and not begun:
                delay = float(times[behaviour][0]) - float(before.times[behaviour][0])
                speech = self.speech[behaviour]
                self.speech[behaviour] = replace(
                    speech, start=speech.start + delay, until=speech.until + delay
                )
        self.plan = replace(self.plan, claims=tuple(claims(self.block, own, self.kinds, self.context)))
        return changed

    def update_speech(self, behaviour: str, utterance: Utterance, now: float) -> None:
        """Replace the utterance of a speech; its points that have passed stay where they were.

        The schedule is not changed: the caller computes new times and passes them to `retime`.
        """
        self.context = replace(self.context, utterances={**self.context.utterances, behaviour: utterance})
        node = self.block[behaviour]
        wanted = self.kinds[node.tag].timing(node, self.context)
        was = dict(zip(self.schedule.points[behaviour], self.schedule.times[behaviour], strict=True))
        local = now - self.start
        at: list[float] = []
        new = np.concatenate([[0.0], np.cumsum(wanted.preferred)])
        for point, time in zip(wanted.points, new + was["start"], strict=True):
            passed = was.get(point, np.inf)
            # Future points are at the times of the new utterance, but not before now.
            at.append(float(passed) if passed <= local else max(float(time), local if at else float(time)))
        gaps = np.diff(np.maximum.accumulate(at))
        timing = replace(wanted, preferred=gaps, least=gaps)
        points = {**self.schedule.points, behaviour: wanted.points}
        times = {**self.schedule.times, behaviour: np.array([was.get(p, np.nan) for p in wanted.points])}
        self.plan = replace(
            self.plan,
            timings={**self.plan.timings, behaviour: timing},
            schedule=replace(self.schedule, points=points, times=times),
        )
        if behaviour in self.speech:
            self.speech[behaviour] = replace(self.speech[behaviour], utterance=utterance)

    def saved(self) -> tuple[Plan, PlanningContext, dict[str, ScheduledSpeech]]:
        return self.plan, self.context, dict(self.speech)

    def restore(self, saved: tuple[Plan, PlanningContext, dict[str, ScheduledSpeech]]) -> None:
        self.plan, self.context, self.speech = saved

    def _placed(self, behaviour: str, channels: Sequence[Channel]) -> tuple[Channel, ...]:
        return later(channels, self.start, f"{self.block.id}:{behaviour}")

    def cut(self, behaviours: Collection[str], now: float, *, ends: bool = False) -> None:
        """End behaviours at `now`: visible ones relax without a jump, those that have not begun are removed.

        Their past sync points stay. Relax is at once, and the end is after the face has relaxed, or at once
        with `ends`, if the whole block is cut off.
        """
        self.whole_schedule = self.whole_schedule or self.schedule
        points, times = dict(self.schedule.points), dict(self.schedule.times)
        not_begun: list[str] = []
        for behaviour in behaviours:
            names, at = points[behaviour], times[behaviour]
            local = now - self.start
            if local <= at[0]:
                not_begun.append(behaviour)
                del points[behaviour], times[behaviour]
            elif local < at[-1]:
                points[behaviour], times[behaviour] = self._cut_times(behaviour, names, at, local, ends)
            else:
                continue
            if behaviour in self.channels:  # what moves ahead of its start, such as lips, has been seen
                self.channels[behaviour] = tuple(
                    c.faded(now, now + (SPEECH_FADE if c.layer is Layer.SPEECH else RELAX))
                    if behaviour not in not_begun or c.span[0] < now
                    else c.changed({"until": now})
                    for c in self.channels[behaviour]
                )
            if behaviour in self.speech:
                speech = self.speech[behaviour]
                self.speech[behaviour] = replace(speech, until=min(speech.until, now))
        left = tuple(c for c in self.plan.claims if c.behaviour not in behaviours)
        timings = {b: timing for b, timing in self.plan.timings.items() if b not in behaviours}
        schedule = replace(self.schedule, points=points, times=times)
        # A waiting block may be planned again.
        block = without(self.block, not_begun).block if not_begun and self.is_waiting else self.block
        self.plan = replace(self.plan, block=block, schedule=schedule, claims=left, timings=timings)

    def _cut_times(
        self, behaviour: str, names: tuple[str, ...], at: Float64, local: float, ends: bool
    ) -> tuple[tuple[str, ...], Float64]:
        times = {name: float(time) for name, time in zip(names, at, strict=True) if time <= local}
        if "relax" in names:
            times.setdefault("relax", local)
        visible = "relax" in names or behaviour in self.channels or behaviour in self.shifts
        relax = 0.0 if ends else SPEECH_FADE if behaviour in self.speech else RELAX if visible else 0.0
        times["end"] = min(local + relax, float(at[-1]))
        return tuple(times), np.array(list(times.values()))

    def scale(self, behaviour: str, gains: Collection[Gain], *, sound: bool) -> None:
        """Scale the sound of a behaviour, or all its channels."""
        if sound and behaviour in self.speech:
            speech = self.speech[behaviour]
            self.speech[behaviour] = replace(speech, gains=(*speech.gains, *gains))
        elif not sound:
            own = self.channels.get(behaviour, ())
            self.channels[behaviour] = tuple(replace(c, gains=(*c.gains, *gains)) for c in own)

    def moving_channels(self) -> Iterator[Channel]:
        return chain.from_iterable(self.channels.values())

    def known_motions(self) -> Iterator[KnownMotion]:
        """Yield its channels that are not base states, with the times at which they became known."""
        for behaviour, channels in self.channels.items():
            since = self.known_since[behaviour]
            for channel in channels:
                yield KnownMotion(since if channel.crossfade is None else channel.crossfade.at, channel)
