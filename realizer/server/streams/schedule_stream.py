"""The stream `schedule`: changes of planned blocks as JSON."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field

from realizer.charts.chart_data import chart_of
from realizer.charts.timeline import BlockChart
from realizer.playback.active_block import ActiveBlock
from realizer.playback.block_states import State
from realizer.playback.block_store import BlockStore
from realizer.playback.references import references
from realizer.scheduling.timing import Schedule


@dataclass(eq=False)
class Snapshot:
    """A block as it was last sent.

    Attributes:
        others: ids of the blocks it refers to.
        schedules: its own schedule and those of `others`; a block that moves gets a new object. Empty before
            the first message.
        text: the whole block as JSON, computed on first use.
    """

    playing: ActiveBlock
    others: tuple[str, ...]
    schedules: list[Schedule | None] = field(default_factory=list)
    state: State | None = None
    text: str | None = None


class ScheduleStream:
    """The changes of blocks since the last look, encoded once for all subscribers."""

    def __init__(self, cast: BlockStore) -> None:
        self._cast = cast
        self._snapshots: dict[int, Snapshot] = {}

    def reset(self) -> None:
        """Forget all blocks, as there are no subscribers."""
        self._snapshots.clear()

    def has_changes(self) -> bool:
        """Whether `changes` would return something."""
        schedules = self._schedules()
        return any(p.number not in self._snapshots for p in self._cast.active()) or any(
            seen.state is not seen.playing.state or self._has_moved(seen, schedules)
            for seen in self._snapshots.values()
        )

    def changes(self) -> list[tuple[int, str]]:
        """Return (character index, JSON) of each block that was planned, moved, cut, started or ended.

        If the times of a block have not changed, the JSON has only its state, start and end. A block that has
        ended is returned once more and then forgotten.
        """
        for playing in self._cast.active():
            if playing.number not in self._snapshots:
                named = {ref.block for ref in references(playing.block) if ref.block is not None}
                self._snapshots[playing.number] = Snapshot(playing, tuple(named - {playing.block.id}))
        found: list[tuple[int, str]] = []
        schedules = self._schedules()
        for number, seen in list(self._snapshots.items()):
            moved = self._has_moved(seen, schedules)
            if moved or seen.state is not seen.playing.state:
                seen.text, seen.state = None, seen.playing.state
                seen.schedules = [seen.playing.schedule, *map(schedules, seen.others)]
                text = self._text(seen) if moved else _json(self._chart(seen).head())
                found.append((seen.playing.character, text))
            if seen.playing.is_done:
                del self._snapshots[number]
        return found

    def full_message(self, character: int | None) -> str:
        """Return all blocks of one character or all as of the last `changes`, separated by commas."""
        wanted = (s for s in self._snapshots.values() if character in (None, s.playing.character))
        return ",".join(self._text(seen) for seen in wanted)

    def _has_moved(self, seen: Snapshot, schedules: Callable[[str], Schedule | None]) -> bool:
        """Whether the block or one that it refers to has a new schedule."""
        now = [seen.playing.schedule, *map(schedules, seen.others)]
        return len(now) != len(seen.schedules) or any(
            a is not b for a, b in zip(now, seen.schedules, strict=True)
        )

    def _schedules(self) -> Callable[[str], Schedule | None]:
        """Return a function from the id of a block to its present schedule."""
        newest = {playing.block.id: playing.schedule for playing in self._cast.all()}

        return lambda id: newest[id] if id in newest else self._cast.schedule_of(id)

    def _text(self, seen: Snapshot) -> str:
        if seen.text is None:
            seen.text = _json(self._chart(seen).to_json())
        return seen.text

    def _chart(self, seen: Snapshot) -> BlockChart:
        return chart_of(seen.playing, self._cast.schedule_of)


def schedule_message(time: float, blocks: str, character: str | None, *, whole: bool) -> str:
    """Return a message of the stream.

    Args:
        time: seconds on the session clock.
        blocks: JSON objects separated by commas.
        character: the character that the client named, or None.
        whole: whether these are all blocks, not only the changed ones.
    """
    head = {"type": "schedule", "time": round(time, 6), "whole": whole}
    if character is not None:
        head["character"] = character
    return f'{_json(head)[:-1]},"blocks":[{blocks}]}}'


def _json(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
