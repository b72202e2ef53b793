"""The maps of a face as texels that the renderer reads: decoded, interleaved, in levels; its normal map."""

import io
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, Int32, UInt8
from realizer.core.errors import FaceError
from realizer.face.maps import Maps

# Channels of a texel: sRGB, alpha; slope of the relief; occlusion, roughness, thickness; slope of the folds,
# and how deep they are: 255 is half of `Maps.relief` below the skin.
RED, GREEN, BLUE, ALPHA, SLOPE_U, SLOPE_V, OCCLUSION, ROUGHNESS, THICKNESS, FOLD_U, FOLD_V, FOLD = range(12)
CHANNELS = 12  # a texel begins at a multiple of four bytes
# Channels in each texture of surface.glsl.
TEXTURES = {
    "albedoMap": tuple(range(RED, ALPHA + 1)),
    "slopeMap": (SLOPE_U, SLOPE_V, FOLD_U, FOLD_V),
    "surfaceMap": tuple(range(OCCLUSION, THICKNESS + 1)),
    "foldMap": (FOLD,),
}
LEVEL = np.array([255, 255, 255, 255, 128, 128, 255, 255, 255, 128, 128, 0], np.uint8)
STEEPEST = 1.0  # slope at byte 255, metres per metre; 128 is level
FOLD_SHADE = 0.65  # share of the light that a fold hides whose depth is 255
BAND = 64  # rows halved at once, so that memory stays small
IRIS = (0.8125, 0.9375, 0.03125)  # place of the middle of the iris in the maps, and its radius
DEPTH = 0.003  # metres behind the cornea of a point of an iris whose thickness is 0
FULL = 2048  # texels of a side, of the maps that `Maps.texel` is given for


@dataclass(frozen=True, eq=False)
class Texels:
    """Texels of all levels, one after the other.

    Attributes:
        values: (n, CHANNELS) uint8, the rows of each level from the top.
        levels: (k, 3) int32, first texel, width and height of each level; each is half as large as the last.
    """

    values: UInt8
    levels: Int32

    def level(self, number: int) -> UInt8:
        """Return a level as a picture (h, w, CHANNELS)."""
        first, width, height = (int(n) for n in self.levels[number])
        return self.values[first : first + width * height].reshape(height, width, CHANNELS)


def texels_of(maps: Maps | None, largest: int = FULL) -> Texels:
    """Return the texels of maps; those of a face without maps change nothing.

    Args:
        largest: texels of a side that are enough for the picture.

    Raises:
        FaceError: a map is no picture, or not of the size of the albedo map.
    """
    if maps is None:
        return _with_levels(np.broadcast_to(LEVEL, (1, 1, CHANNELS)))
    albedo = _decoded(maps, "albedo", "RGBA")
    height, width = albedo.shape[:2]
    whole = np.empty((height, width, CHANNELS), np.uint8)
    whole[:] = LEVEL
    whole[..., : ALPHA + 1] = albedo
    for name, first in (("relief", SLOPE_U), ("normal", SLOPE_U), ("folds", FOLD_U)):
        if name in maps.files:
            whole[..., first : first + 2] = slopes_in(maps, name, (width, height))
    if "folds" in maps.files:
        heights = _decoded(maps, "folds", "L", (width, height))
        whole[..., FOLD] = np.rint((128 - np.minimum(heights, np.float32(128))) * (255 / 128))
    if "surface" in maps.files:
        whole[..., OCCLUSION : THICKNESS + 1] = _decoded(maps, "surface", "RGB", (width, height))
    while max(whole.shape[:2]) > largest:
        whole = _halved(whole)
    return _with_levels(whole)


def slopes_in(maps: Maps, name: str, size: tuple[int, int] | None = None) -> UInt8:
    """Return the slopes (h, w, 2) to the right and down that "relief", "normal" or "folds" has.

    Args:
        size: width and height of the result; None: those of the map.

    Raises:
        FaceError: the map is no picture.
    """
    if name == "normal":
        return _tilts(_decoded(maps, name, "RGB", size))
    heights = _decoded(maps, name, "L", size)
    return _slopes(heights, maps.relief / 255 / (maps.texel * FULL / heights.shape[1]))


def _decoded(maps: Maps, name: str, mode: str, size: tuple[int, int] | None = None) -> UInt8:
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(io.BytesIO(maps.files[name])) as picture:
            pixels = picture.convert(mode)
    except (OSError, UnidentifiedImageError, Image.DecompressionBombError) as error:
        raise FaceError(f"{name}.webp: wanted a picture, got: {error}; build the face again") from None
    if size is not None and pixels.size != size:
        pixels = pixels.resize(size, Image.Resampling.BILINEAR)
    return np.asarray(pixels)


