"""Cards: strips with pictures of hairs that follow the mesh of a face."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, Int32, UInt8
from realizer.core.errors import FaceError
from realizer.face.reading import read_arrays

FILE = "cards.npz"
ARRAYS = {
    "roots": 2, "weights": 2, "ups": 2, "triangles": 2, "uv": 2, "colours": 2, "occlusion": 1, "gloss": 1,
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Cards:
    """Strips with pictures of hairs: hair, brows, lashes."""

    roots: Int32  # (c, k) int32 vertices of the mesh that each vertex of a card follows
    weights: Float32  # (c, k) float32, place = weights @ vertices at the roots; a row sums to 1
    ups: Float32  # (c, k) float32, normal = ups @ normals at the roots, at length 1
    triangles: Int32  # (t, 3) int32 of the cards' vertices; they are seen from both sides
    uv: Float32  # (c, 2) float32 in the face's maps; v runs along the hairs
    colours: UInt8  # (c, 3) uint8 sRGB
    occlusion: Float32  # (c,) float32 0..1, as of a face
    gloss: Float32  # (c,) float32 0..1, as of a face
    parts: Mapping[str, tuple[int, int]]  # name -> (first, last + 1) vertex of the cards: hair, brows, lashes


def read_cards(folder: Path, head: Mapping[str, Any], vertices: int) -> Cards | None:
    """Return the cards in a face folder, or None if it has none.

    Args:
        head: the content of face.toml; its [cards] has the parts.
        vertices: how many the mesh has.

    Raises:
        FaceError: cards.npz is damaged, or does not fit the mesh.
    """
    path = folder / FILE
    if not path.is_file():
        return None
    arrays = read_arrays(path, ARRAYS)
    count = len(arrays["roots"])
    for name, most in (("roots", vertices), ("triangles", count)):
        indices = arrays[name]
        if len(indices) and not 0 <= indices.min() <= indices.max() < most:
            raise FaceError(
                f"{path}: {name}: wanted indices 0..{most - 1}, got {indices.min()}..{indices.max()}"
            )
    each = arrays["roots"].shape[1]
    widths = {
        "roots": each,
        "weights": each,
        "ups": each,
        "uv": 2,
        "colours": 3,
        "occlusion": None,
        "gloss": None,
    }
    for name, width in widths.items():
        shape = (count, width) if width else (count,)
        if arrays[name].shape != shape or not np.isfinite(arrays[name]).all():
            raise FaceError(f"{path}: {name}: wanted finite numbers {shape}, got {arrays[name].shape}")
    return Cards(
        roots=arrays["roots"].astype(np.int32),
        weights=arrays["weights"].astype(np.float32),
        ups=arrays["ups"].astype(np.float32),
        triangles=arrays["triangles"].astype(np.int32),
        uv=arrays["uv"].astype(np.float32) / np.float32(65535),
        colours=arrays["colours"].astype(np.uint8),
        occlusion=arrays["occlusion"].astype(np.float32) / np.float32(255),
        gloss=arrays["gloss"].astype(np.float32) / np.float32(255),
        parts={name: (int(a), int(b)) for name, (a, b) in head.get("cards", {}).items()},
    )
