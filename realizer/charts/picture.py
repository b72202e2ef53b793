"""The chart of blocks: a row a behaviour, time from left to right."""

import math
from collections.abc import Sequence
from dataclasses import replace

from realizer.charts.arrows import Arrows, Place
from realizer.charts.diverging_scale import (
    FAINT,
    GRID,
    HELD,
    INK,
    LINK,
    LOST,
    PAPER,
    RIGID,
    ROOM,
    TIGHT,
    colour_of,
)
from realizer.charts.rows import HEIGHT, NAME, draw_dropped, draw_row, height_of
from realizer.charts.scale import Scale, last_of, scale_of
from realizer.charts.shapes import Box, Path, Picture, Shape, Text, cut_inside, hatch, moved, width_of
from realizer.charts.timeline import BehaviourRow, BlockChart

SIZE = 10.5
TITLE = "length of gaps"
STEPS = 40  # of the colour scale
WIDE = 168.0


def draw_legend(picture: Picture, scale: Scale, top: float, blocks: Sequence[BlockChart]) -> float:
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
        picture.add(*(moved(shape, x, row) for shape in mark))
        picture.add(Text(x + 26, row + 10, words, SIZE, FAINT))
        x += 26 + width_of(words, SIZE) + 22
    return row + (34 if row == y else 22)


# Marks at the corner of a picture.
_RIGID = [Box(0, 0, 20, 12, RIGID, "#4b5563")]
_TIE: list[Shape] = [
    Box(0, 3.5, 5, 5, LINK, radius=2.5),
    Path(((2, 6), (15, 6)), LINK, 1.3),
    Path(((20, 6), (14, 2.5), (14, 9.5)), fill=LINK),
]
_PIN = [Path(((12, 10), (8, 3), (16, 3)), HELD, 1.0, fill=HELD)]
_ROOM = [*hatch(0, 2, 20, 8, ROOM), Path(((16, 2), (20, 2), (20, 10), (16, 10)), ROOM, 1.6)]
_TIGHT = [Path(((14, 2), (18, 2), (18, 10), (14, 10)), TIGHT, 1.6)]
_LOST: list[Shape] = [Box(0, 0, 20, 12, "#f3f4f6", radius=2), *hatch(0, 0, 12, 12, LOST, 6)]


def _marks(blocks: Sequence[BlockChart]) -> list[tuple[Sequence[Shape], str]]:
    lines = [line for block in blocks for line in block.rows]
    links = [link for line in lines for link in line.links]
    marks: list[tuple[Sequence[Shape], str, bool]] = [
        (_RIGID, "cannot give way", any(g.rigid or g.preferred is None for line in lines for g in line.gaps)),
        (_TIE, "follows another point", any(link.slack is None and link.target for link in links)),
        (_PIN, "held at a time", any(link.slack is None and not link.target for link in links)),
        (_ROOM, "room before it binds", any(link.slack is not None and not link.binds for link in links)),
        (_TIGHT, "binds", any(link.binds for link in links)),
        (_LOST, "dropped, and why", any(block.dropped for block in blocks)),
    ]
    return [(mark, words) for mark, words, there in marks if there]


AXIS = 30.0
TALL = 600.0  # a picture that is taller has an axis below too
HEAD = 34.0  # of a block
APART = 18.0  # between blocks
# Element -> what its rows are grouped as, in the order of the groups.
GROUPS = {
    "speech": ("speech", "audiofile"),
    "gaze": ("gaze", "gazeShift"),
    "head": ("head", "headDirectionShift"),
    "face": (
        "face", "faceFacs", "faceLexeme", "faceShift", "facekeyframe", "faps", "fapFile", "timeline", "blink",
    ),
    "mood": ("emotion", "expression", "mood", "idle", "listen"),
    "body": ("gesture", "pointing", "posture", "postureShift", "locomotion"),
}  # fmt: skip
Key = tuple[str, str]  # block, behaviour
QUIET = ("IN_PREP", "LURKING", "IN_EXEC", "DONE")  # states that a chart need not name


