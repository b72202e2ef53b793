"""The values of a chart: behaviours with points and stretch, links, dropped behaviours.

Plots and the stream `schedule` show this same data.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from realizer.charts.links import Link
from realizer.scheduling.timing import Warning

# Digits after the point of seconds in JSON: a microsecond.
DIGITS = 6


class Point(NamedTuple):
    """A sync point: seconds from block start, and on the session clock (None: the start is not known)."""

    name: str
    time: float
    at: float | None


class WordSpan(NamedTuple):
    """A word and its time, seconds from block start."""

    start: float
    end: float
    text: str


class Gap(NamedTuple):
    """A gap between two neighbouring sync points, in seconds.

    Attributes:
        preferred, least, most, stiffness: as in the Timing; None after an interruption, `most` also if there
            is no maximum. A rigid gap has exactly its preferred length and no stiffness.
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
        """Return actual / preferred: 1 is as preferred; None if there is no preferred length, or it is 0."""
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
class BehaviourRow:
    """The row of a behaviour.

    Attributes:
        element: its name, such as "head".
        line: its line in the document.
        words: the spoken words, in order.
    """

    id: str
    element: str
    line: int | None
    required: bool
    points: tuple[Point, ...]
    gaps: tuple[Gap, ...]
    links: tuple[Link, ...] = ()
    words: tuple[WordSpan, ...] = ()

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
    """A dropped behaviour, or a constraint that does not hold; `text` says why.

    Attributes:
        id: of the behaviour; as warnings name it, if it is a constraint or something else.
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
class BlockChart:
    """The chart of a block.

    Attributes:
        start, end: seconds on the session clock; None while unknown.
        state: in the words of BMLA; FAILED for one that was refused.
        cost: the total cost of the stretched gaps.
        warnings: all, of what plays nevertheless too.
    """

    block: str
    character: str | None
    state: str
    start: float | None
    end: float | None
    rows: tuple[BehaviourRow, ...] = ()
    dropped: tuple[Dropped, ...] = ()
    warnings: tuple[Warning, ...] = ()

    @property
    def cost(self) -> float:
        return sum(gap.cost for line in self.rows for gap in line.gaps)

    def head(self) -> dict[str, Any]:
        """Return the block's name and state as plain data."""
        return {
            "block": self.block,
            "character": self.character,
            "state": self.state,
            "start": _seconds(self.start),
            "end": _seconds(self.end),
        }

    def to_json(self) -> dict[str, Any]:
        """Return the block as plain data; an element of `blocks` in the stream `schedule`."""
        return {
            **self.head(),
            "cost": _seconds(self.cost),
            "behaviours": [line.to_json() for line in self.rows],
            "dropped": [dropped.to_json() for dropped in self.dropped],
            "warnings": [warning.to_json() for warning in self.warnings],
        }

    def detail(self) -> dict[str, Any]:
        """Return the details of `realizer schedule --json --detail`; gaps and links by behaviour."""
        return {
            "state": self.state,
            "cost": self.cost,
            "gaps": {line.id: [gap.to_json() for gap in line.gaps] for line in self.rows},
            "links": {line.id: [link.to_json() for link in line.links] for line in self.rows},
            "dropped": [dropped.to_json() for dropped in self.dropped],
        }


def _seconds(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else round(value, DIGITS)
