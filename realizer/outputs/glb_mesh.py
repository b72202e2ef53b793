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

NEGLIGIBLE_BEND = 0.01  # smaller changes of a normal, half a degree, are invisible


def rigid_mesh(
    file: GlbFile, face: Face, part: Bool, name: str, material: int, centre: Float32 | float = 0.0
) -> dict[str, Any]:
    """Return the mesh of a part of a face at rest.

    Args:
        part: (n_vertices,) whether a vertex belongs to the part; triangles with other vertices are omitted.
        centre: (3,) metres, the origin of the mesh.
    """
    # Colours include the baked occlusion, because viewers do not support it by vertex.
    colours = np.full((part.sum(), 4), 65535, np.uint16)
    colours[:, :3] = np.rint(linear(face.colours[part]) * face.occlusion[part, None] * 65535)
    triangles = face.triangles[part[face.triangles].all(axis=1)]
    numbers = np.cumsum(part) - 1
    primitive = {
        "attributes": {
            "POSITION": file.add(face.vertices[part] - np.float32(centre), target=ARRAY_BUFFER, bounds=True),
            "NORMAL": file.add(_normals(face, face.vertices)[part], target=ARRAY_BUFFER),
            "COLOR_0": file.add(colours, target=ARRAY_BUFFER, normalised=True),
        },
        "indices": file.add(numbers[triangles].astype(np.uint32).ravel(), target=ELEMENT_ARRAY_BUFFER),
        "material": material,
    }
    return {"name": name, "primitives": [primitive]}


def morphing_mesh(file: GlbFile, face: Face, part: Bool, material: int, made: MorphTargets) -> dict[str, Any]:
    """Return the mesh of a part with morph targets, and two joints: 0 is fixed, 1 is the head."""
    mesh = rigid_mesh(file, face, part, face.name, material)
    (primitive,) = mesh["primitives"]
    shares = np.zeros((part.sum(), 4), np.float32)
    shares[:, 1] = face.basis["head"][part, 0]
    shares[:, 0] = 1 - shares[:, 1]
    # glTF requires joint 0 for weights of 0.
    joints = (shares > 0) * np.array([0, 1, 0, 0], np.uint8)
    primitive["attributes"]["JOINTS_0"] = file.add(joints, target=ARRAY_BUFFER)
    primitive["attributes"]["WEIGHTS_0"] = file.add(shares, target=ARRAY_BUFFER)
    if made.names:
        ups = _normals(face, face.vertices)
        primitive["targets"] = [_target(file, face, part, moves, ups) for moves in made.moves]
        mesh["weights"] = [0.0] * len(made.names)
        # The usual place for names of targets, which glTF does not define.
        mesh["extras"] = {"targetNames": list(made.names)}
    return mesh


def _target(file: GlbFile, face: Face, part: Bool, moves: Float32, ups: Float32) -> dict[str, int]:
    bent = _normals(face, face.vertices + moves) - ups
    bent[np.abs(bent).max(axis=1) < NEGLIGIBLE_BEND] = 0
    return {
        "POSITION": file.add_sparse(moves[part], bounds=True),
        "NORMAL": file.add_sparse(bent[part]),
    }


def _normals(face: Face, vertices: Float32) -> Float32:
    """Return normals; forward for a vertex without a triangle, because glTF requires unit length."""
    ups: Float32 = normals(face, vertices[None])[0]
    ups[np.abs(ups).sum(axis=1) == 0] = (0, 0, 1)
    return ups
