"""An accepted block, while it waits or plays: its state, and the blocks that wait for each other."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import Literal

from bml_schema import without
from realizer.core import work
from realizer.playback.block_states import BlockEvent, State, next_state
from realizer.playback.character import RELAX
from realizer.playback.placed_block import PlacedBlock
from realizer.scheduling.timing import UNKNOWN, Schedule

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
class ActiveBlock(PlacedBlock):
    """An accepted block, until it has ended and its last frames are past."""

    number: int  # order of arrival, from 1
    not_before: float  # its earliest start, seconds on the session clock
    # blocks that it waits for; empty once it has started
    dependencies: list[Dependency] = field(default_factory=list)
    state: State = State.LURKING
    stopped_at: float | None = None  # when it was cut off, or None
    followers: list[ActiveBlock] = field(default_factory=list)  # blocks that wait for it
    # at one instant it reports before blocks of a higher order, as of `set_order`
    order: tuple[int, int, int] = field(init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.order = self.number, 0, self.number
        for wait in self.dependencies:
            wait.block.followers.append(self)

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

    def cut(self, behaviours: Collection[str], now: float, *, ends: bool = False) -> list[str]:
        """Cut behaviours, as `PlacedBlock`; a waiting block is planned again without those removed."""
        removed = super().cut(behaviours, now, ends=ends)
        if removed and self.is_waiting:
            self.plan = replace(self.plan, block=without(self.block, removed).block)
        return removed
