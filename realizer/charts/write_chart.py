"""Writing of charts to files; the suffix selects the format."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from realizer.charts.picture import timeline
from realizer.charts.shapes import FINE, Box, Picture, Text, font
from realizer.charts.shapes import Path as Line
from realizer.charts.svg import svg
from realizer.charts.timeline import BlockChart
from realizer.core.atomic_files import write_bytes
from realizer.core.errors import RealizerError

if TYPE_CHECKING:
    from PIL import Image, ImageDraw


SMOOTH = 2  # oversampling for PNG: Pillow's lines are aliased
# Limit of pixels, because of memory.
MOST = 64_000_000


def png(picture: Picture) -> bytes:
    """Return PNG bytes, twice the picture's size unless that is too large.

    Raises:
        RealizerError: the picture is too large at its own size; as SVG it is not.
    """
    from PIL import Image, ImageDraw

    area = picture.width * picture.height
    fitting = [(s, m) for s, m in ((FINE, SMOOTH), (FINE, 1), (1, 1)) if area * (s * m) ** 2 <= MOST]
    if not fitting:
        raise RealizerError(
            f"wanted a picture of at most {MOST} pixels, got {picture.width:.0f}x{picture.height:.0f}: "
            "draw it as .svg"
        )
    scale, smooth = fitting[0]
    size = (round(picture.width * scale), round(picture.height * scale))
    image: Image.Image = Image.new("RGB", (size[0] * smooth, size[1] * smooth), picture.paper)
    pen = ImageDraw.Draw(image)
    for shape in picture.shapes:
        if not isinstance(shape, Text):
            _draw(pen, shape, scale * smooth)
    if smooth > 1:
        image = image.resize(size, Image.Resampling.BOX)
        pen = ImageDraw.Draw(image)
    for shape in picture.shapes:
        if isinstance(shape, Text):
            _write(pen, shape, scale)
    buffer = io.BytesIO()
    image.save(buffer, "PNG", compress_level=6)
    return buffer.getvalue()


def _draw(pen: ImageDraw.ImageDraw, shape: Box | Line, scale: float) -> None:
    if isinstance(shape, Box):
        box = (
            shape.x * scale,
            shape.y * scale,
            max(shape.x + shape.width, shape.x) * scale - 1,
            (shape.y + shape.height) * scale - 1,
        )
        if box[2] >= box[0] and box[3] >= box[1]:
            pen.rounded_rectangle(box, shape.radius * scale, shape.fill, shape.stroke, round(scale))
        return
    points = [(x * scale, y * scale) for x, y in shape.points]
    if shape.fill:
        pen.polygon(points, fill=shape.fill)
    if shape.colour:
        ring = [*points, points[0]] if shape.fill else points
        pen.line(ring, fill=shape.colour, width=max(1, round(shape.width * scale)), joint="curve")


def _write(pen: ImageDraw.ImageDraw, text: Text, scale: float) -> None:
    anchor = {"start": "ls", "middle": "ms", "end": "rs"}[text.anchor]
    rim = round(1.5 * scale) if text.halo else 0
    pen.text(
        (text.x * scale, text.y * scale),
        text.text,
        fill=text.colour,
        font=font(text.size * scale, text.text.isascii()),
        anchor=anchor,
        stroke_width=rim,
        stroke_fill=text.halo,
    )


Writer = Callable[[Picture], bytes]
WRITERS: Mapping[str, Writer] = {".svg": lambda picture: svg(picture).encode(), ".png": png}


def writer_for(path: str | Path) -> Writer:
    """Return the encoder of a picture.

    Raises:
        ValueError: no or an unknown suffix; the text lists the known ones.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in WRITERS:
        raise ValueError(f"{path}: wanted a suffix of {' '.join(WRITERS)}, got {suffix or 'none'}")
    return WRITERS[suffix]


def write_timeline(blocks: Sequence[BlockChart], path: str | Path) -> None:
    """Write the picture whole or not at all.

    Raises:
        ValueError: as `writer_for`.
        RealizerError: there is too much of it for that kind of picture.
        OSError: it cannot be written there.
    """
    write = writer_for(path)
    write_bytes(path, write(timeline(blocks)))