def _slopes(heights: UInt8, rise: float) -> UInt8:
    """Return the slopes (h, w, 2) to the right and down of heights (h, w); `rise` is a step over a texel."""
    scale = np.float32(rise / 2 / STEEPEST * 127)
    out = np.full((*heights.shape, 2), 128, np.float32)
    high = heights.astype(np.float32)
    out[:, 1:-1, 0] += (high[:, 2:] - high[:, :-2]) * scale
    out[1:-1, :, 1] += (high[2:] - high[:-2]) * scale
    return _bytes(out)


def _tilts(normals: UInt8) -> UInt8:
    """Return slopes (h, w, 2) to the right and down, of a normal map (h, w, 3)."""
    x, y, z = np.moveaxis(normals.astype(np.float32) / np.float32(127.5) - 1, 2, 0)
    slopes = np.stack([-x, y], axis=2) / np.maximum(z, 0.1)[..., None]
    return _bytes(128 + slopes / STEEPEST * 127)


def _bytes(values: Float32) -> UInt8:
    out: UInt8 = np.rint(values).clip(1, 255).astype(np.uint8)
    return out


def _halved(picture: Any) -> UInt8:
    """Return a picture of half the size: the mean of each four texels, colours weighed by their alpha."""
    height, width = (max(n // 2, 1) for n in picture.shape[:2])
    out = np.empty((height, width, CHANNELS), np.uint8)
    for top in range(0, height, BAND):
        band = picture[2 * top : 2 * min(top + BAND, height), : 2 * width]
        four = [band[y::2, x::2].astype(np.uint16) for y, x in np.ndindex(*np.minimum(band.shape[:2], 2))]
        mean = out[top : top + BAND]
        mean[:] = (sum(four) + len(four) // 2) // len(four)
        cover = [part[..., ALPHA : ALPHA + 1].astype(np.float32) for part in four]
        total = sum(cover)
        if total.min() < 255 * len(four):
            seen = (total > 0)[..., 0]
            mixed = sum(part[..., :ALPHA] * share for part, share in zip(four, cover, strict=True))
            mean[..., :ALPHA][seen] = np.rint(mixed[seen] / total[seen])
    return out


def _with_levels(picture: Any) -> Texels:
    pictures = [np.ascontiguousarray(picture)]
    while max(pictures[-1].shape[:2]) > 1:
        pictures.append(_halved(pictures[-1]))
    firsts = np.cumsum([0, *(p.shape[0] * p.shape[1] for p in pictures[:-1])])
    levels = [[first, p.shape[1], p.shape[0]] for first, p in zip(firsts, pictures, strict=True)]
    return Texels(np.concatenate([p.reshape(-1, CHANNELS) for p in pictures]), np.array(levels, np.int32))


LARGEST = 1024  # texels of a side: without loss, a map of 2048 has as many bytes as all other maps together


def normal_map(maps: Maps) -> bytes | None:
    """Return a normal map (x to the right, y up) as WebP; None if a face has no relief.

    Raises:
        FaceError: a map is no picture.
    """
    from PIL import Image

    if "normal" in maps.files or "relief" not in maps.files:
        return maps.files.get("normal")
    slopes = slopes_in(maps, "relief")
    while max(slopes.shape) > LARGEST:
        height, width = (n // 2 for n in slopes.shape[:2])
        four = slopes[: 2 * height, : 2 * width].reshape(height, 2, width, 2, 2)
        slopes = ((four.sum(axis=(1, 3), dtype=np.uint16) + 2) // 4).astype(np.uint8)
    stream = io.BytesIO()
    picture = Image.fromarray(normals_of(slopes))
    picture.save(stream, "webp", lossless=True, method=0, quality=20)  # twenty times as fast as with 5 % less
    return stream.getvalue()


def normals_of(slopes: UInt8) -> UInt8:
    """Return the normals (h, w, 3) of slopes (h, w, 2), as `slopes_in` gives them."""
    return _normals()[slopes[..., 0], slopes[..., 1]]


@cache
def _normals() -> UInt8:
    """Return the normal (256, 256, 3) of each slope to the right and down."""
    right, down = np.meshgrid(*2 * [(np.arange(256) - 128) * (STEEPEST / 127)], indexing="ij")
    normals = np.stack([-right, down, np.ones_like(right)], axis=2)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    return np.rint(127.5 + 127.5 * normals).astype(np.uint8)
