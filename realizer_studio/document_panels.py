"""A picture of panels, one below the other: each has a heading, text, curves and another picture."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import cycle

import numpy as np

from realizer.charts.diverging_scale import FAINT, GRID, INK
from realizer.charts.scale import GUTTER, WIDTH, Scale
from realizer.charts.shapes import Box, Path, Picture, Text, cut, moved
from realizer.core.array_types import Float64

LINE = 16.0  # height of a line of text
CURVES = 84.0  # height of the curves
MOST = 8  # lines of a panel; the rest is counted
COLOURS = ("#4657d8", "#c4622d", "#26794b", "#8f3f97", "#b08a00", "#1b7f8c", "#b93224", "#636776")


@dataclass(frozen=True)
class Panel:
    """A part of a picture.

    Attributes:
        about: a line beside the heading.
        lines: with curves, the last ones are their names.
        curves: (n, k) values of n frames, each curve drawn to its own peak; None for none.
        times: (n,) seconds of the frames.
        inset: a picture below the lines.
    """

    heading: str
    about: str
    lines: Sequence[str] = ()
    curves: Float64 | None = None
    times: Float64 | None = None
    inset: Picture | None = None


def panels(title: str, parts: Sequence[Panel], scale: Scale) -> Picture:
    """Return the picture of panels, whose curves share the times of a scale."""
    picture, y = Picture(WIDTH, title=title), 8.0
    for part in parts:
        picture.add(Box(8, y, WIDTH - 16, 24, "#eef1f6", radius=4))
        picture.add(Text(14, y + 17, part.heading, 14, INK), Text(GUTTER, y + 16.5, part.about, 11, FAINT))
        y = _lines(picture, part, y + 24 + LINE)
        if part.curves is not None and part.times is not None:
            y = _curves(picture, part.curves, part.times, scale, y)
        if part.inset is not None:
            picture.add(*(moved(shape, 0.0, y) for shape in part.inset.shapes))
            y += part.inset.height
        y += 10
    return replace(picture, height=y)


def _lines(picture: Picture, part: Panel, y: float) -> float:
    """Write the lines; those that name curves have their colours."""
    named = 0 if part.curves is None else part.curves.shape[1]
    plain, names = part.lines[: len(part.lines) - named], part.lines[len(part.lines) - named :]
    shown = [(line, FAINT if line.startswith(" ") else INK) for line in plain[:MOST]]
    shown += [(f"and {len(plain) - MOST} more", FAINT)] if len(plain) > MOST else []
    shown += list(zip(names, cycle(COLOURS), strict=False))
    for line, colour in shown:
        indent = 12.0 * (line.startswith(" ") + line.startswith("    "))
        picture.add(Text(GUTTER + indent, y, cut(line.strip(), 11, WIDTH - GUTTER - 40), 11, colour))
        y += LINE
    return y


def _curves(picture: Picture, values: Float64, times: Float64, scale: Scale, y: float) -> float:
    base = y + CURVES - 10
    picture.add(Path(((scale.left, base), (scale.right, base)), GRID))
    for curve, colour in zip(values.T, cycle(COLOURS), strict=False):
        heights = (
            curve / max(float(np.abs(curve).max()), 1e-9) * (CURVES - 20) / (2 if curve.min() < 0 else 1)
        )
        zero = base - ((CURVES - 20) / 2 if curve.min() < 0 else 0)
        points = zip(times.tolist(), heights.tolist(), strict=True)
        picture.add(Path(tuple((scale.x(time), zero - height) for time, height in points), colour, 1.4))
    return y + CURVES
