"""The timeline of accepted blocks: placed, moved, rescheduled, cut off and stopped."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from graphlib import TopologicalSorter

from bml_schema import Block
from realizer.behaviours.kind import Kind, World
from realizer.playback import block_links
from realizer.playback.active_block import Playing, Wait
from realizer.playback.block_planner import Plan
from realizer.playback.block_planner import plan as plan_block
from realizer.playback.block_states import BlockEvent
from realizer.playback.block_store import Cast
from realizer.playback.character import Character
from realizer.playback.event_queue import Calendar
from realizer.playback.feedback_events import Reports, prediction, progress
from realizer.playback.replanning import member, touched
from realizer.playback.resources import claims, losses
from realizer.scheduling import schedule_together
from realizer.scheduling.timing import Schedule, Warning

FOREVER = float("inf")


class Course:
    """When accepted blocks play, and what becomes of them.

    Args:
        kinds: tag -> Kind.
        characters: whose base states the blocks shift; shared with who made them.

    Attributes:
        revision: rises whenever what is shown changes.
        cast: the blocks.
        calendar: what is still to happen in them.
        reports: the feedback that is owed.
    """

    def __init__(self, kinds: Mapping[str, Kind], characters: Sequence[Character]) -> None:
        self.kinds = kinds
        self.characters = characters
        self.revision = 0
        self.cast = Cast()
        self.calendar = Calendar()
        self.reports = Reports()
        self._order = 0

    def plan(
        self,
        block: Block,
        character: int,
        world: World,
        start: float,
        now: float,
        *,
        waits: Collection[Wait] = (),
        ended: Collection[Playing] = (),
        alone: bool = False,
    ) -> tuple[Plan, list[Playing]]:
        """The plan of a block beside those that are alive, and whom it is solved with.

        While it is not known when it starts, it is planned as if that were now, and moves nobody.

        Args:
            waits: what it waits for.
            ended: whom it ends.
            alone: it takes the points of others as they are.
        """
        known = start < FOREVER
        origin = start if known else now
        alive = [p for p in self.cast.alive() if p not in ended and p.block.id != block.id]
        others = touched(block, alive, now, waits) if known and not alone else []
        schedule_of = block_links.stopped(self.cast.schedule_of, ended, now)
        planned = plan_block(
            block,
            self.kinds,
            world,
            start=origin,
            outside=block_links.instants(schedule_of, origin, self.cast.first_of),
            held=block_links.held(character, alive),
            others=[member(p, origin, now) for p in others],
        )
        if planned.moved and self._disturb(others, planned.moved):
            return self.plan(block, character, world, start, now, waits=waits, ended=ended, alone=True)
        return planned, others

    def _disturb(self, blocks: Sequence[Playing], schedules: Sequence[Schedule]) -> bool:
        """Whether blocks with other times would want what the rest holds."""
        for playing, schedule in zip(blocks, schedules, strict=True):
            at = replace(schedule, start=playing.start)
            held = block_links.held(playing.character, self.cast.alive(), blocks)
            if losses(claims(playing.block, at, self.kinds, playing.world), held):
                return True
        return False

    def set_out(self, playing: Playing) -> None:
        """A block has a new start: it shifts base states then, and its events are due."""
        self.characters[playing.character].shift(playing.shifts.values())
        playing.order = self._order
        self._order += 1
        if playing.start < FOREVER:
            self.calendar.put(playing)
            self.changed()

    def line_up(self, playing: Playing) -> None:
        """Let a waiting block, and those that follow it, report after all others at one instant.

        Raises:
            graphlib.CycleError: blocks wait for each other.
        """
        graph: TopologicalSorter[Playing] = TopologicalSorter({playing: ()})
        todo, visited = deque([playing]), {playing}  # paths to a block may be too many to follow each
        while todo:
            first = todo.popleft()
            for other in first.followers:
                if other.waiting:
                    graph.add(other, first)
                    if other not in visited:
                        visited.add(other)
                        todo.append(other)
        for first in graph.static_order():
            first.order = self._order
            self._order += 1
            if first.start < FOREVER:
                self.calendar.drop(first)
                self.calendar.put(first)

    def follow(self, playing: Playing, now: float) -> None:
        """A block's times have changed: those that wait for it, and for them, may start at another time."""
        moved = deque([playing])
        while moved:
            first = moved.popleft()
            for other in list(first.followers):
                if other.waiting and self.move(other, now, after=first.block.id):
                    moved.append(other)

    def move(self, playing: Playing, now: float, *, after: str = "") -> bool:
        """Let a waiting block start when it now may; False where nothing about it changes.

        Args:
            after: the block that it waits for and that has moved; its points are taken as they are.
        """
        start = playing.earliest
        named = {ref.block for ref in playing.abroad}
        if start == playing.start and after not in named:
            return False
        self.calendar.drop(playing)
        self._withdraw_shifts(playing, playing.shifts.keys(), now)
        planned = playing.plan
        others: list[Playing] = []
        if start < FOREVER and (playing.start == FOREVER or named or self._disturbed(playing, start)):
            planned, others = self.plan(
                playing.block,
                playing.character,
                playing.world,
                start,
                now,
                waits=playing.waits,
                alone=bool(after),
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
        self.set_out(playing)
        self.predict(playing, now)
        if others:
            self.retime(others, planned.moved, now)
        return True

    def _disturbed(self, playing: Playing, start: float) -> bool:
        """Whether others hold what a block claims when it starts at another time."""
        if not playing.plan.claims:
            return False
        late = start - playing.start
        wanted = [claim.shifted(late) for claim in playing.plan.claims]
        return bool(losses(wanted, block_links.held(playing.character, self.cast.alive(), [playing])))

    def retime(self, blocks: Sequence[Playing], schedules: Sequence[Schedule], now: float) -> None:
        """Give blocks other times, each from its own start; what follows them follows."""
        for playing, schedule in zip(blocks, schedules, strict=True):
            if playing.done:
                continue
            pending = self.calendar.pending(playing)
            before = dict(playing.shifts)
            changed = playing.retime(schedule, now)
            if not changed:
                continue
            self.characters[playing.character].exchange(before, playing.shifts)
            self.calendar.drop(playing)
            self.calendar.put(playing, None if playing.waiting else pending)
            self.changed()
            self.predict(playing, now, changed)
            self.follow(playing, now)

    def tied(self, playing: Playing, now: float) -> list[Playing]:
        """The other blocks that are solved together with one."""
        return touched(playing.block, self.cast.alive(), now, playing.waits)

    def solve_again(self, blocks: Sequence[Playing], origin: float, now: float) -> None:
        """Give blocks that play the times that now fit best; where none do, they stay as they are."""
        if not blocks:
            return
        members = [member(p, origin, now) for p in blocks]
        instants = block_links.instants(self.cast.schedule_of, origin, self.cast.first_of)
        found = schedule_together(members, outside=instants)
        if not found[0].failed and not self._disturb(blocks, found):
            self.retime(blocks, found, now)
            return
        why = found[0].warnings[0].text if found[0].failed else "it would disturb another block"
        for playing in blocks:
            told = Warning(playing.block.id, "IMPOSSIBLE_TO_SCHEDULE", f"stays as it was planned: {why}")
            self.reports.warn(told, playing.block.character_id)

    def stop(self, playing: Playing, now: float) -> None:
        """Cut a block off at `now`: what plays relaxes, what waits never comes, its end is reported."""
        tied = self.tied(playing, now) if playing.begun else []
        self.calendar.drop(playing)
        self._withdraw_shifts(playing, playing.shifts.keys(), now)
        playing.cut(list(playing.schedule.times), now, ends=True)
        playing.stopped = now
        playing.change_state(BlockEvent.STOP)
        self.cast.end(playing)
        self.reports.tell(progress(playing.block, "end", now, playing.state, playing.said(now)))
        self.changed()
        self.solve_again([p for p in tied if not p.done], playing.start, now)
        self.follow(playing, now)

    def cut(self, playing: Playing, behaviours: Collection[str], now: float) -> None:
        """End some behaviours of a block; the block ends with the last of the others."""
        tied = self.tied(playing, now)
        pending = self.calendar.pending(playing)
        self.calendar.drop(playing)
        self._withdraw_shifts(playing, [b for b in behaviours if b in playing.shifts], now)
        playing.cut(behaviours, now)
        if playing.start < FOREVER:
            self.calendar.put(playing, pending)
        self.changed()
        self.predict(playing, now, [b for b in playing.schedule.times if b in behaviours])
        self.solve_again(tied, playing.start, now)
        self.follow(playing, now)

    def predict(self, playing: Playing, now: float, behaviours: Iterable[str] | None = None) -> None:
        schedule = playing.schedule
        if schedule.start == FOREVER:
            schedule = replace(schedule, start=now)  # as if it were activated now
        syncs = schedule.behaviours
        told = syncs if behaviours is None else {b: syncs[b] for b in behaviours}
        self.reports.tell(prediction(playing.block, schedule, playing.state, told))

    def changed(self) -> None:
        """What is or will be shown is not what it was."""
        self.revision += 1

    def _withdraw_shifts(self, playing: Playing, behaviours: Iterable[str], now: float) -> None:
        gone = [playing.shifts[b] for b in behaviours]
        self.characters[playing.character].cancel(gone, now)
