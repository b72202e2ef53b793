"""The manager of a session's blocks: it accepts, starts, moves and ends them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import islice
from math import inf

from bml_schema import Block
from realizer.behaviours.kind import BehaviourKind, BlockCommand, PlanningContext
from realizer.core import work
from realizer.playback.active_block import ActiveBlock, Dependency
from realizer.playback.announced_blocks import (
    AnnouncedBlock,
    AnnouncedBlocks,
    BlockLinks,
    BlockRejectedError,
)
from realizer.playback.block_commands import CommandError, execute
from realizer.playback.block_links import lead_times
from realizer.playback.block_planner import Plan
from realizer.playback.block_states import BlockEvent, State, next_state
from realizer.playback.block_timeline import BlockTimeline
from realizer.playback.character import Cast
from realizer.playback.feedback_events import (
    Event,
    Phase,
    acknowledgement,
    prediction,
    progress,
    sync_progress,
)
from realizer.playback.joint_planner import Arrival
from realizer.playback.references import anticipators_of
from realizer.scheduling.timing import UNKNOWN, Schedule, Warning
from realizer.speech.utterance import Utterance

# Maximum number of anticipators; of the others the oldest that no block is tied to are dropped.
ANTICIPATORS = 2_000


class BlockManager:
    """The blocks of one session, and their pending feedback.

    Args:
        kinds: tag -> BehaviourKind, the known behaviours.
        cast: the characters.
        veto: (block, its schedule) -> why it is refused, or None.
    """

    def __init__(
        self,
        kinds: Mapping[str, BehaviourKind],
        cast: Cast,
        veto: Callable[[Block, Schedule], str | None] = lambda block, schedule: None,
    ) -> None:
        self.kinds = kinds
        self._cast = cast
        self._veto = veto
        self.timeline = BlockTimeline(kinds, cast)
        self.blocks = self.timeline.blocks
        self.reports = self.timeline.reports
        self._announced = AnnouncedBlocks(self.blocks)

    # blocks in ----------------------------------------------------------------------------------

    def announce(self, block: Block, now: float) -> None:
        """Acknowledge a block, once: planning has begun. `accept` does it if it was not done before."""
        announced = self._announced.add(block, self._cast.index_of(block.character_id))
        if announced is not None:
            start = max([now, *(w.until for w in self._announced.dependencies(announced))])
            self.reports.add(acknowledgement(block, start if start < now + UNKNOWN else now))

    def withdraw(self, block: Block, now: float) -> None:
        """Remove an announced block that will not be submitted, and report its end."""
        character = self._cast.index_of(block.character_id)
        announced = self._announced.pop(block.id) or AnnouncedBlock(block, character)
        if not announced.is_revoked:
            self._revoke(announced, now)

    def refuse(self, warning: Warning, character: str | None = None) -> None:
        """Report why something was not accepted."""
        self.reports.warn(warning, character)

    def accept(self, block: Block, context: PlanningContext, now: float) -> Schedule:
        """Plan a block, and place it in time among the others; see `Player.submit`."""
        self.advance(now, starts_before=now)
        self.announce(block, now)
        try:
            announced = self._find_announced(block, context)
            character = self._cast.index_of(block.character_id)
            arrival = Arrival(block, character, announced.number, context)
            is_preplanned = block.preplan and not announced.activated
            state = next_state(announced.state, BlockEvent.PREPLAN if is_preplanned else BlockEvent.PLAN)
            links = self._announced.links(announced)
            ended = self._announced.blocks_to_end(announced)
            planned, others = self._plan(arrival, state, links, ended, now)
        except BlockRejectedError as refused:
            self._announced.pop(block.id)
            return self._refuse(block, refused, now)
        if planned.schedule.lengths:
            return planned.schedule
        self._announced.pop(block.id)
        if context.animates:
            self._end(ended, announced, now)
            playing = self._place(planned, arrival, state, links, now)
            self._link(playing, links)
            self._report(playing, announced, now)
            self._move_others(playing, others, now)
        return planned.schedule

    def _find_announced(self, block: Block, context: PlanningContext) -> AnnouncedBlock:
        """Return the announcement of a block that is not revoked and whose id is free."""
        announced = self._announced.find(block.id)
        if announced is not None and announced.is_revoked:
            raise BlockRejectedError(None)  # its end has been reported
        if announced is None or self._announced.is_in_use(block, self._cast.index_of(block.character_id)):
            text = f"block id {block.id!r} is still in use: wanted an id of no block that plays or waits"
            raise BlockRejectedError(Warning(block.id, "PARSING_FAILURE", text, in_use_for=context.sender))
        return announced

    def _plan(
        self, arrival: Arrival, state: State, links: BlockLinks, ended: Sequence[ActiveBlock], now: float
    ) -> tuple[Plan, list[ActiveBlock]]:
        """Plan a block as `JointPlanner.plan`; it starts when those that it waits for are over."""
        start = inf if state is State.PENDING else max([now, *(w.until for w in links.waits)])
        planned, others = self.timeline.planner.plan(arrival, start, now, waits=links.waits, ended=ended)
        schedule = planned.schedule
        if schedule.lengths:
            return planned, others
        if schedule.failed:
            raise BlockRejectedError(schedule.warnings[0], over_limit=schedule.over_limit)
        if (words := self._veto(arrival.block, schedule)) is not None:
            raise BlockRejectedError(Warning(schedule.block, "CANNOT_CREATE_BEHAVIOR", words))
        return planned, others

    def _place(
        self, planned: Plan, arrival: Arrival, state: State, links: BlockLinks, now: float
    ) -> ActiveBlock:
        """Put a planned block on the timeline."""
        _, character, number, context = arrival
        playing = ActiveBlock(planned, self.kinds, context, character, number, now, links.waits, state)
        playing.apply_plan(planned, playing.earliest, now)  # it may have ended its own dependencies
        self.blocks.add(playing)
        self.timeline.place(playing)
        return playing

    def _link(self, playing: ActiveBlock, links: BlockLinks) -> None:
        """Let blocks wait for each other, and report in this order."""
        if any(wait.block.order > playing.order for wait in links.waits):
            self.timeline.reorder(playing)
        for follower, moment in ((p, m) for p, m in links.followers if not p.is_done):
            follower.add_dependency(Dependency(playing, moment))
            self.timeline.reorder(follower)
        self._announced.place_after(playing)

    def _report(self, playing: ActiveBlock, announced: AnnouncedBlock, now: float) -> None:
        self.timeline.predict(playing, now)
        for warning in (*playing.schedule.warnings, *self._announced.unheard(announced)):
            self.reports.warn(warning, playing.block.character_id)

    def _move_others(self, playing: ActiveBlock, others: Sequence[ActiveBlock], now: float) -> None:
        """Change the times of the blocks that were solved with a new one, and of those that wait for it."""
        self.timeline.retime(others, playing.plan.other_schedules, now)
        self.timeline.trim(playing.plan.trims, now)
        self.timeline.update_followers(playing, now)

    # time ---------------------------------------------------------------------------------------

    def advance(self, now: float, starts_before: float = inf) -> None:
        """Process everything that is due, in order, each event at its own time.

        Blocks that start at `starts_before` or later do not start yet: one that starts at an instant starts
        after everything that arrives at this instant.
        """
        for event in work.counted(self.timeline.events.due(now, starts_before), 5):
            self._handle_event(event, self.blocks[event.block])

    def next_deadline(self) -> float | None:
        """Return when `due` next returns something; None if nothing plays or waits; past for at once."""
        return float("-inf") if self.reports else self.timeline.events.next

    def is_idle(self, now: float = -inf) -> bool:
        """Whether nothing plays, waits or is visible, so that a snapshot holds the whole state.

        Blocks that have ended by `now` do not count, though they affect idle motion for some seconds.
        """
        seen = any(not playing.is_done or playing.invisible_after > now for playing in self.blocks.all())
        return not (seen or self._announced or self.reports)

    def _handle_event(self, event: Event, playing: ActiveBlock) -> None:
        block, time = playing.block, event.time
        match event.phase:
            case Phase.SYNC:
                self.reports.add(sync_progress(block, event.name, event.sync, time, playing.start))
                if event.point == 0:
                    node = block[event.name]
                    if (act := self.kinds[node.tag].command) is not None:
                        self._act(playing, event.name, act(node), time)
            case Phase.START:
                if self.timeline.resolve_conflicts(playing, time):
                    return  # its start is due again, or it was stopped
                playing.change_state(BlockEvent.START)
                playing.dependencies.clear()
                self.reports.add(progress(block, "start", time, playing.state))
                self.reports.add(prediction(block, playing.schedule, playing.state))
                for id in block.on_start:
                    if not self.activate(id, time):
                        text = f"onStart: wanted a block that was preplanned and waits, got {id!r}"
                        self.reports.warn(Warning(block.id, "EXECUTION_FAILURE", text), block.character_id)
            case Phase.SUBSIDES:
                playing.change_state(BlockEvent.SUBSIDE)
                self.reports.add(prediction(block, playing.schedule, playing.state))
            case Phase.END:
                playing.change_state(BlockEvent.END)
                self.blocks.end(playing)
                said, shown = playing.words_spoken(time), playing.plays or not playing.wants
                self.reports.add(progress(block, "end", time, playing.state, said, shown=shown))

    def _act(self, playing: ActiveBlock, behaviour: str, act: BlockCommand, now: float) -> None:
        try:
            execute(self, playing, behaviour, act, now)
        except CommandError as fault:
            required = behaviour in playing.block.required
            name = playing.block.id if required else f"{playing.block.id}:{behaviour}"
            text = f"{behaviour}, which is required: {fault}" if required else str(fault)
            place = playing.block.places.get(behaviour)
            text = text if place is None else place.with_place(text)
            self.reports.warn(Warning(name, "EXECUTION_FAILURE", text), playing.block.character_id)
            if required and not playing.is_done:
                self.timeline.stop(playing, now)

    # commands -----------------------------------------------------------------------------------

    def has_seen(self, id: str) -> bool:
        """Whether there is, was or will be such a block."""
        return self._announced.find(id) is not None or self.blocks.has_seen(id)

    def revoke(self, id: str, now: float) -> bool:
        """End a block that was announced and has not arrived; return False if there is none.

        What it interrupts or replaces ends too, because that must not depend on how long its voice takes.
        """
        announced = self._announced.find(id)
        if announced is None or announced.is_revoked:
            return False
        if not announced.is_too_late:
            self._end(self._announced.blocks_to_end(announced), announced, now)
        self._revoke(announced, now)
        return True

    def _end(self, ended: Sequence[ActiveBlock], announced: AnnouncedBlock, now: float) -> None:
        """End accepted blocks, and those in preparation that a block interrupts or replaces."""
        together = frozenset(ended)
        for playing in ended:
            self.timeline.stop(playing, now, together)
        for other in self._announced.before(announced):
            if announced.ends(other):
                self.revoke(other.block.id, now)

    def _revoke(self, announced: AnnouncedBlock, now: float) -> None:
        announced.change_state(BlockEvent.STOP)
        self.blocks.note_revoked(announced.block.id)
        self.reports.add(progress(announced.block, "end", now, announced.state))

    def stop(self, now: float, block_ids: Iterable[str] | None = None) -> list[str]:
        """End blocks, or all; return their ids. Sound fades, the face relaxes to its base without a jump."""
        ids = None if block_ids is None else set(block_ids)
        self.advance(now, starts_before=now)
        stopped = [p for p in self.blocks.active() if ids is None or p.block.id in ids]
        # The last first, so that no block is planned again because its dependency was stopped.
        for playing in reversed(stopped):
            if not playing.is_done:
                self.timeline.stop(playing, now)
        return [p.block.id for p in stopped]

    def activate(self, id: str, now: float) -> bool:
        """Activate a preplanned block: it starts after its dependencies. Return False if there is none."""
        playing = self.blocks.find(id)
        if playing is None:
            announced = self._announced.find(id)
            if announced is None or not announced.block.preplan:
                return False
            announced.activated = True
            return True
        if playing.state is not State.PENDING:
            return False
        playing.change_state(BlockEvent.ACTIVATE)
        playing.not_before = now
        if self.timeline.move(playing, now):
            self.timeline.update_followers(playing, now)
        return True

    def anticipate(self, id: str, syncs: Mapping[str, float], now: float) -> None:
        """Set the expected times of the points `anticipators:id:sync`; sync points tied to them follow.

        `syncs` are seconds on the session clock; a time that is too soon becomes the earliest possible. A
        point that has passed stays where it was.
        """
        self.advance(now, starts_before=now)
        tied = [p for p in self.blocks.active() if p.start < inf and id in anticipators_of(p.block)]
        groups = [[p, *self.timeline.linked_blocks(p, now)] for p in tied]
        leads = [lead_times(group, id, syncs, now) for group in groups]
        soonest = {sync: max([now, *(lead[sync] for lead in leads)]) for sync in syncs}
        self.blocks.anticipate(id, {sync: max(time, soonest[sync]) for sync, time in syncs.items()})
        if (beyond := len(self.blocks.anticipators) - ANTICIPATORS) > 0:
            wanted = {id}.union(*(anticipators_of(p.block) for p in self.blocks.active()))
            old = (name for name in self.blocks.anticipators if name not in wanted)
            self.blocks.drop_anticipators(set(islice(old, beyond)))
        for own, *others in groups:
            if self.timeline.reschedule([own, *others], own.start, now):
                continue
            # What waits for the point must not wait for ever.
            self.timeline.reschedule([own], own.start, now)
            for other in others:
                self.timeline.end_open(other, now)

    def update_speech_timing(self, block: str, behaviour: str, utterance: Utterance, now: float) -> bool:
        """Replace an utterance by one with its real timing while it is spoken; the rest of the block follows.

        Points that have passed stay where they were. Return False if the speech neither plays nor waits.
        """
        self.advance(now, starts_before=now)
        playing = self.blocks.find(block)
        if playing is None or behaviour not in playing.plan.timings:
            return False
        if playing.start == inf:  # it is planned when its start is known
            utterances = {**playing.context.utterances, behaviour: utterance}
            playing.context = replace(playing.context, utterances=utterances)
            return True
        self.timeline.update_speech(playing, behaviour, utterance, now)
        return True

    def _refuse(self, block: Block, refused: BlockRejectedError, now: float) -> Schedule:
        failed = Schedule(block.id, {}, {}, start=now, failed=True, over_limit=refused.over_limit)
        if refused.warning is None:
            return failed
        self.reports.warn(refused.warning, block.character_id)
        self.blocks.note_revoked(block.id)
        return replace(failed, warnings=(refused.warning,))
