"""Pictures and captions in, one contact sheet out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from realizer.arrays import UInt8

if TYPE_CHECKING:
    from PIL import ImageFont

__all__ = ["sheet"]

PAPER, INK, FAINT = (24, 26, 29), (235, 236, 238), (150, 156, 163)
GAP = 6  # pixels between pictures


def sheet(
    pictures: Sequence[UInt8],
    titles: Sequence[str],
    notes: Sequence[Sequence[str]] | None = None,
    columns: int | None = None,
) -> UInt8:
    """(h, w, 3) uint8: the pictures in rows, a title under each, and its notes in small lines.

    Args:
        pictures: (h, w, 3) uint8 each, all of one size; at least one.
        titles: a short line each, such as a time or the name of a FAP.
        notes: lines each, such as sync points; cut to the picture's width. A line too many becomes "+2".
        columns: None makes the sheet about as wide as it is high, half as much again.

    Raises:
        ValueError: no pictures.
    """
    from PIL import Image, ImageDraw

    if not len(pictures):
        raise ValueError("pictures: wanted at least one, got none")
    height, width = pictures[0].shape[:2]
    notes = notes if notes is not None else [()] * len(pictures)
    small, large = max(9, width // 20), max(11, width // 16)
    title_font, note_font = _font(large), _font(small)
    lines = min(4, max((len(n) for n in notes), default=0))
    label = int(large * 1.5) + int(lines * small * 1.3) + GAP
    columns = columns or columns_for(len(pictures), width, height + label)
    rows = -(-len(pictures) // columns)
    cell = (width + GAP, height + label + GAP)
    image = Image.new("RGB", (columns * cell[0] + GAP, rows * cell[1] + GAP), PAPER)
    pen = ImageDraw.Draw(image)
    for k, (picture, title, said) in enumerate(zip(pictures, titles, notes, strict=True)):
        x, y = GAP + k % columns * cell[0], GAP + k // columns * cell[1]
        image.paste(Image.fromarray(np.ascontiguousarray(picture)), (x, y))
        y += height + 2
        pen.text((x + 2, y), _cut(title, title_font, width), INK, title_font)
        y += int(large * 1.5)
        for line in _fold(said, lines):
            pen.text((x + 2, y), _cut(line, note_font, width), FAINT, note_font)
            y += int(small * 1.3)
    return np.asarray(image)


def columns_for(count: int, width: int, height: int) -> int:
    """Columns that make the whole about 3:2."""
    best: float = (1.5 * count * height / width) ** 0.5
    return min(count, max(1, round(best)))


def _fold(lines: Sequence[str], most: int) -> list[str]:
    if len(lines) <= most:
        return list(lines)
    return [*lines[: most - 1], f"{lines[most - 1]} +{len(lines) - most}"]


def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    from PIL import ImageFont

    return ImageFont.load_default(
        size
    )  # Pillow brings it along: no font of the machine, same bytes everywhere


def _cut(text: str, font: ImageFont.FreeTypeFont | ImageFont.ImageFont, width: int) -> str:
    if font.getlength(text) <= width:
        return text
    while text and font.getlength(text + "...") > width:
        text = text[:-1]
    return text + "..."