def timeline(blocks: Sequence[BlockChart]) -> Picture:
    """Return the picture of blocks that share a clock."""
    scale = scale_of(blocks)
    names = ", ".join(block.block for block in blocks)
    picture = Picture(scale.width, title=f"Timeline of {names or 'nothing'}", paper=PAPER)
    below, bars, above = (Picture(scale.width) for _ in range(3))
    places: dict[Key, Place] = {}
    y = AXIS
    for block in blocks:
        y = _block((picture, bars), scale, block, y, places) + APART
    for block in blocks:
        Arrows(below, above, scale, places).draw(block)
    bottom = y - APART + 4
    picture.shapes[:0] = _grid(scale, bottom)
    for layer in (below, bars, above):
        picture.add(*layer.shapes)
    return replace(picture, height=draw_legend(picture, scale, bottom + (24 if bottom > TALL else 4), blocks))


def _block(
    layers: tuple[Picture, Picture], scale: Scale, block: BlockChart, top: float, places: dict[Key, Place]
) -> float:
    """Draw the ground and the rows of a block into two layers; returns where they end."""
    picture, bars = layers
    start = block.start or 0.0
    y = top + HEAD
    ground = len(picture.shapes)
    tied = _linked_points(block)
    current = ""
    order = [*GROUPS, "other"]
    for group, line in sorted(((_group(r), r) for r in block.rows), key=lambda row: order.index(row[0])):
        if group != current:
            if current:
                picture.add(Path(((8, y), (scale.right, y)), GRID, 1.0))
            picture.add(Text(12, y + 22, group, 10, FAINT))
            current = group
        places[block.block, line.id] = (line, start, y)
        draw_row(bars, scale, line, start, y, frozenset(tied.get(line.id, ())))
        y += HEIGHT
    for dropped in block.dropped:
        height = height_of(dropped, scale)
        draw_dropped(bars, scale, dropped, y, height)
        y += height
    left, right = scale.x(start), scale.x(last_of(block))
    frame: list[Shape] = [Box(8, top + 4, scale.width - 16, 24, "#eef1f6", radius=4)]
    if block.rows:
        frame.append(Box(left, top + HEAD - 2, right - left, HEIGHT * len(block.rows) + 2, "#f8fafc"))
    picture.shapes[ground:ground] = frame
    name = cut_inside(block.block, 14, scale.left - 24)
    bars.add(Text(14, top + 21, name, 14, INK))
    x = scale.left
    for words in _about(block):
        bars.add(Text(x, top + 20.5, words, 11, FAINT))
        x += width_of(words, 11) + 18
    if block.state not in QUIET:
        words = block.state.lower()
        bars.add(Text(scale.right, top + 20.5, words, 11, TIGHT, "end"))
    return y


def _about(block: BlockChart) -> list[str]:
    words = []
    if block.start is None:
        words.append(f"not started: {last_of(block):.2f} s long")
    elif block.rows:
        words.append(f"{block.start:.2f} to {last_of(block):.2f} s")
    if block.character is not None:
        words.append(f"character {block.character}")
    if block.rows:
        words.append(f"{len(block.rows)} behaviour{'s' if len(block.rows) > 1 else ''}")
    if block.cost > 5e-5:
        words.append(f"cost {block.cost:.3g}")
    if block.dropped:
        words.append(f"{len(block.dropped)} dropped")
    return words


def _grid(scale: Scale, bottom: float) -> list[Shape]:
    shapes: list[Shape] = []
    ys = (AXIS - 10, bottom + 14) if bottom > TALL else (AXIS - 10,)
    for time, words in scale.ticks():
        x = scale.x(time)
        shapes.append(Path(((x, AXIS - 4), (x, bottom)), GRID, 1.0))
        shapes += [Text(x, y, words, 10.5, FAINT, "middle") for y in ys]
    shapes += [Text(NAME, y, "seconds", 10.5, FAINT) for y in ys]
    shapes.append(Path(((scale.left, bottom), (scale.right, bottom)), "#c3c8d1", 1.0))
    return shapes


def _linked_points(block: BlockChart) -> dict[str, set[str]]:
    """Return behaviour -> its points that take part in a link."""
    tied: dict[str, set[str]] = {}
    for line in block.rows:
        for link in line.links:
            tied.setdefault(line.id, set()).add(link.sync)
            if link.behaviour is not None and link.block is None:
                tied.setdefault(link.behaviour, set()).add(link.other or "")
    return tied


def _group(line: BehaviourRow) -> str:
    return next((group for group, elements in GROUPS.items() if line.element in elements), "other")
