"""Which blocks are alive: documents are composed here, their feedback comes due and their faces are sampled.

Knows no clock and no I/O: every call is told `now`, in seconds on the session clock.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bml_schema import Block, Feedback, SyncRef, WarningFeedback
from realizer.animation.blend import blend
from realizer.animation.channel import Channel, Layer
from realizer.animation.frames import AUFrames
from realizer.animation.idle import idle_channels
from realizer.animation.targets import AU_NAMES
from realizer.arrays import Float64
from realizer.behaviours import KINDS
from realizer.behaviours.kind import Kind, Position, World
from realizer.character import RELAX, Character, Shift
from realizer.planning import plan
from realizer.reporting import Event, acknowledgement, events, prediction, progress
from realizer.scheduling.timing import Schedule, Warning
from realizer.speech.utterance import Say, Utterance

__all__ = ["Player", "Speaking"]

# Sound and lips stop faster than a face relaxes, so that a barge-in is heard at once.
HUSH = 0.12  # s
# Frames up to this long before `now` can still be asked for.
KEPT = 1.0  # s


@dataclass(frozen=True, eq=False)
class Speaking:
    """An utterance that sounds from `start` on, cut off (with a short fade) at `until` if that is sooner."""

    start: float
    until: float
    utterance: Utterance
    character: int


@dataclass(eq=False)
class Playing:
    """A block that was accepted, until it has ended and its last frames are past."""

    block: Block
    schedule: Schedule
    character: int
    number: int  # order of acceptance
    channels: tuple[Channel, ...]  # on the session clock
    shifts: tuple[Shift, ...]
    speech: tuple[Speaking, ...]
    ended: float  # when its end feedback is due; moved to `now` when it is stopped
    started: bool = False
    done: bool = False


class Player:
    """The blocks of one session and what they show.

    Args:
        kinds: tag -> Kind, what behaviours there are.
        scene: target name -> (x, y, z) metres; None while no scene was declared.
        seed: for idle motion and anything else random.
        idle: blinks and small head motion between and under the behaviours.
        language: BCP-47 of speech that does not name its own.

    Attributes:
        revision: rises whenever frames change that were already computed; `changed_from` says from when on.
    """

    def __init__(
        self,
        *,
        kinds: Mapping[str, Kind] = KINDS,
        scene: Mapping[str, Position] | None = None,
        seed: int = 0,
        idle: bool = True,
        language: str = "en-US",
    ) -> None:
        self.kinds = kinds
        self.world = World(scene=scene, seed=seed, language=language)
        self.idle = idle
        self.revision = 0
        self.changed_from = 0.0
        self._characters: list[Character] = [Character(None)]
        self._playing: list[Playing] = []
        self._past: dict[str, Schedule] = {}
        self._announced: set[str] = set()
        self._outbox: list[Feedback] = []
        self._events: list[Event] = []
        self._number = 0

    # documents in -------------------------------------------------------------------------------

    def wants(self, block: Block) -> dict[str, Say]:
        """{behaviour id: what a voice has to say} before the block can be submitted."""
        says: dict[str, Say] = {}
        for node in block.behaviours:
            kind = self.kinds.get(node.tag)
            if kind is not None and kind.say is not None and (say := kind.say(node, self.world)) is not None:
                says[node.id] = say
        return says

    def announce(self, block: Block, now: float) -> None:
        """Acknowledge a block: planning has begun. `submit` does it where it was not done before."""
        if block.id not in self._announced and not self._in_use(block):
            self._announced.add(block.id)
            self._outbox.append(acknowledgement(block, self._start_of(block, now)))

    def submit(self, block: Block, now: float, utterances: Mapping[str, Utterance] | None = None) -> Schedule:
        """Plan a block and let it play as its composition says.

        Args:
            block: as parsed; its own problems are reported with it.
            now: seconds on the session clock.
            utterances: what the voice made of `wants(block)`.

        Returns:
            The schedule; `schedule.failed` when the whole block was refused.
        """
        self._collect(now)
        self.announce(block, now)
        self._announced.discard(block.id)
        character = self._character(block.character_id)
        if self._in_use(block):
            text = f"block id {block.id!r} is still in use: wanted an id of no block that plays or waits"
            return self._refused(block, Warning(block.id, "PARSING_FAILURE", text), now)
        start = self._start_of(block, now)
        world = replace(self.world, utterances=dict(utterances or {}))
        planned = plan(block, self.kinds, world, outside=lambda ref: self._outside(ref, start))
        schedule = replace(planned.schedule, start=start, character=block.character_id)
        if schedule.failed:
            for warning in schedule.warnings:
                self.refuse(warning, now, block.character_id)
            return schedule
        if block.composition == "REPLACE":
            for earlier in self._alive():
                if earlier.character == character:
                    self._stop(earlier, now)
        self._accept(block, schedule, character, planned.channels, world, now)
        return schedule

    def refuse(self, warning: Warning, now: float, character: str | None = None) -> None:
        """Report a document, block or behaviour that cannot be played."""
        self._outbox.append(
            WarningFeedback(id=warning.id, type=warning.type, text=warning.text, character_id=character)
        )

    def stop(self, now: float, block_ids: Iterable[str] | None = None) -> list[str]:
        """End blocks gracefully: sound fades, the face relaxes to its base without a jump.

        Args:
            block_ids: which; None for all that play or wait.

        Returns:
            The ids of the blocks that were stopped.
        """
        self._collect(now)
        wanted = None if block_ids is None else set(block_ids)
        stopped = [p for p in self._alive() if wanted is None or p.block.id in wanted]
        for playing in stopped:
            self._stop(playing, now)
        return [p.block.id for p in stopped]

    def withdraw(self, block: Block, now: float) -> None:
        """Give up a block that was announced and will not be submitted; its end is reported."""
        self._announced.discard(block.id)
        self._outbox.append(progress(block, "end", now, "REVOKED"))

    @property
    def alive(self) -> int:
        """How many blocks play or wait for their start."""
        return len(self._alive())

    def set_scene(self, scene: Mapping[str, Position] | None) -> None:
        """Declare where targets are; documents planned from now on look there."""
        self.world = replace(self.world, scene=scene)

    def set_direct(self, values: Mapping[str, float | None], now: float, character: int = 0) -> None:
        """Hold AUs (0..1) and FAPs (FAPU) by name until told otherwise; None lets go of one.

        Raises:
            KeyError: no such AU or FAP.
        """
        self._characters[character].set_direct(values, now)
        self._changed(now)

    # feedback out -------------------------------------------------------------------------------

    def due(self, now: float) -> list[Feedback]:
        """Feedback whose time has come, in the order of report, each once."""
        self._collect(now)
        self._forget(now)
        out, self._outbox = self._outbox, []
        return out

    def next_deadline(self) -> float | None:
        """When `due` will next have something; None when nothing plays or waits. In the past: at once."""
        if self._outbox:
            return float("-inf")
        return self._events[0].time if self._events else None

    # faces out ----------------------------------------------------------------------------------

    @property
    def characters(self) -> list[str | None]:
        """Ids of the characters; the first is the one that documents without characterId move."""
        return [c.id for c in self._characters]

    def character_index(self, character: str | None) -> int:
        """Where a character stands in `characters`; it is added where it is new."""
        return self._character(character)

    def frames(self, times: Float64, character: int = 0) -> AUFrames:
        """The face at any times: a pure function of what was submitted, so live and offline agree.

        Args:
            times: (n,) float64 seconds on the session clock, rising; not earlier than 1 s before the last
                `due`.
        """
        times = np.asarray(times, np.float64)
        if not len(times):
            return blend((), times)
        first, last = float(times[0]), float(times[-1])
        channels = [c for c in self._channels(character) if c.span[0] <= last and c.span[1] >= first]
        if self.idle:
            channels += idle_channels(first, last, self.world.seed + 7919 * character)
        return blend(tuple(channels), times)

    @property
    def end(self) -> float:
        """When the last block that plays or waits ends; 0 where there was none."""
        return max((p.ended for p in self._playing), default=0.0)

    def speech(self) -> tuple[Speaking, ...]:
        """What sounds or will sound, in order of its start."""
        return tuple(sorted((s for p in self._playing for s in p.speech), key=lambda s: s.start))

    def state(self, now: float) -> dict[str, Any]:
        """What is playing and which AUs are up, as plain data."""
        names = AU_NAMES()
        faces = []
        for index, character in enumerate(self._characters):
            aus = self.frames(np.array([now]), index).aus[0]
            faces.append(
                {
                    "character": character.id,
                    "aus": {n: round(float(v), 3) for n, v in zip(names, aus, strict=True) if v > 0.005},
                }
            )
        blocks = [
            {
                "id": p.block.id,
                "character": p.block.character_id,
                "status": "IN_EXEC" if p.schedule.start <= now else "LURKING",
                "start": p.schedule.start,
                "end": p.ended,
            }
            for p in self._alive()
            if p.ended > now
        ]
        return {"time": now, "blocks": blocks, "characters": faces}

    # inside -------------------------------------------------------------------------------------

    def _collect(self, now: float) -> None:
        """Move what is due to the outbox, so that nothing later can overtake it."""
        count = bisect_right(self._events, now, key=lambda event: event.time)
        self._outbox += [event.feedback for event in self._events[:count]]
        del self._events[:count]
        for playing in self._playing:
            playing.started = playing.started or playing.schedule.start <= now
            playing.done = playing.done or playing.ended <= now

    def _alive(self) -> list[Playing]:
        return [p for p in self._playing if not p.done]

    def _character(self, wanted: str | None) -> int:
        if wanted is None:
            return 0
        for index, character in enumerate(self._characters):
            if character.id == wanted:
                return index
        if self._characters[0].id is None:
            # The first name that a session hears is the name of its first face.
            self._characters[0].id = wanted
            return 0
        self._characters.append(Character(wanted))
        return len(self._characters) - 1

    def _start_of(self, block: Block, now: float) -> float:
        """BML 1.0: APPEND starts at the end of all blocks known at submission, the others at once."""
        if block.composition != "APPEND":
            return now
        character = self._character(block.character_id)
        return max([now, *(p.ended for p in self._alive() if p.character == character)])

    def _outside(self, ref: SyncRef, start: float) -> float | None:
        """Seconds from `start` of a sync point of another block; None where it is not known."""
        schedule = next((p.schedule for p in reversed(self._playing) if p.block.id == ref.block), None)
        schedule = schedule or self._past.get(ref.block or "")
        if schedule is None:
            return None
        if ref.behaviour == "bml":
            time = {"start": 0.0, "end": schedule.duration}.get(ref.sync or "")
        else:
            sync = ref.sync if ref.index is None else f"{ref.sync}:{ref.index}"
            try:
                time = schedule.at(ref.behaviour or "", sync or "")
            except KeyError:
                time = None
        return None if time is None else schedule.start + time + ref.offset - start

    def _in_use(self, block: Block) -> bool:
        """Its id belongs to a block that plays or waits, and it is not there to replace that."""
        return block.composition != "REPLACE" and any(p.block.id == block.id for p in self._alive())

    def _refused(self, block: Block, warning: Warning, now: float) -> Schedule:
        self.refuse(warning, now, block.character_id)
        return Schedule(block.id, {}, {}, start=now, warnings=(warning,), failed=True)

    def _accept(
        self,
        block: Block,
        schedule: Schedule,
        character: int,
        channels: Mapping[str, tuple[Channel, ...]],
        world: World,
        now: float,
    ) -> None:
        start, number = schedule.start, self._number
        self._number += 1
        tags = {node.id: node.tag for node in block.behaviours}
        moving: list[Channel] = []
        shifts: list[Shift] = []
        for behaviour, own in channels.items():
            own = tuple(replace(c.shifted(start), source=f"{block.id}:{behaviour}") for c in own)
            region = self.kinds[tags[behaviour]].region
            if region is None:
                moving += own
            else:
                times = schedule.times[behaviour] + start
                shifts.append(Shift.of(float(times[0]), float(times[-1]), region, own))
        speech = tuple(
            Speaking(start + float(schedule.times[b][0]), float("inf"), utterance, character)
            for b, utterance in world.utterances.items()
            if b in schedule.times
        )
        playing = Playing(
            block, schedule, character, number, tuple(moving), tuple(shifts), speech, schedule.end
        )
        self._playing.append(playing)
        self._characters[character].shift(shifts)
        self._outbox.append(prediction(block, schedule))
        for warning in schedule.warnings:
            self.refuse(warning, now, block.character_id)
        self._events = sorted([*self._events, *events(block, schedule, number)])
        self._changed(min(now, start))

    def _stop(self, playing: Playing, now: float) -> None:
        """Cut a block off at `now`: what plays fades, what waits never comes, its end is reported."""
        self._events = [e for e in self._events if e.block != playing.number]
        status = "INTERRUPTED" if playing.started else "REVOKED"
        self._outbox.append(progress(playing.block, "end", now, status))
        relax = HUSH if playing.speech else RELAX
        playing.channels = tuple(
            c.faded(now, now + (relax if c.layer is Layer.SPEECH else RELAX))
            for c in playing.channels
            if c.times[0] < now
        )
        self._characters[playing.character].cancel(playing.shifts, now)
        playing.speech = tuple(replace(s, until=min(s.until, now)) for s in playing.speech if s.start < now)
        playing.ended, playing.done = now, True
        self._changed(now)

    def _channels(self, character: int) -> list[Channel]:
        channels = [c for p in self._playing if p.character == character for c in p.channels]
        return channels + self._characters[character].channels()

    def _forget(self, now: float) -> None:
        """Drop what can no longer be seen, so that a session's cost does not grow with its past."""
        gone = [p for p in self._playing if p.done and p.ended + max(RELAX, HUSH) + KEPT < now]
        for playing in gone:
            self._past[playing.block.id] = playing.schedule
            self._playing.remove(playing)
        while len(self._past) > 100:
            del self._past[next(iter(self._past))]
        if gone:
            for character in self._characters:
                character.forget(now - KEPT)

    def _changed(self, since: float) -> None:
        self.revision += 1
        self.changed_from = since
