"""glTF meshes of a face's parts: rigid, or with morph targets and joints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from realizer.core.array_types import Bool, Float32
from realizer.core.colours import linear
from realizer.face.glb_file import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, GlbFile
from realizer.face.surface import normals

if TYPE_CHECKING:
    from realizer.face.model import Face
    from realizer.outputs.morph_targets import MorphTargets

BENT = 0.01  # what a target turns a normal less, nobody sees: half a degree


def rigid_mesh(
    file: GlbFile, face: Face, mine: Bool, name: str, material: int, centre: Float32 | float = 0.0
) -> dict[str, Any]:
    """The mesh at rest.

    Args:
        mine: (n_vertices,) which of them; triangles that have others too are left out.
        centre: (3,) metres, what becomes the mesh's origin.
    """
    # Colours have the baked occlusion in them, for no viewer takes it by the vertex.
    colours = np.full((mine.sum(), 4), 65535, np.uint16)
    colours[:, :3] = np.rint(linear(face.colours[mine]) * face.occlusion[mine, None] * 65535)
    triangles = face.triangles[mine[face.triangles].all(axis=1)]
    numbers = np.cumsum(mine) - 1
    primitive = {
        "attributes": {
            "POSITION": file.add(face.vertices[mine] - np.float32(centre), target=ARRAY_BUFFER, bounds=True),
            "NORMAL": file.add(_ups(face, face.vertices)[mine], target=ARRAY_BUFFER),
            "COLOR_0": file.add(colours, target=ARRAY_BUFFER, normalised=True),
        },
        "indices": file.add(numbers[triangles].astype(np.uint32).ravel(), target=ELEMENT_ARRAY_BUFFER),
        "material": material,
    }
    return {"name": name, "primitives": [primitive]}


def morphing_mesh(file: GlbFile, face: Face, mine: Bool, material: int, made: MorphTargets) -> dict[str, Any]:
    """The same with the targets, by their names, and two joints: 0 stays, 1 is the head."""
    mesh = rigid_mesh(file, face, mine, face.name, material)
    (primitive,) = mesh["primitives"]
    shares = np.zeros((mine.sum(), 4), np.float32)
    shares[:, 1] = face.basis["head"][mine, 0]
    shares[:, 0] = 1 - shares[:, 1]
    # Where there is no share, the number of the joint is to be 0.
    joints = (shares > 0) * np.array([0, 1, 0, 0], np.uint8)
    primitive["attributes"]["JOINTS_0"] = file.add(joints, target=ARRAY_BUFFER)
    primitive["attributes"]["WEIGHTS_0"] = file.add(shares, target=ARRAY_BUFFER)
    if made.names:
        ups = _ups(face, face.vertices)
        primitive["targets"] = [_target(file, face, mine, moves, ups) for moves in made.moves]
        mesh["weights"] = [0.0] * len(made.names)
        # Where all who read glTF look for the names of targets.
        mesh["extras"] = {"targetNames": list(made.names)}
    return mesh


def _target(file: GlbFile, face: Face, mine: Bool, moves: Float32, ups: Float32) -> dict[str, int]:
    bent = _ups(face, face.vertices + moves) - ups
    bent[np.abs(bent).max(axis=1) < BENT] = 0
    return {
        "POSITION": file.add_sparse(moves[mine], bounds=True),
        "NORMAL": file.add_sparse(bent[mine]),
    }


def _ups(face: Face, vertices: Float32) -> Float32:
    """Normals; a vertex without a triangle gets one that points forward: glTF wants unit length."""
    ups: Float32 = normals(face, vertices[None])[0]
    ups[np.abs(ups).sum(axis=1) == 0] = (0, 0, 1)
    return ups
