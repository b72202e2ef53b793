"""The stream `schedule`: changes of planned blocks as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from realizer.playback.active_block import ActiveBlock
from realizer.playback.block_states import State
from realizer.playback.block_store import BlockStore
from realizer.playback.references import references
from realizer.scheduling.timing import Schedule
from realizer.server.session.connections import Connection, ScheduleSubscription
from realizer.server.session.effects import Effect, Send

if TYPE_CHECKING:
    from realizer.charts.timeline import BlockChart

# A slow client gets schedules again after this time.
RETRY = 0.1  # s


@dataclass(eq=False)
class Snapshot:
    """A block as it was last sent.

    Attributes:
        schedules: its own schedule and those of `others`; a block that moves gets a new object. Empty before
            the first message.
    """

    block: ActiveBlock
    others: tuple[str, ...]  # ids of the blocks it refers to
    schedules: list[Schedule | None] = field(default_factory=list)
    state: State | None = None
    text: str | None = None  # the whole block as JSON, computed on first use


class ScheduleStream:
    """The changes of blocks since the last look, encoded once for all subscribers."""

    def __init__(self, store: BlockStore) -> None:
        self._store = store
        self._snapshots: dict[int, Snapshot] = {}

    def send_due(
        self, subscribers: list[tuple[Connection, ScheduleSubscription]], now: float, effects: list[Effect]
    ) -> None:
        """Send changed blocks to subscribers that know the rest, all blocks to the others."""
        if not subscribers:
            self._snapshots.clear()
            return
        changes = self.changes()
        for connection, s in subscribers:
            changed = [text for character, text in changes if s.index in (None, character)]
            if connection.is_slow:
                # The full update that is sent later includes these changes.
                s.needs_full_update |= bool(changed)
                s.retry_at = now + RETRY
            elif s.needs_full_update or changed:
                whole = s.needs_full_update
                blocks = self.all_blocks(s.index) if whole else ",".join(changed)
                if whole:
                    s.needs_full_update, s.retry_at = False, now
                effects.append(Send(connection.id, schedule_message(now, blocks, s.name, whole=whole)))

    def next_due(self, subscribers: list[tuple[Connection, ScheduleSubscription]]) -> float:
        """Return when `send_due` would send something; infinity for never."""
        changed = bool(subscribers) and self.has_changes()
        times = (s.retry_at for _, s in subscribers if s.needs_full_update or changed)
        return min(times, default=math.inf)

    def has_changes(self) -> bool:
        """Whether `changes` would return something."""
        schedules = self._schedules()
        return any(block.number not in self._snapshots for block in self._store.active()) or any(
            s.state is not s.block.state or _has_moved(s, schedules) for s in self._snapshots.values()
        )

    def changes(self) -> list[tuple[int, str]]:
        """Return (character index, JSON) of each block that was planned, moved, cut, started or ended.

        If the times of a block have not changed, the JSON has only its state, start and end. A block that has
        ended is returned once more and then forgotten.
        """
        for block in self._store.active():
            if block.number not in self._snapshots:
                others = {ref.block for ref in references(block.block)} - {None, block.block.id}
                self._snapshots[block.number] = Snapshot(block, tuple(filter(None, others)))
        changes: list[tuple[int, str]] = []
        schedules = self._schedules()
        for number, snapshot in list(self._snapshots.items()):
            block, moved = snapshot.block, _has_moved(snapshot, schedules)
            if moved or snapshot.state is not block.state:
                snapshot.text, snapshot.state = None, block.state
                snapshot.schedules = [block.schedule, *map(schedules, snapshot.others)]
                text = self._text(snapshot) if moved else _json(self._chart(snapshot).head())
                changes.append((block.character, text))
            if block.is_done:
                del self._snapshots[number]
        return changes

    def all_blocks(self, character: int | None) -> str:
        """Return all blocks of one character or all as of the last `changes`, separated by commas."""
        snapshots = (s for s in self._snapshots.values() if character in (None, s.block.character))
        return ",".join(map(self._text, snapshots))

    def _schedules(self) -> Callable[[str], Schedule | None]:
        """Return a function from the id of a block to its present schedule."""
        newest = {block.block.id: block.schedule for block in self._store.all()}

        return lambda id: newest[id] if id in newest else self._store.schedule_of(id)

    def _text(self, snapshot: Snapshot) -> str:
        if snapshot.text is None:
            snapshot.text = _json(self._chart(snapshot).to_json())
        return snapshot.text

    def _chart(self, snapshot: Snapshot) -> BlockChart:
        from realizer.charts.chart_data import chart_of

        return chart_of(snapshot.block, self._store.schedule_of)


def _has_moved(snapshot: Snapshot, schedules: Callable[[str], Schedule | None]) -> bool:
    now = [snapshot.block.schedule, *map(schedules, snapshot.others)]
    return list(map(id, now)) != list(map(id, snapshot.schedules))


def schedule_message(time: float, blocks: str, character: str | None, *, whole: bool) -> str:
    """Return a message of the stream.

    Args:
        blocks: JSON objects separated by commas.
        whole: whether these are all blocks, not only the changed ones.
    """
    head = {"type": "schedule", "time": round(time, 6), "whole": whole}
    if character is not None:
        head["character"] = character
    return f'{_json(head)[:-1]},"blocks":[{blocks}]}}'


def _json(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
