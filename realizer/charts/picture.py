"""The chart of blocks: a row a behaviour, time from left to right."""

from collections.abc import Sequence
from dataclasses import replace

from realizer.charts import legend
from realizer.charts.arrows import draw_links
from realizer.charts.diverging_scale import FAINT, GRID, INK, PAPER, TIGHT
from realizer.charts.rows import HEIGHT, NAME, draw_dropped, draw_row, height_of
from realizer.charts.scale import Scale, last_of, scale_of
from realizer.charts.shapes import Box, Path, Picture, Shape, Text, cut_inside, width_of
from realizer.charts.timeline import BehaviourRow, BlockChart

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
QUIET = ("IN_PREP", "LURKING", "IN_EXEC", "DONE")  # states that a chart need not name


def timeline(blocks: Sequence[BlockChart]) -> Picture:
    """Return the picture of blocks that share a clock."""
    scale = scale_of(blocks)
    names = ", ".join(block.block for block in blocks)
    picture = Picture(scale.width, title=f"Timeline of {names or 'nothing'}", paper=PAPER)
    below, bars, above = (Picture(scale.width) for _ in range(3))
    places: dict[tuple[str, str], tuple[BehaviourRow, float, float]] = {}
    y = AXIS
    for block in blocks:
        y = _block(picture, bars, scale, block, y, places) + APART
    for block in blocks:
        draw_links(below, above, scale, block, places)
    bottom = y - APART + 4
    picture.shapes[:0] = _grid(scale, bottom)
    for layer in (below, bars, above):
        picture.add(*layer.shapes)
    return replace(picture, height=legend.draw(picture, scale, bottom + (24 if bottom > TALL else 4), blocks))


def _block(
    picture: Picture,
    bars: Picture,
    scale: Scale,
    block: BlockChart,
    top: float,
    places: dict[tuple[str, str], tuple[BehaviourRow, float, float]],
) -> float:
    """Draw the ground and the rows of a block; returns where they end."""
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
