"""Normal maps in tangent space, as other programs read them, of the relief and the folds of a face."""

from __future__ import annotations

import io
from functools import cache

import numpy as np

from realizer.core.array_types import UInt8
from realizer.face.maps import Maps
from realizer.render.textures import STEEPEST, slopes_in


def normal_maps(maps: Maps) -> dict[str, bytes]:
    """Return the normal maps (x to the right, y up) "normal" and "folds", those that there are, as WebPs.

    Raises:
        FaceError: a map is no picture.
    """
    sources = {"normal": "relief", "folds": "folds"}
    made = {name: _webp(maps, source) for name, source in sources.items() if source in maps.files}
    return made | {name: file for name, file in maps.files.items() if name == "normal"}


@cache
def _table() -> UInt8:
    """Return the normal (256, 256, 3) of each slope to the right and down."""
    right, down = np.meshgrid(*2 * [(np.arange(256) - 128) * (STEEPEST / 127)], indexing="ij")
    normals = np.stack([-right, down, np.ones_like(right)], axis=2)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    return np.rint(127.5 + 127.5 * normals).astype(np.uint8)


def _webp(maps: Maps, source: str) -> bytes:
    from PIL import Image

    slopes, stream = slopes_in(maps, source), io.BytesIO()
    # The least effort: a map of 2048 x 2048 takes 0.2 s, and 5 % more bytes than with the most.
    picture = Image.fromarray(_table()[slopes[..., 0], slopes[..., 1]])
    picture.save(stream, "webp", lossless=True, method=0, quality=20)
    return stream.getvalue()
