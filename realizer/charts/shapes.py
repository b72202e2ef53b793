"""Shapes of a chart in pixels from the top left corner, and text widths."""

from __future__ import annotations

import unicodedata
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PIL.ImageFont import FreeTypeFont, ImageFont

DOTS = "..."
FINE = 2  # text is measured, and drawn in PNG, with this many pixels for one of the picture


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle, filled or outlined or both; `tip` is shown where one points at it."""

    x: float
    y: float
    width: float
    height: float
    fill: str | None = None
    stroke: str | None = None
    radius: float = 0.0
    tip: str = ""


@dataclass(frozen=True, slots=True)
class Path:
    """A line through points; with `fill` the shape that it closes."""

    points: tuple[tuple[float, float], ...]
    colour: str | None = None
    width: float = 1.0
    fill: str | None = None
    tip: str = ""


@dataclass(frozen=True, slots=True)
class Text:
    """A line of text; `x` is its start, its middle or its end, `y` its baseline.

    Text lies over everything else. `halo` is the colour of a rim that keeps it readable over lines.
    """

    x: float
    y: float
    text: str
    size: float
    colour: str
    anchor: str = "start"
    halo: str | None = None


Shape = Box | Path | Text


@dataclass(slots=True)
class Picture:
    """Shapes, the first at the bottom; `title` describes them."""

    width: float
    height: float = 0.0
    title: str = ""
    paper: str = "#ffffff"
    shapes: list[Shape] = field(default_factory=list)

    def add(self, *shapes: Shape) -> None:
        self.shapes += shapes


def hatch(x: float, y: float, width: float, height: float, colour: str, step: float = 5.0) -> list[Path]:
    """Return lines that rise to the right, inside of a rectangle."""
    lines = []
    at = x - height + step / 2
    while at < x + width:
        left, right = max(at, x), min(at + height, x + width)
        if right > left:
            lines.append(
                Path(((left, y + height - (left - at)), (right, y + height - (right - at))), colour, 0.9)
            )
        at += step
    return lines


def moved(shape: Shape, right: float, down: float) -> Shape:
    """Return a shape at another place."""
    if isinstance(shape, Path):
        return replace(shape, points=tuple((x + right, y + down) for x, y in shape.points))
    return replace(shape, x=shape.x + right, y=shape.y + down)


@cache
def font(size: float, plain: bool = True) -> FreeTypeFont | ImageFont:
    """Return the font that text is drawn and measured with: Pillow's own, the same everywhere.

    Args:
        plain: the text is ASCII. Pillow's font has little else; for the rest one of the machine is taken,
            where there is one.
    """
    from PIL import ImageFont

    if not plain:
        for name in ("DejaVuSans.ttf", "Arial Unicode.ttf", "arial.ttf", "NotoSans-Regular.ttf"):
            try:
                return ImageFont.truetype(name, size)
            except OSError:
                continue
    return ImageFont.load_default(size)


@lru_cache(4096)
def width_of(text: str, size: float) -> float:
    """Return the width of a line of text in pixels; an estimate for characters beyond ASCII."""
    if text.isascii():
        # As PNG draws it: letters stand on whole pixels, which a larger font would not show.
        return float(font(size * FINE).getlength(text)) / FINE
    wide = sum(1.0 if unicodedata.east_asian_width(c) in "WF" else 0.62 for c in text if not c.isascii())
    return wide * size + width_of("".join(c for c in text if c.isascii()), size)


def cut(text: str, size: float, room: float) -> str:
    """Return as much of a text as fits, with dots if some is missing; "" if not even one letter fits."""
    if width_of(text, size) <= room:
        return text
    counts = range(len(text) + 1)
    fits = bisect_right(counts, room, 1, key=lambda count: width_of(text[:count].rstrip() + DOTS, size)) - 1
    return text[:fits].rstrip() + DOTS if fits else ""


def cut_inside(text: str, size: float, room: float) -> str:
    """Return as much of a text as fits like `cut`, but with its end: names differ there."""
    if width_of(text, size) <= room:
        return text
    kept = text[-5:]
    return cut(text[:-5], size, room - width_of(kept, size)) + kept


def fold(text: str, size: float, room: float, most: int) -> Sequence[str]:
    """Return a text in lines of at most `room` pixels, broken at blanks; the last of `most` is cut."""
    words = text.split()
    lines: list[str] = []
    while words and len(lines) < most - 1:
        count = 1
        while count < len(words) and width_of(" ".join(words[: count + 1]), size) <= room:
            count += 1
        lines.append(cut(" ".join(words[:count]), size, room))
        words = words[count:]
    if words:
        lines.append(cut(" ".join(words), size, room))
    return lines
