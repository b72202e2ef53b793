"""Writers of the files of a face folder: face.toml, mesh.npz and fields.npz."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.basis import pack


def write_head(
    path: Path,
    head: Mapping[str, str],
    parts: Mapping[str, Sequence[int]],
    maps: Mapping[str, Any] | None = None,
) -> None:
    """Write face.toml.

    Args:
        head: name, source, licence and says.
        parts: name -> first vertex, last + 1.
        maps: the table [maps].
    """
    lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in head.items()]
    lines += ["", "[parts]  # first vertex, last + 1"]
    lines += [f"{name} = [{first}, {last}]" for name, (first, last) in parts.items()]
    if maps:
        lines += ["", "[maps]  # metres of 255 steps of relief and folds, and of a texel; regions of folds"]
        lines += [f"{key} = {json.dumps(value)}" for key, value in maps.items()]
    path.write_text("\n".join(lines) + "\n", "utf-8")


def write_mesh(
    path: Path,
    vertices: Float64,
    triangles: Int32,
    colours: Float64,
    occlusion: Float64,
    gloss: Float64,
    more: Mapping[str, Any] | None = None,
) -> None:
    """Write mesh.npz.

    Args:
        vertices: (n, 3) metres; triangles: (m, 3); colours: (n, 3) sRGB 0..255.
        occlusion, gloss: (n,) 0..1.
        more: further arrays, stored unchanged.
    """
    np.savez_compressed(
        path,
        vertices=vertices.astype(np.float32),
        triangles=triangles.astype(np.int32),
        colours=to_bytes(colours),
        occlusion=to_bytes(occlusion * 255),
        gloss=to_bytes(gloss * 255),
        **(more or {}),
    )


def write_fields(
    path: Path,
    rows: Mapping[int, Float64],
    head: Any,
    jaw_pivot: Float64,
    head_pivot: Float64,
    eyes: Sequence[Float64],
    lids: tuple[Any, Any, Any],
) -> None:
    """Write fields.npz.

    Args:
        rows: number of a FAP or a row of the basis -> (n, 3).
        head: (n,) uint8, the share of the head's rotation for each vertex.
        jaw_pivot, head_pivot: (3,) metres; eyes: centres of the left and the right eyeball.
        lids: vertices that slide over the eyeballs, the eyeball's index, and the radius (`rigid.sliding`).
    """
    vertex, eye, radius = lids
    np.savez_compressed(
        path,
        **pack(rows),
        head=head,
        jaw_pivot=jaw_pivot,
        head_pivot=head_pivot,
        eye_centre=np.stack(eyes),
        lid=vertex.astype(np.int32),
        lid_eye=eye.astype(np.int32),
        lid_radius=radius.astype(np.float32),
    )


def to_bytes(values: Any) -> Any:
    """Return values 0..255 as uint8."""
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)
