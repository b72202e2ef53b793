"""Contact sheets of pictures with captions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from realizer.core.array_types import UInt8

if TYPE_CHECKING:
    from PIL import Image, ImageDraw, ImageFont

    Font = ImageFont.FreeTypeFont | ImageFont.ImageFont

PAPER, INK, FAINT = (24, 26, 29), (235, 236, 238), (150, 156, 163)
GAP = 6  # pixels between pictures
ALBUM_WIDTH = 2700  # pixels, approximately
MAX_LINES = 4  # of notes


@dataclass(frozen=True, eq=False)
class Cell:
    """Pictures of one size beside each other, with a title and small notes below."""

    pictures: Sequence[UInt8]
    title: str
    notes: Sequence[str] = ()


@dataclass(frozen=True, eq=False)
class Group:
    """Cells under a heading; `columns` is the number of columns if they layout a table."""

    heading: str
    cells: Sequence[Cell]
    columns: int | None = None


def sheet(
    pictures: Sequence[UInt8],
    titles: Sequence[str],
    notes: Sequence[Sequence[str]] | None = None,
    columns: int | None = None,
) -> UInt8:
    """Return a picture (h, w, 3) uint8 with all pictures in rows, each above its title and its notes.

    Args:
        pictures: (h, w, 3) uint8 each, all of one size; at least one.
        titles: a short line each, such as a time or the name of a FAP.
        notes: lines for each picture, such as sync points. Long lines are cut; "+2" means two more lines.
        columns: None makes the sheet about one and a half times as wide as it is high.

    Raises:
        ValueError: no pictures.
    """
    notes = notes if notes is not None else [()] * len(pictures)
    cells = [Cell((p,), title, lines) for p, title, lines in zip(pictures, titles, notes, strict=True)]
    layout = _CellLayout(cells)
    columns = columns or min(
        len(cells), max(1, round((1.5 * len(cells) * layout.height / layout.width) ** 0.5))
    )
    return _page([Group("", cells, columns)], layout, columns, None)


def album(groups: Sequence[Group], legend: UInt8 | None = None, caption: str = "") -> UInt8:
    """Return a picture (h, w, 3) uint8 with the heading and the cells of each group, in rows.

    Args:
        groups: at least one cell; all cells have the same number of pictures, of one size.
        legend: (h, w, 3) picture at the top right, beside `caption`.
        caption: the description of the sheet, in the line at the top.

    Raises:
        ValueError: no cells.
    """
    layout = _CellLayout([cell for group in groups for cell in group.cells])
    columns = max(2, 2 * round(ALBUM_WIDTH / (layout.width + GAP) / 2))
    used = max(min(group.columns or columns, len(group.cells)) for group in groups)
    return _page(groups, layout, min(columns, max(2, used)), (caption, legend))


class _CellLayout:
    """The size of all cells, and their fonts."""

    def __init__(self, cells: Sequence[Cell]) -> None:
        if not cells:
            raise ValueError("pictures: wanted at least one, got none")
        self.picture = cells[0].pictures[0].shape[:2]
        height, width = self.picture
        self.width = len(cells[0].pictures) * width
        self.small, self.large = max(9, width // 20), max(11, width // 16)
        if len(cells[0].pictures) > 1:  # room for a larger font
            self.small, self.large = max(10, width // 15), max(12, width // 12)
        self.lines = min(MAX_LINES, max(len(cell.notes) for cell in cells))
        self.height = height + int(self.large * 1.5) + int(self.lines * self.small * 1.3) + GAP
        self.title, self.note = _font(self.large), _font(self.small)

    def draw(self, image: Image.Image, pen: ImageDraw.ImageDraw, cell: Cell, x: int, y: int) -> None:
        from PIL import Image

        height, width = self.picture
        for k, picture in enumerate(cell.pictures):
            image.paste(Image.fromarray(np.ascontiguousarray(picture)), (x + k * width, y))
        y += height + 2
        pen.text((x + 2, y), _cut(cell.title, self.title, self.width), INK, self.title)
        y += int(self.large * 1.5)
        notes, more = cell.notes[: self.lines], len(cell.notes) - self.lines
        if more > 0:
            notes = [*notes[:-1], f"{notes[-1]} +{more}"]
        for line in notes:
            pen.text((x + 2, y), _cut(line, self.note, self.width), FAINT, self.note)
            y += int(self.small * 1.3)


def _page(
    groups: Sequence[Group], layout: _CellLayout, columns: int, top: tuple[str, UInt8 | None] | None
) -> UInt8:
    from PIL import Image, ImageDraw

    heading = _font(int(layout.large * 1.5))
    heading_height = int(layout.large * 2.6)
    step = (layout.width + GAP, layout.height + GAP)
    width = columns * step[0] + GAP
    places: list[tuple[Cell, int, int]] = []
    heads: list[tuple[str, int]] = []
    y = GAP + (heading_height if top else 0)
    for group in groups:
        if group.heading:
            heads.append((group.heading, y))
            y += heading_height
        across = min(group.columns or columns, columns)
        for k, cell in enumerate(group.cells):
            places.append((cell, GAP + k % across * step[0], y + k // across * step[1]))
        y += -(-len(group.cells) // across) * step[1]
    image = Image.new("RGB", (width, y), PAPER)
    pen = ImageDraw.Draw(image)
    if top:
        words, legend = top
        if legend is not None:
            image.paste(Image.fromarray(legend), (width - GAP - legend.shape[1], GAP))
        available = width - 4 * GAP - (0 if legend is None else legend.shape[1])
        pen.text((GAP + 2, GAP), _cut(words, heading, available), INK, heading)
    for words, at in heads:
        pen.line((GAP, at + 2, width - GAP, at + 2), FAINT)
        pen.text((GAP + 2, at + layout.large // 2), _cut(words, heading, width - 2 * GAP), INK, heading)
    for cell, x, at in places:
        layout.draw(image, pen, cell, x, at)
    return np.asarray(image)


def _font(size: int) -> Font:
    from PIL import ImageFont

    # Pillow's own font gives the same bytes on all machines.
    return ImageFont.load_default(size)


def _cut(text: str, font: Font, width: int) -> str:
    if font.getlength(text) <= width:
        return text
    while text and font.getlength(text + "...") > width:
        text = text[:-1]
    return text + "..."
