"""The maps of a face: pictures that give its surface colour, relief and other values at each texel."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Bool, Float32
from realizer.core.errors import FaceError

NAMES = ("albedo", "relief", "normal", "surface", "folds")
SCALE = {"relief": 0.0, "texel": 1.0}  # defaults of [maps] in face.toml


@dataclass(frozen=True, eq=False)
class Maps:
    """The maps of a face as encoded pictures, and where its triangles are in them."""

    # name -> the bytes of a WebP:
    #     albedo, always there: RGBA, sRGB; multiplied with the colours of vertices.
    #     relief: grey, height; 128 is level. normal: the same as a normal map in tangent space, +y up.
    #     surface: RGB: occlusion of small cavities, roughness, thickness (0 lets light through).
    #     folds: grey, height of the wrinkles of expressions.
    files: Mapping[str, bytes]
    # (m, 3, 2) float32, place of each corner of each triangle in the maps, (0, 0) at the top left.
    uv: Float32
    relief: float  # metres that 255 steps of relief and folds are high
    texel: float  # metres that a texel of a map of 2048 is wide
    see_through: Bool  # (m,) triangles into which the alpha of the albedo map cuts holes
    folds: Float32  # (n, r) float32 0..1, how much of each region's folds shows at each vertex
    # (r,) their names: a drive of `realizer/tables/wrinkles.toml`, and _left or _right.
    regions: tuple[str, ...] = ()


def read_maps(folder: Path, head: Mapping[str, Any], mesh: Mapping[str, Any]) -> Maps | None:
    """Return the maps in a face folder, or None if it has none.

    Args:
        head: the content of face.toml; its [maps] has `SCALE`.
        mesh: the arrays of mesh.npz: `uv` (m, 3, 2) uint16, and maybe `see_through` (m,), `fold_weights`
            (n, r) uint8.

    Raises:
        FaceError: [maps] or an array is damaged, or a map is missing.
    """
    files = {name: path.read_bytes() for name in NAMES if (path := folder / f"{name}.webp").is_file()}
    if "uv" not in mesh and not files:
        return None
    if "albedo" not in files:
        raise FaceError(f"{folder / 'albedo.webp'}: wanted this map, found none; build the face again")
    table = {**SCALE, **head.get("maps", {})}
    for key in SCALE:
        if not isinstance(table[key], int | float) or not 0 <= table[key] <= 1:
            raise FaceError(f"{folder / 'face.toml'}: [maps] {key}: wanted metres, got {table[key]!r}")
    regions = head.get("maps", {}).get("folds", [])
    if not isinstance(regions, list) or not all(isinstance(name, str) and "_" in name for name in regions):
        raise FaceError(
            f"{folder / 'face.toml'}: [maps] folds: wanted names such as frown_left, got {regions!r}"
        )
    count, vertices = len(mesh["triangles"]), len(mesh["vertices"])
    uv = _array(folder, mesh, "uv", np.zeros(0), (count, 3, 2))
    holes = _array(folder, mesh, "see_through", np.zeros(count, bool), (count,))
    folds = _array(folder, mesh, "fold_weights", np.zeros((vertices, 0)), (vertices, len(regions)))
    return Maps(
        files, uv.astype(np.float32) / np.float32(65535), table["relief"], table["texel"],
        holes.astype(bool), folds.astype(np.float32) / np.float32(255), tuple(regions),
    )  # fmt: skip


def _array(folder: Path, mesh: Mapping[str, Any], name: str, default: Any, shape: tuple[int, ...]) -> Any:
    found = mesh.get(name, default)
    if found.shape != shape:
        raise FaceError(f"{folder / 'mesh.npz'}: {name}: wanted {shape}, got {found.shape}; build it again")
    return found
