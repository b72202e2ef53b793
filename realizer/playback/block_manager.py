"""The manager of a session's blocks: accepts, starts, moves and ends them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from itertools import islice

from bml_schema import Block, Feedback
from realizer.behaviours.kind import Act, Kind, World
from realizer.playback import block_links
from realizer.playback.active_block import Playing, Wait
from realizer.playback.announced_blocks import Expected, Fate
from realizer.playback.block_commands import ActFault, perform
from realizer.playback.block_states import BlockEvent, State, next_state
from realizer.playback.character import Character
from realizer.playback.feedback_events import (
    Event,
    Phase,
    acknowledgement,
    prediction,
    progress,
    sync_progress,
)
from realizer.playback.replanning import anticipated, lead
from realizer.playback.timeline import Course
from realizer.scheduling.timing import Schedule, Warning
from realizer.speech.utterance import Utterance

FOREVER = float("inf")
# More than so many anticipators are forgotten, the oldest first, where no block is tied to them.
ANTICIPATORS = 2_000


class Ensemble:
    """The blocks of one session, and the feedback they owe.

    Args:
        kinds: tag -> Kind.
        characters: whose base states the blocks shift; shared with who made them.
        refuses: (block, what was planned) -> why it is not to be played; None where it is.

    Attributes:
        course: when the accepted ones play.
        cast: the blocks.
        reports: the feedback that is owed.
    """

    def __init__(
        self,
        kinds: Mapping[str, Kind],
        characters: Sequence[Character],
        refuses: Callable[[Block, Schedule], str | None] = lambda block, schedule: None,
    ) -> None:
        self.kinds = kinds
        self._refuses = refuses
        self.course = Course(kinds, characters)
        self.cast = self.course.cast
        self.reports = self.course.reports
        self._expected = Expected()

    # blocks in ----------------------------------------------------------------------------------

    def announce(self, block: Block, character: int, now: float) -> None:
        """Acknowledge a block, once."""
        if block.id in self._expected or self._in_use(block, character):
            return
        self._expected.add(block)
        start = max([now, *(w.until for w in self._waits(block, character))])
        self.reports.tell(acknowledgement(block, now if start == FOREVER else start))

    def withdraw(self, block: Block, now: float) -> None:
        """Give up a block that was announced."""
        fate = self._expected.arrive(block)
        if not fate.revoked:
            self._revoke(fate, now)

    def submit(self, block: Block, character: int, world: World, now: float) -> Schedule:
        """Plan a block and take it in, or refuse it."""
        self.advance(now)
        self.announce(block, character, now)
        try:
            if self._in_use(block, character):
                text = f"block id {block.id!r} is still in use: wanted an id of no block that plays or waits"
                raise _Refused(Warning(block.id, "PARSING_FAILURE", text))
            waits, behind = self._links(block, character)
        except _Refused as refused:
            self._expected.arrive(block)
            return self._refuse(block, refused.warning, now)
        fate = self._expected.fate(block.id) or Fate(block)
        if fate.revoked:
            self._expected.arrive(block)
            return Schedule(block.id, {}, {}, start=now, failed=True)
        ended = block_links.ended(block, character, self.cast.alive())
        pending = block.preplan and not fate.activated
        start = FOREVER if pending else max([now, *(w.until for w in waits)])
        planned, others = self.course.plan(block, character, world, start, now, waits=waits, ended=ended)
        if planned.schedule.lengths:
            return planned.schedule
        self._expected.arrive(block)
        if planned.schedule.failed:
            return self._refuse(block, planned.schedule.warnings[0], now)
        if (words := self._refuses(block, planned.schedule)) is not None:
            return self._refuse(block, Warning(block.id, "CANNOT_CREATE_BEHAVIOR", words), now)
        for earlier in ended:
            self.course.stop(earlier, now)
        for name in block.interrupt:
            self.revoke(name, now)
        state = next_state(fate.state, BlockEvent.PREPLAN if pending else BlockEvent.PLAN)
        playing = Playing(planned, self.kinds, world, character, self.cast.next_number, now, waits, state)
        playing.lay(planned, playing.earliest)  # what it waited for may just have been ended by itself
        self.cast.add(playing)
        self.course.set_out(playing)
        for follower, subsiding in ((p, s) for p, s in behind if not p.done):
            follower.await_too(Wait(playing, subsiding))
            self.course.line_up(follower)
        for name, subsiding in block_links.followers(block):
            if (coming := self._expected.fate(name)) is not None:
                coming.waits.append(Wait(playing, subsiding))
        self.course.predict(playing, now)
        for warning in planned.schedule.warnings:
            self.reports.warn(warning, block.character_id)
        self.course.retime(others, planned.moved, now)
        self.course.follow(playing, now)
        return planned.schedule

    # time ---------------------------------------------------------------------------------------

    def advance(self, now: float) -> None:
        """Let everything happen that is due, in order, each thing at its own time."""
        for event in self.course.calendar.due(now):
            self._happens(event, self.cast[event.block])

    def due(self, now: float) -> list[Feedback]:
        self.advance(now)
        return self.reports.take()

    def next_deadline(self) -> float | None:
        return float("-inf") if self.reports else self.course.calendar.next

    def resting(self, now: float = -FOREVER) -> bool:
        """Nothing plays, waits, is expected or owed, and of what has ended nothing is to be seen.

        Args:
            now: what was gone by then counts as gone, though blinks and nods may still come of it.
        """
        seen = any(not playing.done or playing.gone > now for playing in self.cast.all())
        return not (seen or self._expected or self.reports)

    def stirs(self, now: float, before: float) -> bool:
        """Whether `due(now)` or `forget(before)` would have something."""
        due = self.course.calendar.next
        return (due is not None and due <= now) or self.cast.first_gone < before or bool(self.reports)

    def forget(self, before: float) -> bool:
        """Drop blocks of which nothing is to be seen after a time; True where there were some."""
        gone = self.cast.forget(before)
        for playing in gone:
            self.course.calendar.drop(playing)
        return bool(gone)

    def _happens(self, event: Event, playing: Playing) -> None:
        block, time = playing.block, event.time
        match event.phase:
            case Phase.SYNC:
                self.reports.tell(sync_progress(block, event.name, event.sync, time, playing.start))
                if event.point == 0:
                    node = block[event.name]
                    if (act := self.kinds[node.tag].act) is not None:
                        self._act(playing, event.name, act(node), time)
            case Phase.START:
                playing.change_state(BlockEvent.START)
                playing.waits.clear()
                self.reports.tell(progress(block, "start", time, playing.state))
                self.reports.tell(prediction(block, playing.schedule, playing.state))
                for id in block.on_start:
                    if not self.activate(id, time):
                        text = f"onStart: wanted a block that was preplanned and waits, got {id!r}"
                        self.reports.warn(Warning(block.id, "EXECUTION_FAILURE", text), block.character_id)
            case Phase.SUBSIDES:
                playing.change_state(BlockEvent.SUBSIDE)
                self.reports.tell(prediction(block, playing.schedule, playing.state))
            case Phase.END:
                playing.change_state(BlockEvent.END)
                self.cast.end(playing)
                self.reports.tell(progress(block, "end", time, playing.state, playing.said(time)))

    def _act(self, playing: Playing, behaviour: str, act: Act, now: float) -> None:
        try:
            perform(self, playing, behaviour, act, now)
        except ActFault as fault:
            required = behaviour in playing.block.required
            name = playing.block.id if required else f"{playing.block.id}:{behaviour}"
            text = f"{behaviour}, which is required: {fault}" if required else str(fault)
            place = playing.block.places.get(behaviour)
            text = text if place is None else place.with_place(text)
            self.reports.warn(Warning(name, "EXECUTION_FAILURE", text), playing.block.character_id)
            if required and not playing.done:
                self.course.stop(playing, now)

    # what is done to blocks ---------------------------------------------------------------------

    def knew(self, id: str) -> bool:
        """Whether there is or was such a block, or will be."""
        return id in self._expected or self.cast.knew(id)

    def revoke(self, id: str, now: float) -> bool:
        """End a block that was announced and is not here yet; False where there is none."""
        fate = self._expected.fate(id)
        if fate is None or fate.revoked:
            return False
        self._revoke(fate, now)
        return True

    def _revoke(self, fate: Fate, now: float) -> None:
        fate.change_state(BlockEvent.STOP)
        self.reports.tell(progress(fate.block, "end", now, fate.state))

    def stop_all(self, now: float, ids: Collection[str] | None) -> list[str]:
        """Stop these blocks, or all; returns the ids of those that played or waited."""
        self.advance(now)
        stopped = [p for p in self.cast.alive() if ids is None or p.block.id in ids]
        # The last first: a block that waits for another need not be planned anew before it is stopped too.
        for playing in reversed(stopped):
            if not playing.done:
                self.course.stop(playing, now)
        return [p.block.id for p in stopped]

    def activate(self, id: str, now: float) -> bool:
        """Let a preplanned block start, when what it waits for is over; False where it is none."""
        playing = self.cast.find(id)
        if playing is None:
            fate = self._expected.fate(id)
            if fate is None or not fate.block.preplan:
                return False
            fate.activated = True
            return True
        if playing.state is not State.PENDING:
            return False
        playing.change_state(BlockEvent.ACTIVATE)
        playing.floor = now
        if self.course.move(playing, now):
            self.course.follow(playing, now)
        return True

    def anticipate(self, id: str, syncs: Mapping[str, float], now: float) -> None:
        """Points in time are expected at other times than before: what is tied to them follows.

        Args:
            id: of an anticipator; its points are `anticipators:id:sync` in references.
            syncs: sync -> seconds on the session clock; as soon as can be, where that is too soon.
        """
        self.advance(now)
        tied = [p for p in self.cast.alive() if p.start < FOREVER and id in anticipated(p.block)]
        soonest = {sync: max([now, *(lead(p, id, sync, now) for p in tied)]) for sync in syncs}
        self.cast.anticipate(id, {sync: max(time, soonest[sync]) for sync, time in syncs.items()})
        if (beyond := len(self.cast.anticipators) - ANTICIPATORS) > 0:
            wanted = {id}.union(*(anticipated(p.block) for p in self.cast.alive()))
            old = (name for name in self.cast.anticipators if name not in wanted)
            self.cast.lapse(set(islice(old, beyond)))
        for playing in tied:
            self.course.solve_again([playing, *self.course.tied(playing, now)], playing.start, now)

    def respeak(self, id: str, behaviour: str, utterance: Utterance, now: float) -> bool:
        """A voice says how it really speaks: what has not passed follows; False where it is not (still) said.

        Args:
            id: of a block that plays or waits.
        """
        self.advance(now)
        playing = self.cast.find(id)
        if playing is None or behaviour not in playing.plan.timings:
            return False
        if playing.start == FOREVER:  # it is planned when that is known
            utterances = {**playing.world.utterances, behaviour: utterance}
            playing.world = replace(playing.world, utterances=utterances)
            return True
        playing.respeak(behaviour, utterance, now)
        self.course.changed()
        self.course.solve_again([playing, *self.course.tied(playing, now)], playing.start, now)
        return True

    # starts -------------------------------------------------------------------------------------

    def _links(self, block: Block, character: int) -> tuple[list[Wait], list[tuple[Playing, bool]]]:
        """What a block waits for, and the blocks that are to wait for it.

        Raises:
            _Refused: one of those has started, or is waited for itself.
        """
        waits = self._waits(block, character)
        behind: list[tuple[Playing, bool]] = []
        for name, subsiding in block_links.followers(block):
            playing = self.cast.find(name)
            if playing is not None and playing.waiting:
                behind.append((playing, subsiding))
            elif playing is not None or name not in self._expected:
                text = f"prependBefore, chunkBefore: wanted blocks that have not started, got {name!r}"
                raise _Refused(Warning(block.id, "TargetBlockAlreadyStartedException", text))
        if behind and any(id(playing) in block_links.before(waits) for playing, _ in behind):
            text = "prependBefore, chunkBefore: wanted blocks that this one does not wait for itself"
            raise _Refused(Warning(block.id, "IMPOSSIBLE_TO_SCHEDULE", text))
        return waits, behind

    def _waits(self, block: Block, character: int) -> list[Wait]:
        fate = self._expected.fate(block.id)
        ahead = [w for w in fate.waits if not w.block.done] if fate is not None else []
        return block_links.awaited(block, character, self.cast.alive()) + ahead

    def _in_use(self, block: Block, character: int) -> bool:
        """Its id belongs to a block that plays or waits, and that it does not end."""
        other = self.cast.find(block.id)
        return other is not None and other not in block_links.ended(block, character, [other])

    def _refuse(self, block: Block, warning: Warning, now: float) -> Schedule:
        self.reports.warn(warning, block.character_id)
        return Schedule(block.id, {}, {}, start=now, warnings=(warning,), failed=True)


class _Refused(Exception):
    """A block cannot be taken in, and why."""

    def __init__(self, warning: Warning) -> None:
        super().__init__(warning.text)
        self.warning = warning
