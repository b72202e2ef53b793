"""The behaviours of a planned block on the session clock: channels, base states and speech."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain

import numpy as np

from bml_schema import VOCABULARY, Block, Speech, SyncRef, Wait
from realizer.animation.channel import Channel, Gain, Layer, later
from realizer.animation.curves import crossfade
from realizer.animation.idle.prosody import KnownMotion
from realizer.behaviours.kind import BehaviourKind, PlanningContext
from realizer.core import work
from realizer.core.array_types import Float64
from realizer.playback.block_planner import Plan
from realizer.playback.character import RELAX, BaseShift
from realizer.playback.references import external_refs
from realizer.playback.resources import claims
from realizer.playback.scheduled_speech import SPEECH_FADE, ScheduledSpeech
from realizer.scheduling.timing import Schedule
from realizer.speech.utterance import Utterance

# Layers that add to the ones below: there, a channel of zeros moves nothing. In others, 0 is a pose.
ADDED = frozenset({Layer.EXPRESSION, Layer.HEAD, Layer.SPEECH})
# Rounding of times that are solved again.
SAME = 1e-9  # s


@dataclass(eq=False)
class PlacedBlock:
    """A planned block, whose behaviours can be moved, changed and cut off without a jump of the face."""

    plan: Plan  # its schedule has the start, which is inf while unknown (the block was not activated)
    kinds: Mapping[str, BehaviourKind]
    context: PlanningContext  # the context of its planning
    character: int  # index of its character
    # channels, shifts, speech: by behaviour, on the session clock; empty while the start is unknown
    channels: dict[str, tuple[Channel, ...]] = field(init=False, default_factory=dict)
    shifts: dict[str, BaseShift] = field(init=False, default_factory=dict)
    speech: dict[str, ScheduledSpeech] = field(init=False, default_factory=dict)
    # behaviour -> when its place on the session clock became known
    known_since: dict[str, float] = field(init=False, default_factory=dict)
    whole_schedule: Schedule | None = field(init=False, default=None)  # before some was cut off, or None
    external_refs: tuple[SyncRef, ...] = field(init=False)  # its references into other blocks
    first_schedule: Schedule = field(init=False)  # its schedule when it was accepted

    def __post_init__(self) -> None:
        self.first_schedule = self.plan.schedule
        self.external_refs = external_refs(self.block)

    @property
    def block(self) -> Block:
        return self.plan.block

    @property
    def schedule(self) -> Schedule:
        return self.plan.schedule

    @property
    def start(self) -> float:
        """When it starts or started, seconds on the session clock; inf while unknown."""
        return self.schedule.start

    @property
    def wants(self) -> bool:
        """Whether it asks for more than times and commands, or has lost something that did."""
        nodes = self.block.behaviours
        shown = any(self.kinds[n.tag].command is None and not isinstance(n, Wait) for n in nodes)
        return shown or bool(self.first_schedule.dropped or self.schedule.dropped)

    @property
    def plays(self) -> bool:
        """Whether anything of it is heard or moves the face, beside idle motion; plug-ins may do more."""
        if self.shifts or any(map(_moves, self.moving_channels())):
            return True
        if any(node.tag not in VOCABULARY for node in self.block.behaviours):
            return True
        sounds = (speaking.utterance.pcm for speaking in self.speech.values())
        return any(pcm is not None and pcm.any() for pcm in sounds)

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
                    begin,
                    float("inf") if is_complete else end,
                    sound,
                    self.character,
                    text=node.text if isinstance(node, Speech) else None,
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

    def cut(self, behaviours: Collection[str], now: float, *, ends: bool = False) -> list[str]:
        """End behaviours at `now`: visible ones relax without a jump, those that have not begun are removed.

        Their past sync points stay. Relax is at once, and the end is after the face has relaxed, or at once
        with `ends`, if the whole block is cut off.

        Returns:
            The behaviours that were removed.
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
        self.plan = replace(self.plan, schedule=schedule, claims=left, timings=timings)
        return not_begun

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


def _moves(channel: Channel) -> bool:
    return channel.layer not in ADDED or bool(channel.values.any())
