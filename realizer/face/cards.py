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
# Figures of a vertex of cards: how many (0: as many as roots; None: a plain number), their type, and of those
# that are stored as whole numbers what stands for 1.
FIGURES: Mapping[str, tuple[int | None, Any, int]] = {
    "roots": (0, np.int32, 1), "weights": (0, np.float32, 1), "ups": (0, np.float32, 1),
    "uv": (2, np.float32, 65535), "colours": (3, np.uint8, 1),
    "occlusion": (None, np.float32, 255), "gloss": (None, np.float32, 255),
}  # fmt: skip
ARRAYS = {"triangles": 2} | {name: 1 if width is None else 2 for name, (width, *_) in FIGURES.items()}


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
    found = {}
    for name, (width, kind, most) in FIGURES.items():
        shape = (count,) if width is None else (count, width or each)
        if arrays[name].shape != shape or not np.isfinite(arrays[name]).all():
            raise FaceError(f"{path}: {name}: wanted finite numbers {shape}, got {arrays[name].shape}")
        found[name] = arrays[name].astype(kind) / kind(most) if most > 1 else arrays[name].astype(kind)
    parts = {name: (int(a), int(b)) for name, (a, b) in head.get("cards", {}).items()}
    return Cards(triangles=arrays["triangles"].astype(np.int32), parts=parts, **found)
