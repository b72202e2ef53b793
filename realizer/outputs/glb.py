"""The output .glb: an animated glTF 2.0 head with morph targets, joints and a key for each frame."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from realizer.core.array_types import Float32
from realizer.face.glb_file import GlbFile
from realizer.outputs.glb_mesh import morphing_mesh, rigid_mesh
from realizer.outputs.morph_targets import make_morph_targets
from realizer.outputs.output import Output

if TYPE_CHECKING:
    from realizer.face.model import Face

# Node numbers; those of the eyes follow.
FACE, NECK, HEAD = 0, 1, 2
EYES = ("left_eye", "right_eye")
MATERIALS = (("face", 0.6), ("eyes", 0.15))  # name, roughness


def encode_glb(face: Face, poses: Float32, fps: float) -> bytes:
    """Return a glTF file with frame k at k / fps and linear interpolation.

    One mesh contains everything that changes its shape. Its vertices are bound to two joints, neck and head,
    in the proportion in which they turn with the head. Eyeballs are rigid, on nodes in the head.

    Args:
        poses: (n, len(face.inputs)), `Realization.poses`.
    """
    made = make_morph_targets(face, poses)
    file = GlbFile()
    pivot = face.basis["head_pivot"]
    nodes: list[dict[str, Any]] = [
        {"name": face.name, "mesh": 0, "skin": 0},
        {"name": "neck", "children": [HEAD]},
        {"name": "head", "translation": pivot.tolist()},
    ]
    keys = [(HEAD, "rotation", quaternions(made.head))]
    if made.names:
        keys.append((FACE, "weights", made.weights.ravel()))
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
        keys.append((node, "rotation", quaternions(np.pad(made.eyes[:, eye], ((0, 0), (0, 1))))))
        if made.thrust[:, eye].any():
            keys.append((node, "translation", centre - pivot + np.outer(made.thrust[:, eye], (0, 0, 1))))
    meshes = [morphing_mesh(file, face, rest, 0, made)]
    meshes += [rigid_mesh(file, face, ball, name, 1, centre) for ball, name, centre in balls]
    clock = file.add((np.arange(len(poses)) / fps).astype(np.float32), bounds=True)
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
            "materials": [_material(*material) for material in MATERIALS[: 2 if balls else 1]],
            "meshes": meshes,
            "skins": [{"joints": [NECK, HEAD], "inverseBindMatrices": _unbound(file, pivot)}],
            "animations": [file.animation("performance", clock, keys)],
        }
    )


def quaternions(turns: Float32) -> Float32:
    """Convert pitch, yaw, roll (n, 3) to x, y, z, w (n, 4), as `face.deform` does: roll first, yaw last."""
    from scipy.spatial.transform import Rotation

    turned = Rotation.from_euler("YXZ", turns[:, [1, 0, 2]].astype(np.float64)).as_quat()
    out: Float32 = np.where(turned[:, 3:] < 0, -turned, turned).astype(np.float32)
    return out


def _unbound(file: GlbFile, pivot: Float32) -> int:
    """Add the inverse bind matrices of the two joints; glTF stores matrices by columns."""
    matrices = np.tile(np.eye(4, dtype=np.float32), (2, 1, 1))
    matrices[1, 3, :3] = -pivot
    return file.add(matrices.reshape(2, 16))


def _material(name: str, roughness: float) -> dict[str, Any]:
    return {
        "name": name,
        "doubleSided": True,
        "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": roughness},
    }


GLB = Output(
    ".glb",
    "model/gltf-binary",
    "the head, animated: morph targets, head and eyes",
    lambda realization, _: encode_glb(realization.face, realization.poses, realization.fps),
    reader="trimesh",
)
