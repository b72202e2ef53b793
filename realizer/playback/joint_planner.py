"""The planner of blocks beside the active ones, which are solved together with those they are linked to."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from math import inf
from typing import NamedTuple

from bml_schema import Block
from realizer.behaviours.kind import BehaviourKind, PlanningContext
from realizer.core import work
from realizer.playback import block_links
from realizer.playback.active_block import ActiveBlock, Dependency
from realizer.playback.block_links import affected_blocks, members
from realizer.playback.block_planner import Plan
from realizer.playback.block_planner import plan as plan_block
from realizer.playback.block_store import BlockStore
from realizer.playback.references import speaks_after
from realizer.playback.resources import ResourceClaim, after_interrupts, claims, conflicts, interrupts
from realizer.scheduling import schedule_together
from realizer.scheduling.timing import Schedule


class Arrival(NamedTuple):
    """A block to be planned, the index of its character, and its number by order of arrival."""

    block: Block
    character: int
    number: int
    context: PlanningContext


class JointPlanner:
    """Plans for blocks, which take the active blocks of `blocks` into account and change none of them."""

    def __init__(self, kinds: Mapping[str, BehaviourKind], blocks: BlockStore) -> None:
        self._kinds = kinds
        self._blocks = blocks

    def plan(
        self,
        arrival: Arrival,
        start: float,
        now: float,
        *,
        waits: Collection[Dependency] = (),
        ended: Collection[ActiveBlock] = (),
        alone: bool = False,
        starts: bool = False,
        may_stretch: bool = True,
    ) -> tuple[Plan, list[ActiveBlock]]:
        """Plan a block beside the active ones; return the plan, and the blocks that are solved with it.

        While its start is unknown, it is planned as if it started now, and does not move other blocks.
        Conflicts with blocks that wait are resolved when it starts, because they may still move.

        Args:
            waits, ended: the blocks that it waits for, and those that it ends.
            alone: sync points of other blocks are fixed.
            starts: whether its start event is due.
            may_stretch: whether the plan may require speech of other lengths.
        """
        block, character = arrival.block, arrival.character
        known = start < inf
        origin = start if known else now
        alive = [p for p in self._blocks.active() if p not in ended and p.block.id != block.id]
        others = affected_blocks(block, alive, now, waits) if known and not alone else []
        schedule_of, first_schedule_of = (
            block_links.with_stops(look, ended, now)
            for look in (self._blocks.schedule_of, self._blocks.first_schedule_of)
        )
        earlier = block_links.spoken_before(block, alive)
        existing = self.existing_claims(character, arrival.number if starts else 0, alive, now, earlier)

        def plan(others: Sequence[ActiveBlock]) -> Plan:
            return plan_block(
                block,
                self._kinds,
                arrival.context,
                start=origin,
                external_times=block_links.ExternalTimes(schedule_of, origin, first_schedule_of),
                existing_claims=existing if start <= now else (),
                others=members(others, origin, now, new=block),
                may_stretch=may_stretch,
            )

        planned = plan(others)
        if planned.other_schedules and self._conflict(others, planned.other_schedules):
            return plan([]), []
        return planned, others

    def existing_claims(
        self,
        character: int,
        number: int,
        alive: Sequence[ActiveBlock],
        now: float,
        without: Collection[ActiveBlock] = (),
    ) -> list[ResourceClaim]:
        """Return the claims that a block gives way to, after the interrupts that all will make."""
        known = (p for p in alive if p.start < inf)
        promised = (cut for p in known for cut in interrupts(p.block, p.schedule) if cut[0] >= now)
        return after_interrupts(block_links.existing_claims(character, number, alive, without), promised)

    def fit(self, blocks: Sequence[ActiveBlock], origin: float, now: float) -> list[Schedule] | str:
        """Return the schedules of playing blocks at their best fit, or why there is none."""
        together = members(blocks, origin, now, is_moved=True)
        instants = block_links.ExternalTimes(self._blocks.schedule_of, origin, self._blocks.first_schedule_of)
        try:
            with work.limited(blocks[0].context.max_planning):
                schedules = schedule_together(together, outside=instants)
        except work.WorkLimitError as error:
            return str(error)
        if schedules[0].failed:
            return schedules[0].warnings[0].text
        return "it would disturb another block" if self._conflict(blocks, schedules) else schedules

    def _conflict(self, blocks: Sequence[ActiveBlock], schedules: Sequence[Schedule]) -> bool:
        for playing, schedule in zip(blocks, schedules, strict=True):
            at = replace(schedule, start=playing.start)
            active = self._blocks.active()
            later = (p for p in playing.followers if playing.block.id in speaks_after(p.block))
            existing = block_links.existing_claims(playing.character, inf, active, [*blocks, *later])
            if conflicts(claims(playing.block, at, self._kinds, playing.context), existing):
                return True
        return False
