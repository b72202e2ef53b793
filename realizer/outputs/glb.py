"""The output .glb: an animated glTF 2.0 head with morph targets, joints and a key for each frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from realizer.core.array_types import Bool, Float32
from realizer.core.colours import linear
from realizer.face.glb_file import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, GlbFile
from realizer.face.surface import normals
from realizer.outputs.morph_targets import make_morph_targets
from realizer.outputs.output import Output

if TYPE_CHECKING:
    from realizer.face.model import Face
    from realizer.outputs.morph_targets import MorphTargets

# Node numbers; those of the eyes follow.
FACE, NECK, HEAD = 0, 1, 2
EYES = ("left_eye", "right_eye")
MATERIALS = [
    {
        "name": name,
        "doubleSided": True,
        "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": roughness},
    }
    for name, roughness in (("face", 0.6), ("eyes", 0.15))
]
MIN_NORMAL_CHANGE = 0.01  # half a degree; smaller changes of a normal are invisible


def encode_glb(face: Face, poses: Float32, fps: float) -> bytes:
    """Return a glTF file with frame k at k / fps and linear interpolation.

    One mesh contains everything that changes its shape. Its vertices are bound to two joints, neck and head,
    in the proportion in which they turn with the head. Eyeballs are rigid, on nodes in the head.

    Args:
        poses: (n, len(face.inputs)), `Realization.poses`.
    """
    targets = make_morph_targets(face, poses)
    file = GlbFile()
    pivot = face.basis["head_pivot"]
    nodes: list[dict[str, Any]] = [
        {"name": face.name, "mesh": 0, "skin": 0},
        {"name": "neck", "children": [HEAD]},
        {"name": "head", "translation": pivot.tolist()},
    ]
    keys = [(HEAD, "rotation", quaternions(targets.head))]
    if targets.names:
        keys.append((FACE, "weights", targets.weights.ravel()))
    balls = []
    rest = np.ones(len(face.vertices), bool)
    for eye, ((first, last), centre) in enumerate(face.basis["eyes"]):
        if last <= first:
            continue
        ball = np.zeros_like(rest)
        ball[first:last] = True
        rest &= ~ball
        balls.append((ball, EYES[eye], centre))
        node = len(nodes)
        nodes[HEAD].setdefault("children", []).append(node)
        nodes.append({"name": EYES[eye], "mesh": len(balls), "translation": (centre - pivot).tolist()})
        keys.append((node, "rotation", quaternions(np.pad(targets.eyes[:, eye], ((0, 0), (0, 1))))))
        if targets.thrust[:, eye].any():
            keys.append((node, "translation", centre - pivot + np.outer(targets.thrust[:, eye], (0, 0, 1))))
    meshes = [morphing_mesh(file, face, rest, 0, targets)]
    meshes += [rigid_mesh(file, face, ball, name, 1, centre) for ball, name, centre in balls]
    clock = file.add((np.arange(len(poses)) / fps).astype(np.float32), bounds=True)
    unbound = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    unbound[1, 3, :3] = -pivot  # glTF stores matrices by columns
    return file.bytes_of(
        {
            "asset": {
                "version": "2.0",
                "generator": "bml-realizer",
                "copyright": f"{face.licence}; {face.source}",
            },
            "scene": 0,
            "scenes": [{"nodes": [FACE, NECK]}],
            "nodes": nodes,
            "materials": MATERIALS[: 2 if balls else 1],
            "meshes": meshes,
            "skins": [{"joints": [NECK, HEAD], "inverseBindMatrices": file.add(unbound.reshape(2, 16))}],
            "animations": [file.animation("performance", clock, keys)],
        }
    )


def quaternions(turns: Float32) -> Float32:
    """Convert pitch, yaw, roll (n, 3) to x, y, z, w (n, 4), as `face.deform` does: roll first, yaw last."""
    from scipy.spatial.transform import Rotation

    rotations = Rotation.from_euler("YXZ", turns[:, [1, 0, 2]].astype(np.float64)).as_quat()
    out: Float32 = np.where(rotations[:, 3:] < 0, -rotations, rotations).astype(np.float32)
    return out


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


def morphing_mesh(
    file: GlbFile, face: Face, part: Bool, material: int, targets: MorphTargets
) -> dict[str, Any]:
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
    if targets.names:
        rest = _normals(face, face.vertices)
        primitive["targets"] = [_target(file, face, part, moves, rest) for moves in targets.moves]
        mesh["weights"] = [0.0] * len(targets.names)
        # The usual place for names of targets, which glTF does not define.
        mesh["extras"] = {"targetNames": list(targets.names)}
    return mesh


def _target(file: GlbFile, face: Face, part: Bool, moves: Float32, rest: Float32) -> dict[str, int]:
    changes = _normals(face, face.vertices + moves) - rest
    changes[np.abs(changes).max(axis=1) < MIN_NORMAL_CHANGE] = 0
    return {"POSITION": file.add_sparse(moves[part], bounds=True), "NORMAL": file.add_sparse(changes[part])}


def _normals(face: Face, vertices: Float32) -> Float32:
    """Return normals; forward for a vertex without a triangle, because glTF requires unit length."""
    directions: Float32 = normals(face, vertices[None])[0]
    directions[np.abs(directions).sum(axis=1) == 0] = (0, 0, 1)
    return directions


GLB = Output(
    ".glb",
    "model/gltf-binary",
    "the head, animated: morph targets, head and eyes",
    lambda realization, _: encode_glb(realization.face, realization.poses, realization.fps),
    reader="trimesh",
)
