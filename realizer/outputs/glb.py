"""The output .glb: an animated glTF 2.0 head with morph targets, joints and a key for each frame."""

from typing import Any

import numpy as np

from realizer.face.glb_file import GlbFile
from realizer.face.model import Face
from realizer.outputs.avatar import read_avatar
from realizer.outputs.avatar_glb import encode_avatar
from realizer.outputs.glb_mesh import GlbMesh
from realizer.outputs.morph_targets import MorphTargets, make_arkit_targets, make_morph_targets
from realizer.outputs.output import Output, RenderSettings
from realizer.outputs.rotations import quaternions
from realizer.realization import Realization

# Node numbers; those of the eyes follow.
FACE, NECK, HEAD = 0, 1, 2
EYES = ("left_eye", "right_eye")


def encode_glb(face: Face, targets: MorphTargets, fps: float) -> bytes:
    """Return a glTF file with frame k at k / fps and linear interpolation.

    One mesh contains everything that changes its shape. Its vertices are bound to two joints, neck and head,
    in the proportion in which they turn with the head. Eyeballs are rigid, on nodes in the head. Maps become
    textures, without the folds of expressions: glTF has no textures that come and go.
    """
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
    mesh = GlbMesh(file, face)
    rest, balls = ~np.zeros_like(mesh.part("skin")), []
    for eye, ((first, last), centre) in enumerate(face.basis["eyes"]):
        if last <= first:
            continue
        ball = mesh.part(EYES[eye])
        rest &= ~ball
        node = len(nodes)
        nodes[HEAD].setdefault("children", []).append(node)
        balls.append(mesh.rigid(ball, EYES[eye], centre))
        nodes.append({"name": EYES[eye], "mesh": len(balls), "translation": (centre - pivot).tolist()})
        keys.append((node, "rotation", quaternions(np.pad(targets.eyes[:, eye], ((0, 0), (0, 1))))))
        if targets.thrust[:, eye].any():
            keys.append((node, "translation", centre - pivot + np.outer(targets.thrust[:, eye], (0, 0, 1))))
    meshes = [mesh.morphing(rest, targets), *balls]
    clock = file.add((np.arange(len(targets.weights)) / fps).astype(np.float32), bounds=True)
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
            **mesh.materials.document(),
            "meshes": meshes,
            "skins": [{"joints": [NECK, HEAD], "inverseBindMatrices": file.add(unbound.reshape(2, 16))}],
            "animations": [file.animation("performance", clock, keys)],
        }
    )


def _encode(realization: Realization, drawing: RenderSettings) -> bytes:
    if drawing.avatar is not None:
        return encode_avatar(realization, read_avatar(drawing.avatar))
    if drawing.morphs == "arkit":
        return encode_glb(realization.face, make_arkit_targets(realization), realization.fps)
    targets = make_morph_targets(realization.face, realization.poses)
    return encode_glb(realization.face, targets, realization.fps)


GLB = Output(
    ".glb", "model/gltf-binary", "the head, animated: textures, morph targets, head and eyes", _encode
)
