"""The legend of a chart."""

import math
from collections.abc import Callable, Sequence

from realizer.charts.diverging_scale import FAINT, HELD, LINK, LOST, RIGID, ROOM, TIGHT, colour_of
from realizer.charts.rows import NAME
from realizer.charts.scale import Scale
from realizer.charts.shapes import Box, Path, Picture, Text, hatch, width_of
from realizer.charts.timeline import BlockChart

SIZE = 10.5
TITLE = "length of gaps"
STEPS = 40  # of the colour scale
WIDE = 168.0


def draw(picture: Picture, scale: Scale, top: float, blocks: Sequence[BlockChart]) -> float:
    """Draw the legend; of marks only those that the picture has. Returns where the picture ends."""
    y = top + 14
    x = NAME
    picture.add(Text(x, y + 10, TITLE, SIZE, FAINT))
    x += width_of(TITLE, SIZE) + 14
    for k in range(STEPS):
        stretch = math.exp((2 * (k + 0.5) / STEPS - 1) * math.log(3.0))
        picture.add(Box(x + WIDE * k / STEPS, y, WIDE / STEPS + 0.5, 12, colour_of(stretch)))
    picture.add(Box(x, y, WIDE, 12, None, "#4b5563"))
    for part, words in ((0.0, "33%"), (0.5, "as preferred"), (1.0, "300%")):
        picture.add(Text(x + WIDE * part, y + 24, words, 9.5, FAINT, "middle"))
    x += WIDE + 34
    row = y
    for mark, words in _marks(blocks):
        if x + 30 + width_of(words, SIZE) > scale.right:
            x, row = NAME, row + (38 if row == y else 20)
        mark(picture, x, row)
        picture.add(Text(x + 26, row + 10, words, SIZE, FAINT))
        x += 26 + width_of(words, SIZE) + 22
    return row + (34 if row == y else 22)


Mark = Callable[[Picture, float, float], None]


def _marks(blocks: Sequence[BlockChart]) -> list[tuple[Mark, str]]:
    lines = [line for block in blocks for line in block.rows]
    links = [link for line in lines for link in line.links]
    marks: list[tuple[Mark, str, bool]] = [
        (_rigid, "cannot give way", any(g.rigid or g.preferred is None for line in lines for g in line.gaps)),
        (_tie, "follows another point", any(link.slack is None and link.target for link in links)),
        (_pin, "held at a time", any(link.slack is None and not link.target for link in links)),
        (_room, "room before it binds", any(link.slack is not None and not link.binds for link in links)),
        (_tight, "binds", any(link.binds for link in links)),
        (_lost, "dropped, and why", any(block.dropped for block in blocks)),
    ]
    return [(mark, words) for mark, words, there in marks if there]


def _rigid(picture: Picture, x: float, y: float) -> None:
    picture.add(Box(x, y, 20, 12, RIGID, "#4b5563"))


def _tie(picture: Picture, x: float, y: float) -> None:
    picture.add(Box(x, y + 3.5, 5, 5, LINK, radius=2.5))
    picture.add(Path(((x + 2, y + 6), (x + 15, y + 6)), LINK, 1.3))
    picture.add(Path(((x + 20, y + 6), (x + 14, y + 2.5), (x + 14, y + 9.5)), fill=LINK))


def _pin(picture: Picture, x: float, y: float) -> None:
    picture.add(Path(((x + 12, y + 10), (x + 8, y + 3), (x + 16, y + 3)), HELD, 1.0, fill=HELD))


def _room(picture: Picture, x: float, y: float) -> None:
    picture.add(*hatch(x, y + 2, 20, 8, ROOM))
    picture.add(Path(((x + 16, y + 2), (x + 20, y + 2), (x + 20, y + 10), (x + 16, y + 10)), ROOM, 1.6))


def _tight(picture: Picture, x: float, y: float) -> None:
    picture.add(Path(((x + 14, y + 2), (x + 18, y + 2), (x + 18, y + 10), (x + 14, y + 10)), TIGHT, 1.6))


def _lost(picture: Picture, x: float, y: float) -> None:
    picture.add(Box(x, y, 20, 12, "#f3f4f6", radius=2))
    picture.add(*hatch(x, y, 12, 12, LOST, 6))
