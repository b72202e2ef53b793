"""All blocks of a session: accepted in turn, started, moved and ended as they depend on each other."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

from bml_schema import Block, Feedback
from realizer.behaviours.kind import Act, Kind, World
from realizer.composition import relations
from realizer.composition.acts import ActFault, perform
from realizer.composition.calendar import Calendar
from realizer.composition.cast import Cast
from realizer.composition.character import Character
from realizer.composition.expected import Expected, Fate
from realizer.composition.playing import Playing, Wait
from realizer.composition.references import references
from realizer.composition.reporting import (
    Event,
    Phase,
    Reports,
    State,
    acknowledgement,
    prediction,
    progress,
    sync_progress,
)
from realizer.composition.retiming import anticipated, lead, member, touched
from realizer.planning import Plan, plan
from realizer.scheduling import schedule_together
from realizer.scheduling.timing import Schedule, Warning
from realizer.speech.utterance import Utterance

__all__ = ["Ensemble"]

FOREVER = float("inf")


class Ensemble:
    """The blocks of one session, and the feedback they owe.

    Args:
        kinds: tag -> Kind.
        characters: whose base states the blocks shift; shared with who made them.

    Attributes:
        revision: rises whenever what is shown changes.
        cast: the blocks.
        reports: the feedback that is owed.
    """

    def __init__(self, kinds: Mapping[str, Kind], characters: Sequence[Character]) -> None:
        self.kinds = kinds
        self.characters = characters
        self.revision = 0
        self.cast = Cast()
        self.reports = Reports()
        self._expected = Expected()
        self._calendar = Calendar()
        self._order = 0

    # blocks in ----------------------------------------------------------------------------------

    def announce(self, block: Block, character: int, now: float) -> None:
        """Acknowledge a block, once."""
        if block.id in self._expected or self._in_use(block):
            return
        self._expected.add(block)
        start = max([now, *(w.until for w in self._waits(block, character))])
        self.reports.tell(acknowledgement(block, now if start == FOREVER else start))

    def withdraw(self, block: Block, now: float) -> None:
        """Give up a block that was announced."""
        if not self._expected.arrive(block).revoked:
            self.reports.tell(progress(block, "end", now, State.REVOKED))

    def submit(self, block: Block, character: int, world: World, now: float) -> Schedule:
        """Plan a block and take it in, or refuse it."""
        self.advance(now)
        self.announce(block, character, now)
        try:
            if self._in_use(block):
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
        ended = relations.ended(block, character, self.cast.alive())
        state = State.PENDING if block.preplan and not fate.activated else State.LURKING
        start = FOREVER if state is State.PENDING else max([now, *(w.until for w in waits)])
        planned, others = self._plan(block, character, world, start, now, ended)
        if planned.schedule.lengths:
            return planned.schedule
        self._expected.arrive(block)
        if planned.schedule.failed:
            return self._refuse(block, planned.schedule.warnings[0], now)
        for earlier in ended:
            self.stop(earlier, now)
        for name in block.interrupt:
            self.revoke(name, now)
        playing = Playing(planned, self.kinds, world, character, self.cast.next_number, now, waits, state)
        playing.lay(planned, playing.earliest)  # what it waited for may just have been ended by itself
        self.cast.add(playing)
        self._set_out(playing)
        for follower, subsiding in behind:
            follower.await_too(Wait(playing, subsiding))
            self._line_up(follower)
        for name, subsiding in relations.followers(block):
            if (coming := self._expected.fate(name)) is not None:
                coming.waits.append(Wait(playing, subsiding))
        self._predict(playing, now)
        for warning in planned.schedule.warnings:
            self.reports.warn(warning, block.character_id)
        self._retime(others, planned.moved, now)
        self._moved(playing, now)
        return planned.schedule

    # time ---------------------------------------------------------------------------------------

    def advance(self, now: float) -> None:
        """Let everything happen that is due, in order, each thing at its own time."""
        for event in self._calendar.due(now):
            self._happens(event, self.cast[event.block])

    def due(self, now: float) -> list[Feedback]:
        self.advance(now)
        return self.reports.take()

    def next_deadline(self) -> float | None:
        return float("-inf") if self.reports else self._calendar.next

    def forget(self, before: float) -> bool:
        """Drop blocks of which nothing is to be seen after a time; True where there were some."""
        gone = self.cast.forget(before)
        for playing in gone:
            self._calendar.forget(playing)
        return bool(gone)

    def _happens(self, event: Event, playing: Playing) -> None:
        block, time = playing.block, event.time
        match event.phase:
            case Phase.START:
                playing.state = State.IN_EXEC
                playing.waits.clear()
                self.reports.tell(progress(block, "start", time, playing.state))
                self.reports.tell(prediction(block, playing.schedule, playing.state))
                for id in block.on_start:
                    if not self.activate(id, time):
                        text = f"onStart: wanted a block that was preplanned and waits, got {id!r}"
                        self.reports.warn(Warning(block.id, "EXECUTION_FAILURE", text), block.character_id)
            case Phase.SYNC:
                self.reports.tell(sync_progress(block, event.name, event.sync, time, playing.start))
                if event.point == 0:
                    node = block[event.name]
                    if (act := self.kinds[node.tag].act) is not None:
                        self._act(playing, event.name, act(node), time)
            case Phase.SUBSIDES:
                playing.state = State.SUBSIDING
                self.reports.tell(prediction(block, playing.schedule, playing.state))
            case Phase.END:
                playing.state = State.DONE
                self.cast.end(playing)
                self.reports.tell(progress(block, "end", time, playing.state))

    def _act(self, playing: Playing, behaviour: str, act: Act, now: float) -> None:
        try:
            perform(self, playing, behaviour, act, now)
        except ActFault as fault:
            required = behaviour in playing.block.required
            name = playing.block.id if required else f"{playing.block.id}:{behaviour}"
            text = f"{behaviour}, which is required: {fault}" if required else str(fault)
            place = playing.block.places.get(behaviour)
            text = text if place is None else f"line {place.line}, {place.path}: {text}"
            self.reports.warn(Warning(name, "EXECUTION_FAILURE", text), playing.block.character_id)
            if required and not playing.done:
                self.stop(playing, now)

    # what is done to blocks ---------------------------------------------------------------------

    def knew(self, id: str) -> bool:
        """Whether there is or was such a block, or will be."""
        return id in self._expected or self.cast.knew(id)

    def revoke(self, id: str, now: float) -> bool:
        """End a block that was announced and is not here yet; False where there is none."""
        fate = self._expected.fate(id)
        if fate is None or fate.revoked:
            return False
        fate.revoked = True
        self.reports.tell(progress(fate.block, "end", now, State.REVOKED))
        return True

    def stop_all(self, now: float, ids: Collection[str] | None) -> list[str]:
        """Stop these blocks, or all; returns the ids of those that played or waited."""
        self.advance(now)
        stopped = [p for p in self.cast.alive() if ids is None or p.block.id in ids]
        for playing in stopped:
            if not playing.done:
                self.stop(playing, now)
        return [p.block.id for p in stopped]

    def stop(self, playing: Playing, now: float) -> None:
        """Cut a block off at `now`: what plays relaxes, what waits never comes, its end is reported."""
        self._calendar.drop(playing)
        state = State.INTERRUPTED if playing.begun else State.REVOKED
        self._withdraw_shifts(playing, playing.shifts.keys(), now)
        playing.cut(list(playing.schedule.times), now, ends=True)
        playing.stopped, playing.state = now, state
        self.cast.end(playing)
        self.reports.tell(progress(playing.block, "end", now, state))
        self.changed()
        self._moved(playing, now)

    def cut(self, playing: Playing, behaviours: Collection[str], now: float) -> None:
        """End some behaviours of a block; the block ends with the last of the others."""
        pending = self._calendar.pending(playing)
        self._calendar.drop(playing)
        self._withdraw_shifts(playing, [b for b in behaviours if b in playing.shifts], now)
        playing.cut(behaviours, now)
        self._calendar.put(playing, pending)
        self.changed()
        self._predict(playing, now, [b for b in behaviours if b in playing.schedule.times])
        if others := self._tied(playing, now):
            self._solve_again([*others], playing.start, now)
        self._moved(playing, now)

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
        playing.state, playing.floor = State.LURKING, now
        if self._move(playing, now):
            self._moved(playing, now)
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
        for playing in tied:
            self._solve_again([playing, *self._tied(playing, now)], playing.start, now)

    def respeak(self, id: str, behaviour: str, utterance: Utterance, now: float) -> bool:
        """A voice says how it really speaks: what has not passed follows; False where it is not (still) said.

        Args:
            id: of a block that plays or waits.
        """
        self.advance(now)
        playing = self.cast.find(id)
        if playing is None or behaviour not in playing.plan.timings or playing.start == FOREVER:
            return False
        playing.respeak(behaviour, utterance, now)
        self.changed()
        self._solve_again([playing, *self._tied(playing, now)], playing.start, now)
        return True

    # starts -------------------------------------------------------------------------------------

    def _links(self, block: Block, character: int) -> tuple[list[Wait], list[tuple[Playing, bool]]]:
        """What a block waits for, and the blocks that are to wait for it.

        Raises:
            _Refused: one of those has started, or is waited for itself.
        """
        waits = self._waits(block, character)
        behind: list[tuple[Playing, bool]] = []
        for name, subsiding in relations.followers(block):
            playing = self.cast.find(name)
            if playing is not None and playing.waiting:
                behind.append((playing, subsiding))
            elif playing is not None or name not in self._expected:
                text = f"prependBefore, chunkBefore: wanted blocks that have not started, got {name!r}"
                raise _Refused(Warning(block.id, "TargetBlockAlreadyStartedException", text))
        if behind and any(id(playing) in relations.before(waits) for playing, _ in behind):
            text = "prependBefore, chunkBefore: wanted blocks that this one does not wait for itself"
            raise _Refused(Warning(block.id, "IMPOSSIBLE_TO_SCHEDULE", text))
        return waits, behind

    def _waits(self, block: Block, character: int) -> list[Wait]:
        fate = self._expected.fate(block.id)
        ahead = [w for w in fate.waits if not w.block.done] if fate is not None else []
        return relations.awaited(block, character, self.cast.alive()) + ahead

    def _moved(self, playing: Playing, now: float) -> None:
        """A block's times have changed: those that wait for it, and for them, may start at another time."""
        moved = deque([playing])
        while moved:
            for other in list(moved.popleft().followers):
                if other.waiting and self._move(other, now):
                    moved.append(other)

    def _line_up(self, playing: Playing) -> None:
        """Let a waiting block, and those that follow it, report after all others at one instant."""
        line = deque([playing])
        while line:
            first = line.popleft()
            line += [other for other in first.followers if other.waiting]
            first.order = self._order
            self._order += 1
            if first.start < FOREVER:
                self._calendar.drop(first)
                self._calendar.put(first)

    def _move(self, playing: Playing, now: float) -> bool:
        """Let a waiting block start when it now may; False where that is when it was to."""
        start = playing.earliest
        if start == playing.start:
            return False
        self._calendar.drop(playing)
        self._withdraw_shifts(playing, playing.shifts.keys(), now)
        planned = playing.plan
        others: list[Playing] = []
        refers = any(ref.block is not None for ref in references(playing.block))
        if start < FOREVER and (playing.start == FOREVER or refers):
            # Its claims were never compared, or its references have other times from the new start.
            planned, others = self._plan(
                playing.block, playing.character, playing.world, start, now, [playing]
            )
            if planned.schedule.failed:
                self.reports.warn(planned.schedule.warnings[0], playing.block.character_id)
                self.stop(playing, now)
                return False
            told = {w.id for w in playing.schedule.warnings}
            for warning in planned.schedule.warnings:
                if warning.id not in told:
                    self.reports.warn(warning, playing.block.character_id)
        playing.lay(planned, start)
        self._set_out(playing)
        self._predict(playing, now)
        if others:
            self._retime(others, planned.moved, now)
        return True

    def _plan(
        self,
        block: Block,
        character: int,
        world: World,
        start: float,
        now: float,
        without: Collection[Playing],
    ) -> tuple[Plan, list[Playing]]:
        """The plan of a block beside those that are alive, `without` some, and whom it is solved with.

        While it is not known when it starts, it is planned as if that were now, and moves nobody.
        """
        known = start < FOREVER
        origin = start if known else now
        alive = [p for p in self.cast.alive() if p not in without]
        others = touched([block], alive, now) if known else []
        planned = plan(
            block,
            self.kinds,
            world,
            start=origin,
            outside=relations.instants(self.cast.schedule_of, origin),
            held=relations.held(character, alive),
            others=[member(p, origin, now) for p in others],
        )
        return planned, others

    def _retime(self, blocks: Sequence[Playing], schedules: Sequence[Schedule], now: float) -> None:
        """Give blocks other times, each from its own start; what follows them follows."""
        for playing, schedule in zip(blocks, schedules, strict=True):
            if playing.done:
                continue
            pending = self._calendar.pending(playing)
            before = dict(playing.shifts)
            changed = playing.retime(schedule, now)
            if not changed:
                continue
            self.characters[playing.character].exchange(before, playing.shifts)
            self._calendar.drop(playing)
            self._calendar.put(playing, None if playing.waiting else pending)
            self.changed()
            self._predict(playing, now, changed)
            self._moved(playing, now)

    def _tied(self, playing: Playing, now: float) -> list[Playing]:
        """The other blocks that are solved together with one."""
        return [p for p in touched([playing.block], self.cast.alive(), now) if p is not playing]

    def _solve_again(self, blocks: Sequence[Playing], origin: float, now: float) -> None:
        """Give blocks that play the times that now fit best."""
        members = [member(p, origin, now) for p in blocks]
        instants = relations.instants(self.cast.schedule_of, origin)
        found = schedule_together(members, outside=instants)
        if not found[0].failed:
            self._retime(blocks, found, now)
            return
        why = found[0].warnings[0].text
        for playing in blocks:
            told = Warning(playing.block.id, "IMPOSSIBLE_TO_SCHEDULE", f"stays as it was planned: {why}")
            self.reports.warn(told, playing.block.character_id)

    # events and feedback ------------------------------------------------------------------------

    def changed(self) -> None:
        """What is or will be shown is not what it was."""
        self.revision += 1

    def _set_out(self, playing: Playing) -> None:
        """A block has a new start: it shifts base states then, and its events are due."""
        self.characters[playing.character].shift(playing.shifts.values())
        playing.order = self._order
        self._order += 1
        if playing.start < FOREVER:
            self._calendar.put(playing)
            self.changed()

    def _withdraw_shifts(self, playing: Playing, behaviours: Iterable[str], now: float) -> None:
        gone = [playing.shifts[b] for b in behaviours]
        self.characters[playing.character].cancel(gone, now)

    def _predict(self, playing: Playing, now: float, behaviours: Iterable[str] | None = None) -> None:
        schedule = playing.schedule
        if schedule.start == FOREVER:
            schedule = replace(schedule, start=now)  # as if it were activated now
        syncs = schedule.behaviours
        told = syncs if behaviours is None else {b: syncs[b] for b in behaviours}
        self.reports.tell(prediction(playing.block, schedule, playing.state, told))

    def _in_use(self, block: Block) -> bool:
        """Its id belongs to a block that plays or waits, and it is not there to replace that."""
        return block.composition != "REPLACE" and self.cast.find(block.id) is not None

    def _refuse(self, block: Block, warning: Warning, now: float) -> Schedule:
        self.reports.warn(warning, block.character_id)
        return Schedule(block.id, {}, {}, start=now, warnings=(warning,), failed=True)


class _Refused(Exception):
    """A block cannot be taken in, and why."""

    def __init__(self, warning: Warning) -> None:
        super().__init__(warning.text)
        self.warning = warning
