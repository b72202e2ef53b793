"""A block that plays in, plain data out: its points, how far its gaps are stretched, what ties it, what went.

Plots and the stream `schedule` show this same data.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

from bml_schema import Behaviour, Block, Place
from realizer.charts.links import Link, links_of
from realizer.composition.cast import Cast
from realizer.composition.playing import Playing
from realizer.composition.relations import instants
from realizer.scheduling.timing import Schedule, Timing, Warning

__all__ = ["BlockLine", "Dropped", "Gap", "Line", "Link", "Point", "Spoken", "line_of", "lines_of"]

# Digits after the point of seconds in JSON: a microsecond.
DIGITS = 6


class Point(NamedTuple):
    """A sync point: seconds from block start, and on the session clock (None: the start is not known)."""

    name: str
    time: float
    at: float | None


class Spoken(NamedTuple):
    """A word and its time, seconds from block start."""

    start: float
    end: float
    text: str


class Gap(NamedTuple):
    """What lies between two neighbouring sync points, in seconds.

    Attributes:
        preferred, least, most, stiffness: as of the Timing; None in what was cut off, `most` also where there
            is none. A rigid gap is exactly its preferred length, and has no stiffness.
    """

    begin: str
    end: str
    actual: float
    preferred: float | None = None
    least: float | None = None
    stiffness: float | None = None
    rigid: bool = False
    most: float | None = None

    @property
    def stretch(self) -> float | None:
        """actual / preferred: 1 is as preferred; None where nothing is preferred, or a length of 0."""
        return self.actual / self.preferred if self.preferred else None

    @property
    def cost(self) -> float:
        """stiffness x (actual - preferred)^2."""
        if self.stiffness is None or self.preferred is None:
            return 0.0
        return self.stiffness * (self.actual - self.preferred) ** 2

    def to_json(self) -> dict[str, Any]:
        return {
            "from": self.begin,
            "to": self.end,
            "actual": _seconds(self.actual),
            "preferred": _seconds(self.preferred),
            "least": _seconds(self.least),
            "most": _seconds(self.most),
            "stiffness": self.stiffness,
            "rigid": self.rigid,
            "stretch": _seconds(self.stretch),
            "cost": _seconds(self.cost),
        }


@dataclass(frozen=True)
class Line:
    """One behaviour.

    Attributes:
        element: its name, such as "head".
        line: where it stands in the document.
        words: what is said, in order.
    """

    id: str
    element: str
    line: int | None
    required: bool
    points: tuple[Point, ...]
    gaps: tuple[Gap, ...]
    links: tuple[Link, ...] = ()
    words: tuple[Spoken, ...] = ()

    def to_json(self) -> dict[str, Any]:
        out: dict[str, Any] = {
            "id": self.id,
            "element": self.element,
            "line": self.line,
            "required": self.required,
            "syncs": [{"name": p.name, "time": _seconds(p.time), "at": _seconds(p.at)} for p in self.points],
            "gaps": [gap.to_json() for gap in self.gaps],
            "links": [link.to_json() for link in self.links],
        }
        if self.words:
            out["words"] = [
                {"start": _seconds(w.start), "end": _seconds(w.end), "text": w.text} for w in self.words
            ]
        return out


class Dropped(NamedTuple):
    """A behaviour that is not played, or a constraint that is not kept; `text` says why.

    Attributes:
        id: of the behaviour; as warnings name it, where it is a constraint or something else.
        type: of the warning, or what became of the block (REVOKED, INTERRUPTED).
    """

    id: str
    element: str | None
    line: int | None
    type: str
    text: str

    def to_json(self) -> dict[str, Any]:
        return self._asdict()


@dataclass(frozen=True)
class BlockLine:
    """One block.

    Attributes:
        start, end: seconds on the session clock; None while that is not known.
        state: in the words of BMLA; FAILED for one that was refused.
        cost: what the stretched gaps of its behaviours cost together.
        warnings: all, of what plays nevertheless too.
    """

    block: str
    character: str | None
    state: str
    start: float | None
    end: float | None
    lines: tuple[Line, ...] = ()
    dropped: tuple[Dropped, ...] = ()
    warnings: tuple[Warning, ...] = ()

    @property
    def cost(self) -> float:
        return sum(gap.cost for line in self.lines for gap in line.gaps)

    def head(self) -> dict[str, Any]:
        """What it is and what it does now, as plain data."""
        return {
            "block": self.block,
            "character": self.character,
            "state": self.state,
            "start": _seconds(self.start),
            "end": _seconds(self.end),
        }

    def to_json(self) -> dict[str, Any]:
        """All of it as plain data; an element of `blocks` in the stream `schedule`."""
        return {
            **self.head(),
            "cost": _seconds(self.cost),
            "behaviours": [line.to_json() for line in self.lines],
            "dropped": [dropped.to_json() for dropped in self.dropped],
            "warnings": [warning.to_json() for warning in self.warnings],
        }

    def detail(self) -> dict[str, Any]:
        """What `realizer schedule --json --detail` tells beside the times; gaps and links by behaviour."""
        return {
            "state": self.state,
            "cost": self.cost,
            "gaps": {line.id: [gap.to_json() for gap in line.gaps] for line in self.lines},
            "links": {line.id: [link.to_json() for link in line.links] for line in self.lines},
            "dropped": [dropped.to_json() for dropped in self.dropped],
        }


def lines_of(cast: Cast, schedules: Iterable[Schedule]) -> list[BlockLine]:
    """The blocks of a player, one for each schedule that its `submit` gave."""
    playing = {id(p.first): p for p in cast.all()}
    out = []
    for schedule in schedules:
        known = playing.get(id(schedule))
        out.append(_refused(schedule) if known is None else line_of(known, cast.schedule_of))
    return out


def line_of(playing: Playing, schedule_of: Callable[[str], Schedule | None]) -> BlockLine:
    """A block as it now stands.

    Args:
        schedule_of: block id -> its schedule, for what is tied to other blocks.
    """
    block, schedule = playing.block, playing.schedule
    known = math.isfinite(schedule.start)
    start = schedule.start if known else None
    links = links_of(block, schedule, instants(schedule_of, schedule.start if known else 0.0))
    own = tuple(
        _line(playing, node, start, tuple(links.get(node.id, ())))
        for node in block.behaviours
        if node.id in schedule.times
    )
    warnings = tuple(dict.fromkeys((*playing.first.warnings, *schedule.warnings)))
    dropped = [d for w in warnings if (d := _dropped(w, block, schedule)) is not None]
    names = {d.id for d in dropped}
    dropped += [_cut(playing, id) for id in playing.first.times if id not in (*names, *schedule.times)]
    end = playing.end if known else None
    return BlockLine(
        block.id, block.character_id, playing.state.value, start, end, own, tuple(dropped), warnings
    )


def _line(playing: Playing, node: Behaviour, start: float | None, links: tuple[Link, ...]) -> Line:
    names, times = playing.schedule.points[node.id], playing.schedule.times[node.id].tolist()
    points = tuple(
        Point(name, time, None if start is None else start + time)
        for name, time in zip(names, times, strict=True)
    )
    place = playing.block.places.get(node.id)
    utterance = playing.world.utterances.get(node.id)
    words = utterance.words if utterance is not None else ()
    return Line(
        node.id,
        node.tag.rpartition("}")[2],
        place.line if place is not None else None,
        node.id in playing.block.required,
        points,
        _gaps(names, times, playing.plan.timings.get(node.id)),
        links,
        tuple(
            Spoken(times[0] + w.start, times[0] + w.end, w.text)
            for w in words
            if times[0] + w.start < times[-1]
        ),
    )


def _gaps(names: tuple[str, ...], times: list[float], timing: Timing | None) -> tuple[Gap, ...]:
    gaps = [
        Gap(begin, end, after - before)
        for begin, end, before, after in zip(names[:-1], names[1:], times[:-1], times[1:], strict=True)
    ]
    if timing is None or timing.points != names:
        return tuple(gaps)
    if timing.rigid:
        return tuple(
            g._replace(preferred=p, least=p, most=p, rigid=True)
            for g, p in zip(gaps, timing.preferred.tolist(), strict=True)
        )
    most = [math.inf] * len(gaps) if timing.most is None else timing.most.tolist()
    wants = zip(
        timing.preferred.tolist(), timing.least.tolist(), timing.stiffness.tolist(), most, strict=True
    )
    return tuple(
        g._replace(preferred=p, least=least, stiffness=a, most=limit if math.isfinite(limit) else None)
        for g, (p, least, a, limit) in zip(gaps, wants, strict=True)
    )


def _dropped(warning: Warning, block: Block, schedule: Schedule) -> Dropped | None:
    """What a warning says is gone; None where it is about something that plays."""
    prefix = f"{block.id}:"
    id = warning.id.removeprefix(prefix) if warning.id.startswith(prefix) else ""
    problem = next((p for p in block.problems if (p.id, p.type) == (warning.id, warning.type)), None)
    if id in schedule.times and problem is None:
        return None
    place = Place(problem.line, problem.path) if problem is not None else block.places.get(id or warning.id)
    element = None
    if place is not None:
        element = place.path.rpartition("/")[2].partition("[")[0].rpartition(":")[2] or None
    return Dropped(
        id or warning.id, element, place.line if place is not None else None, warning.type, warning.text
    )


def _cut(playing: Playing, id: str) -> Dropped:
    """What was ended before it began."""
    place, state = playing.block.places.get(id), playing.state.value
    when = "" if playing.stopped is None else f" at {playing.stopped:.3f} s"
    return Dropped(
        id,
        playing.block[id].tag.rpartition("}")[2],
        place.line if place is not None else None,
        state,
        f"cut off{when}, before it began",
    )


def _refused(schedule: Schedule) -> BlockLine:
    """A block that failed."""
    gone = tuple(Dropped(w.id, None, None, w.type, w.text) for w in schedule.warnings)
    return BlockLine(
        schedule.block,
        schedule.character,
        "FAILED",
        schedule.start,
        schedule.start,
        (),
        gone,
        schedule.warnings,
    )


def _seconds(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else round(value, DIGITS)
