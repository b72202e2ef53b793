"""The timeline of accepted blocks: placed, moved, rescheduled, cut off and stopped."""

from collections import deque
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from graphlib import TopologicalSorter
from math import inf

from realizer.behaviours.kind import BehaviourKind
from realizer.playback import block_links
from realizer.playback.active_block import ActiveBlock
from realizer.playback.block_links import affected_blocks
from realizer.playback.block_planner import Plan
from realizer.playback.block_states import BlockEvent
from realizer.playback.block_store import BlockStore
from realizer.playback.character import Character
from realizer.playback.feedback_events import EventQueue, Reports, prediction, progress, sync_progress
from realizer.playback.joint_planner import Arrival, JointPlanner
from realizer.playback.resources import conflicts
from realizer.scheduling.timing import UNKNOWN, Schedule, Warning
from realizer.speech.duration_fit import shortened
from realizer.speech.utterance import Utterance


class BlockTimeline:
    """When accepted blocks play; it changes the base states of the characters."""

    def __init__(self, kinds: Mapping[str, BehaviourKind], characters: Sequence[Character]) -> None:
        self.kinds = kinds
        self.characters = characters
        self.version = 0
        self.blocks = BlockStore()
        self.planner = JointPlanner(kinds, self.blocks)
        self.events = EventQueue()
        self.reports = Reports()
        self._moving: set[ActiveBlock] = set()

    def place(self, playing: ActiveBlock) -> None:
        self.characters[playing.character].add_shifts(playing.shifts.values())
        if playing.start < inf:
            self.events.add(playing)
            self.mark_changed()

    def reorder(self, playing: ActiveBlock) -> None:
        """Order a waiting block and its followers after the blocks that they wait for; or CycleError."""
        graph: TopologicalSorter[ActiveBlock] = TopologicalSorter({playing: ()})
        todo, visited = deque([playing]), {playing}  # there may be many paths to a block
        while todo:
            first = todo.popleft()
            for other in first.followers:
                if other.is_waiting:
                    graph.add(other, first)
                    if other not in visited:
                        visited.add(other)
                        todo.append(other)
        for first in graph.static_order():
            first.set_order()
            if first.start < inf:
                self.events.add(first)

    def update_followers(
        self, playing: ActiveBlock, now: float, without: Collection[ActiveBlock] = ()
    ) -> None:
        """Move the direct and indirect followers of a block whose times have changed, except some."""
        moved = deque([playing])
        while moved:
            first = moved.popleft()
            for other in list(first.followers):
                if other.is_waiting and other not in without and self.move(other, now, after=first.block.id):
                    moved.append(other)

    def move(self, playing: ActiveBlock, now: float, *, after: str = "") -> bool:
        """Move a waiting block to its earliest start; return False if nothing changes.

        `after` is the id of the dependency that has moved; its points are fixed.
        """
        start = playing.earliest
        named = {ref.block for ref in playing.external_refs}
        if start == playing.start and after not in named:
            return False
        is_replanned = start < inf and (playing.start == inf or bool(named))
        return self._place_again(playing, start, now, is_replanned=is_replanned, alone=bool(after))

    def resolve_conflicts(self, playing: ActiveBlock, now: float) -> bool:
        """Drop what a block that starts now needs and playing blocks have; return whether there was anything.

        Its start event is due again then, or the block was stopped. The blocks whose speech it continues give
        way to it.
        """
        active = self.blocks.active()
        earlier = block_links.spoken_before(playing.block, active)
        lost = {p: conflicts(p.plan.claims, playing.plan.claims) for p in earlier}
        if any(lost.values()):
            for other in filter(lost.get, earlier):
                self.cut(other, {conflict.claim.behaviour for conflict in lost[other]}, now)
            self.events.add(playing)
            return True
        existing = self.planner.existing_claims(
            playing.character, playing.number, active, now, without=[playing, *earlier]
        )
        if not conflicts(playing.plan.claims, existing):
            return False
        self._place_again(playing, playing.start, now, is_replanned=True, alone=True, starts=True)
        return True

    def _place_again(
        self,
        playing: ActiveBlock,
        start: float,
        now: float,
        *,
        is_replanned: bool,
        alone: bool,
        starts: bool = False,
    ) -> bool:
        """Place a waiting block at a start, planned again or as it is; return False if it is refused."""
        self.events.drop(playing)
        self._withdraw_shifts(playing, playing.shifts.keys(), now)
        planned: Plan | None = playing.plan
        others: list[ActiveBlock] = []
        if is_replanned:
            planned, others = self._replan(playing, start, now, alone=alone, starts=starts)
        if planned is None:
            return False
        playing.apply_plan(planned, start, now)
        self.place(playing)
        self.predict(playing, now)
        if others:
            self.retime(others, planned.other_schedules, now)
        self.trim(planned.trims, now)
        self._update_referring(playing, now)
        return True

    def _update_referring(self, playing: ActiveBlock, now: float) -> None:
        """Move the sync points of other blocks that refer to points of a waiting block that has moved.

        Blocks that it waits for stay as they are, because both would move later for ever. Its followers move
        with it.
        """
        followers = set(playing.followers)
        tied = [p for p in self.blocks.active() if p.refers_to(playing) and p not in followers]
        if not tied or playing.start == inf or playing in self._moving:
            return
        dependencies = block_links.all_dependencies(playing.dependencies)
        self._moving.add(playing)
        for other in tied:
            if other.start < inf and not other.is_done and id(other) not in dependencies:
                linked = [p for p in self.linked_blocks(other, now) if p is not playing]
                self.reschedule([other, *linked], other.start, now)
        self._moving.remove(playing)

    def _replan(
        self, playing: ActiveBlock, start: float, now: float, *, alone: bool, starts: bool
    ) -> tuple[Plan | None, list[ActiveBlock]]:
        """Plan a waiting block again, and report new warnings; stop it and return None if it is refused."""
        arrival = Arrival(playing.block, playing.character, playing.number, playing.context)
        planned, others = self.planner.plan(
            arrival, start, now, waits=playing.dependencies, alone=alone, starts=starts, may_stretch=False
        )
        if planned.schedule.failed:
            self.reports.warn(planned.schedule.warnings[0], playing.block.character_id)
            self.stop(playing, now)
            return None, []
        known = {(w.id, w.text) for w in playing.schedule.warnings}
        for warning in planned.schedule.warnings:
            if (warning.id, warning.text) not in known:
                self.reports.warn(warning, playing.block.character_id)
        return planned, others

    def retime(self, blocks: Sequence[ActiveBlock], schedules: Sequence[Schedule], now: float) -> None:
        """Change the times of blocks, each from its own start, and move their followers."""
        for playing, schedule in zip(blocks, schedules, strict=True):
            if playing.is_done:
                continue
            pending = self.events.pending(playing)
            before = dict(playing.shifts)
            changed = playing.retime(schedule, now)
            if not changed:
                continue
            self.characters[playing.character].replace_shifts(before, playing.shifts)
            self.events.add(playing, None if playing.is_waiting else pending)
            self.mark_changed()
            self.predict(playing, now, changed)
            self.update_followers(playing, now)

    def trim(self, ends: Mapping[tuple[str, str], float], now: float) -> None:
        """Cut the closing silence of speeches that play; `ends` are seconds on the session clock.

        A speech stays as it is if its end has a stated time, or if other blocks refer to its end: what speaks
        in its silence must not move with it.
        """
        for (block, behaviour), end in ends.items():
            playing = self.blocks.find(block)
            if playing is None or behaviour not in playing.plan.timings:
                continue
            refs = (ref for other in self.blocks.active() for ref in other.external_refs)
            if any((ref.block, ref.behaviour, ref.sync) == (block, behaviour, "end") for ref in refs):
                continue
            speech, before = playing.speech[behaviour], playing.saved()
            playing.update_speech(behaviour, shortened(speech.utterance, end - speech.start), now)
            blocks = [playing, *self.linked_blocks(playing, now)]
            if self._retime_together(blocks, playing.start, now) is None:
                self.mark_changed()
            else:
                playing.restore(before)

    def update_speech(self, playing: ActiveBlock, behaviour: str, utterance: Utterance, now: float) -> None:
        """Replace the utterance of a speech; its points that have passed stay, and the rest follows."""
        playing.update_speech(behaviour, utterance, now)
        self.mark_changed()
        self.reschedule([playing, *self.linked_blocks(playing, now)], playing.start, now)

    def linked_blocks(self, playing: ActiveBlock, now: float) -> list[ActiveBlock]:
        """Return the other blocks that are solved together with one."""
        return affected_blocks(playing.block, self.blocks.active(), now, playing.dependencies)

    def reschedule(self, blocks: Sequence[ActiveBlock], origin: float, now: float) -> bool:
        """Change the times of playing blocks to the best fit.

        If there is none, keep them, warn of each, and return False.
        """
        why = self._retime_together(blocks, origin, now) if blocks else None
        for playing in blocks if why is not None else ():
            warning = Warning(playing.block.id, "IMPOSSIBLE_TO_SCHEDULE", f"stays as it was planned: {why}")
            self.reports.warn(warning, playing.block.character_id)
        return why is None

    def end_open(self, playing: ActiveBlock, now: float) -> None:
        """End the behaviours of a block whose ends are not known."""
        times = playing.schedule.times.items()
        if ends := [b for b, t in times if playing.start + float(t[-1]) >= now + UNKNOWN]:
            self.cut(playing, ends, now)

    def _retime_together(self, blocks: Sequence[ActiveBlock], origin: float, now: float) -> str | None:
        """Change the times of playing blocks to the best fit; if there is none, return why."""
        fitted = self.planner.fit(blocks, origin, now)
        if isinstance(fitted, str):
            return fitted
        self.retime(blocks, fitted, now)
        return None

    def stop(self, playing: ActiveBlock, now: float, others: Collection[ActiveBlock] = ()) -> None:
        """Cut a block off at `now`: what plays relaxes, what waits is cancelled, and its end is reported.

        The sync points that the cut makes true are reported before it: the end of each behaviour that has
        begun, and its relax, if that has not passed.

        Blocks that wait and refer to one that has not started are planned again, without these references;
        not `others`, which are stopped with it.
        """
        bereft = [] if playing.has_begun else self._waiting_for_points_of(playing, others)
        tied = self.linked_blocks(playing, now) if playing.start < inf else []
        if not playing.has_begun:  # blocks that refer to it stay, or are planned again
            tied = [p for p in tied if not p.refers_to(playing)]
        if playing.is_waiting:
            playing.pass_on_dependencies()
        pending = self.events.pending(playing)
        begun = (
            [] if playing.is_waiting else [b for b in playing.schedule.times if (b, "start") not in pending]
        )
        self.events.drop(playing)
        self._withdraw_shifts(playing, playing.shifts.keys(), now)
        playing.cut(list(playing.schedule.times), now, ends=True)
        points = playing.schedule.points
        true_now = [(b, s) for b in begun for s in points.get(b, ("end",)) if (b, s) in pending]
        if changed := dict.fromkeys(b for b, _ in true_now if b in points):
            self.predict(playing, now, changed)
        for behaviour, sync in true_now:
            self.reports.add(sync_progress(playing.block, behaviour, sync, now, playing.start))
        playing.stopped_at = now
        playing.change_state(BlockEvent.STOP)
        self.blocks.end(playing)
        self.reports.add(progress(playing.block, "end", now, playing.state, playing.words_spoken(now)))
        self.mark_changed()
        self.reschedule([p for p in tied if not p.is_done], playing.start, now)
        for other in bereft:
            if other.is_waiting:
                self._place_again(other, other.start, now, is_replanned=True, alone=True)
        self.update_followers(playing, now, others)

    def _waiting_for_points_of(
        self, playing: ActiveBlock, without: Collection[ActiveBlock]
    ) -> list[ActiveBlock]:
        """Return the planned blocks that wait and refer to one, except its followers, which move with it."""
        tied = [p for p in self.blocks.active() if p.refers_to(playing)]
        moved = [p for p in playing.followers if p.start < inf]
        gone = {*without, *moved} if tied else set()
        return [p for p in tied if p.is_waiting and p not in gone]

    def cut(self, playing: ActiveBlock, behaviours: Collection[str], now: float) -> None:
        """End some behaviours of a block; the block ends with the last of the others."""
        tied = self.linked_blocks(playing, now)
        pending = self.events.pending(playing)
        self.events.drop(playing)
        self._withdraw_shifts(playing, [b for b in behaviours if b in playing.shifts], now)
        removed = playing.cut(behaviours, now)
        for behaviour in removed if playing.has_begun else ():
            if (behaviour, "start") not in pending:  # it has just been reported
                self.reports.add(sync_progress(playing.block, behaviour, "end", now, playing.start))
        if playing.start < inf:
            self.events.add(playing, pending)
        self.mark_changed()
        self.predict(playing, now, [b for b in playing.schedule.times if b in behaviours])
        self.reschedule(tied, playing.start, now)
        self.update_followers(playing, now)

    def predict(self, playing: ActiveBlock, now: float, behaviours: Iterable[str] | None = None) -> None:
        schedule = playing.schedule
        if not playing.has_known_start:
            schedule = replace(schedule, start=now)  # as if it started now
        syncs = schedule.behaviours
        predicted = syncs if behaviours is None else {b: syncs[b] for b in behaviours}
        self.reports.add(prediction(playing.block, schedule, playing.state, predicted))

    def mark_changed(self) -> None:
        self.version += 1

    def _withdraw_shifts(self, playing: ActiveBlock, behaviours: Iterable[str], now: float) -> None:
        gone = [playing.shifts[b] for b in behaviours]
        self.characters[playing.character].cancel(gone, now)
