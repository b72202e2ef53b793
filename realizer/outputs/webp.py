"""The output .webp: an animated picture without sound."""

import io
import math
import struct
from collections.abc import Iterable, Sequence
from contextlib import closing

import numpy as np

from realizer.core.array_types import UInt8
from realizer.outputs.output import Output, RenderSettings
from realizer.realization import Realization

PACE = 25  # pictures a second at most
QUALITY, METHOD = 75, 4  # 160 kB a second at 512x512
MOST = 2**24 - 1  # the greatest number of three bytes
ANIMATED, REPLACES = 0x02, 0x02  # flags: of the file; of a picture that replaces the one before


def encode_webp(pictures: Iterable[UInt8], starts: Sequence[float], end: float) -> bytes:
    """Encode an animation that repeats for ever.

    Pictures are encoded one by one, so that only one is in memory.

    Args:
        pictures: (h, w, 3) uint8, all of one size.
        starts: seconds at which each is shown; in order, from 0.
        end: seconds at which the last one ends.

    Source: RFC 9649, WebP image format, 2.7.
    """
    from PIL import Image

    stamps = [round(1000 * time) for time in (*starts, end)]
    parts, size = [], (0, 0)
    for picture, start, after in zip(pictures, stamps, stamps[1:], strict=False):
        buffer = io.BytesIO()
        image = Image.fromarray(np.ascontiguousarray(picture))
        image.save(buffer, "WEBP", quality=QUALITY, method=METHOD)
        size = image.size
        head = b"\0\0\0" * 2 + _three(size[0] - 1) + _three(size[1] - 1) + _three(after - start)
        # Without the file header of 12 bytes.
        parts.append(_chunk(b"ANMF", head + bytes([REPLACES]) + buffer.getvalue()[12:]))
    look = struct.pack("<B3x", ANIMATED) + _three(size[0] - 1) + _three(size[1] - 1)
    body = b"WEBP" + _chunk(b"VP8X", look) + _chunk(b"ANIM", b"\xff\xff\xff\xff\0\0") + b"".join(parts)
    return b"RIFF" + struct.pack("<I", len(body)) + body


def _encode(realization: Realization, drawing: RenderSettings) -> bytes:
    """Encode every frame, or every second, third, ... for at most 25 pictures a second."""
    step = math.ceil(realization.fps / PACE)
    frames = range(0, realization.frames, step)
    starts = [frame / realization.fps for frame in frames]
    with closing(drawing.pictures(realization, drawing.size, frames)) as pictures:
        return encode_webp(pictures, starts, starts[-1] + step / realization.fps)


def _three(number: int) -> bytes:
    return min(max(number, 0), MOST).to_bytes(3, "little")


def _chunk(name: bytes, content: bytes) -> bytes:
    return name + struct.pack("<I", len(content)) + content + b"\0" * (len(content) % 2)


WEBP = Output(
    ".webp",
    "image/webp",
    "animated picture without sound",
    _encode,
    ("render",),
    lambda drawing: (drawing.size, False),
)
