"""Arrows of a chart: links between sync points, and the slack of orders."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from realizer.charts.diverging_scale import HELD, LINK, PAPER, ROOM, TIGHT
from realizer.charts.links import Link
from realizer.charts.rows import ABOVE, BAR, SMALL
from realizer.charts.scale import Scale
from realizer.charts.shapes import Box, Path, Picture, Text, hatch, width_of
from realizer.charts.timeline import BehaviourRow, BlockChart

Spot = tuple[float, float]  # pixels to the right and down
Place = tuple[BehaviourRow, float, float]  # a line, the start of its block, and the top of its row
Places = Mapping[tuple[str, str], Place]  # block, behaviour -> its place
BEND = 28  # pieces of a curve


@dataclass(frozen=True)
class Arrows:
    """Draws the links of blocks: curves into `picture`, below the bars; their ends into `marks`, above."""

    picture: Picture
    marks: Picture
    scale: Scale
    places: Places

    def draw(self, block: BlockChart) -> None:
        """Draw the links of a block."""
        start = block.start or 0.0
        for line in block.rows:
            top = self.places[block.block, line.id][2]
            when = {point.name: start + point.time for point in line.points}
            pinned: set[str] = set()
            for link in sorted(line.links, key=lambda link: link.binds):
                x = self.scale.x(when[link.sync])
                there = self.places.get((link.block or block.block, link.behaviour or ""))
                if link.kind in ("before", "after"):
                    self._room(link, when[link.sync], top, self._end_of(link, there))
                elif there is not None and there[0].id != line.id:
                    self._tie(link, (x, top), self._end_of(link, there))
                elif link.sync not in pinned and there is None:
                    pinned.add(link.sync)
                    self._pin(x, top, link)

    def _end_of(self, link: Link, there: Place | None) -> Spot | None:
        """Return the position of a link's other point, and the top of its row, or None if it is not drawn."""
        if there is None:
            return None
        line, start, top = there
        time = next((point.time for point in line.points if point.name == link.other), None)
        return None if time is None else (self.scale.x(start + time), top)

    def _tie(self, link: Link, here: Spot, there: Spot | None) -> None:
        """Draw a curve, a dot at the point that is referred to, and an arrow at the one that follows it."""
        if there is None:
            return
        begin, end = _edges(there, here)
        tip = _words(link)
        self.picture.add(Path(_curve(begin, end), LINK, 1.3, tip=tip))
        self.marks.add(Box(begin[0] - 2.5, begin[1] - 2.5, 5, 5, LINK, radius=2.5, tip=tip))
        if link.kind == "synchronize":
            self.marks.add(Box(end[0] - 2.5, end[1] - 2.5, 5, 5, LINK, radius=2.5, tip=tip))
        else:
            up = 6.0 if end[1] > begin[1] else -6.0
            self.marks.add(Path((end, (end[0] - 3.5, end[1] - up), (end[0] + 3.5, end[1] - up)), fill=LINK))
        if abs(link.offset) > 5e-4:
            words = f"{link.offset:+.2f}".rstrip("0").rstrip(".")
            left = link.sync == "end"  # above the bar then, not beside it
            x, anchor = (here[0] - 6, "end") if left else (here[0] + 6, "start")
            self.marks.add(Text(x, here[1] + ABOVE - 3.5, words, SMALL, LINK, anchor, PAPER))

    def _room(self, link: Link, time: float, top: float, there: Spot | None) -> None:
        """Draw the slack of an order: hatched from the point to its bound, and a line to the other point."""
        x = self.scale.x(time)
        if link.slack is None:
            self._pin(x, top, link)
            return
        colour = TIGHT if link.binds else ROOM
        bound = self.scale.x(time + link.slack if link.kind == "before" else time - link.slack)
        left, right = min(x, bound), max(x, bound)
        y, height = top + 1.5, 8.0
        tip = f"{_words(link)}, binds" if link.binds else f"{_words(link)}, {link.slack:.3f} s left"
        if right - left > 1:
            self.marks.add(Box(left, y, right - left, height, "#f4f1fb", tip=tip))
            self.marks.add(*hatch(left, y, right - left, height, colour))
            words = f"{link.slack:.2f} s"
            wide, middle = width_of(words, SMALL), (left + right) / 2
            if wide < right - left - 12:
                self.marks.add(Box(middle - wide / 2 - 4, y, wide + 8, height, PAPER))
                self.marks.add(Text(middle, y + 7.5, words, SMALL, colour, "middle"))
        # A bracket that opens to where the point may go.
        turn = -4.0 if link.kind == "before" else 4.0
        bracket = ((bound + turn, y), (bound, y), (bound, y + height), (bound + turn, y + height))
        self.marks.add(Path(bracket, colour, 1.6, tip=tip))
        if there is not None and abs(there[1] - top) > 1:
            other, row = there
            down = row > top
            end = (other, row + ABOVE if down else row + ABOVE + BAR)
            self.picture.add(*_dashes((bound, y + height if down else y), end, colour, tip))
            self.marks.add(Box(end[0] - 2, end[1] - 2, 4, 4, colour, radius=2))

    def _pin(self, x: float, top: float, link: Link) -> None:
        """Draw a point that is fixed at a time, or by something outside the picture."""
        y = top + ABOVE - 3
        inside = HELD if link.behaviour is None else PAPER
        triangle = ((x, y), (x - 4, y - 7), (x + 4, y - 7))
        self.marks.add(Path(triangle, HELD, 1.0, fill=inside, tip=_words(link)))
        if link.target is not None:
            self.marks.add(Text(x + 7, y - 1, str(link.target), SMALL, HELD, halo=PAPER))


def _edges(first: Spot, last: Spot) -> tuple[Spot, Spot]:
    if first[1] < last[1]:
        return (first[0], first[1] + ABOVE + BAR + 3), (last[0], last[1] + ABOVE - 3)
    return (first[0], first[1] + ABOVE - 3), (last[0], last[1] + ABOVE + BAR + 3)


def _curve(begin: Spot, end: Spot) -> tuple[Spot, ...]:
    """Return a curve that is upright at both ends."""
    (x0, y0), (x1, y1) = begin, end
    if abs(x0 - x1) < 0.5:
        return (begin, end)
    half = (y1 - y0) / 2
    points = []
    for k in range(BEND + 1):
        t = k / BEND
        a, b, c, d = (1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3
        points.append(
            (a * x0 + b * x0 + c * x1 + d * x1, a * y0 + b * (y0 + half) + c * (y1 - half) + d * y1)
        )
    return tuple(points)


def _dashes(begin: Spot, end: Spot, colour: str, tip: str) -> list[Path]:
    (x0, y0), (x1, y1) = begin, end
    count = max(1, round(math.hypot(x1 - x0, y1 - y0) / 6))
    dx, dy = (x1 - x0) / count, (y1 - y0) / count
    ends = (((x0 + k * dx, y0 + k * dy), (x0 + (k + 0.55) * dx, y0 + (k + 0.55) * dy)) for k in range(count))
    return [Path(points, colour, 1.1, tip=tip) for points in ends]


def _words(link: Link) -> str:
    offset = "" if not link.offset else f" {'-' if link.offset < 0 else '+'} {abs(link.offset):g} s"
    target = f"{link.target}{offset}" if link.target else f"{link.offset:g} s"
    sign = {"before": "not after", "after": "not before"}.get(link.kind, "=")
    where = "" if link.line is None else f" (line {link.line})"
    return f"{link.sync} {sign} {target}{where}"
