"""The output .glb for somebody's own avatar: its file, with the animation added."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from realizer.animation.arkit import ARKIT_NAMES, arkit
from realizer.core.array_types import Float32
from realizer.face.glb_file import GlbFile
from realizer.outputs.avatar import Avatar, Bind, rotation_of
from realizer.outputs.rotations import half_turns, quaternions
from realizer.outputs.vrma import expressions
from realizer.realization import Realization


def encode_avatar(realization: Realization, avatar: Avatar) -> bytes:
    """Return the avatar's file with the animation "performance" before its own, frame k at k / fps.

    glTF has no animation of weights without the mesh that they belong to, so the whole avatar is written.
    Meshes and textures are copied as they are. An avatar without ARKit's shapes gets VRM's expressions.
    """
    frames = arkit(realization.aus, realization.mapping)
    document = {**avatar.document, "nodes": [dict(node) for node in avatar.document["nodes"]]}
    file = GlbFile(document, avatar.data)
    clock = file.add(frames.times.astype(np.float32), bounds=True)
    keys: list[tuple[int, str, Any]] = []
    if avatar.shapes:
        found = dict(zip(ARKIT_NAMES(), frames.weights.T, strict=True))
        weights = _weights(document, avatar.shapes, found)
    else:
        weights = _weights(document, avatar.expressions, expressions(realization))
    keys += [(node, "weights", rows.ravel()) for node, rows in weights.items()]
    turns = {"head": frames.head[:, [1, 0, 2]]} | {
        bone: np.pad(frames.eyes[:, eye, ::-1], ((0, 0), (0, 1)))
        for eye, bone in enumerate(("leftEye", "rightEye"))
    }
    turned = {bone: quaternions(rows) for bone, rows in turns.items()}
    if avatar.bones.keys() >= {"neck", "head"}:
        turned["neck"] = turned["head"] = half_turns(turned["head"])
    for bone, node in avatar.bones.items():
        _split(document["nodes"][node])
        keys.append((node, "rotation", _in_parent(turned[bone], avatar, node)))
    animation = file.animation("performance", clock, keys)
    # A file of ours already has an animation of that name, which the new one replaces.
    others = [a for a in document.get("animations", ()) if a.get("name") != animation["name"]]
    return file.bytes_of({**document, "animations": [animation, *others]})


def _weights(
    document: Mapping[str, Any], binds: Mapping[str, Any], found: Mapping[str, Float32]
) -> dict[int, Float32]:
    """Return the weights (n, targets) of each node that has morph targets of these names."""
    weights: dict[int, Float32] = {}
    for name, targets in binds.items():
        bind: Bind
        for bind in targets if name in found else ():
            node, target, share = bind
            if node not in weights:
                mesh = document["meshes"][document["nodes"][node]["mesh"]]
                count = len(mesh["primitives"][0]["targets"])
                still = document["nodes"][node].get("weights") or mesh.get("weights") or [0.0] * count
                weights[node] = np.tile(np.array(still, np.float32), (len(found[name]), 1))
                for own, column, _ in (b for some in binds.values() for b in some):
                    if own == node:
                        weights[node][:, column] = 0
            weights[node][:, target] += np.float32(share) * found[name]
    return weights


def _in_parent(turns: Float32, avatar: Avatar, node: int) -> Float32:
    """Return rotations (n, 4) of a head that looks along +z as rotations of a bone in its parent."""
    from scipy.spatial.transform import Rotation

    if avatar.faces_back:
        turns = turns * np.array([-1, 1, -1, 1], np.float32)
    parent, own = map(Rotation.from_matrix, avatar.rest[node])
    out: Float32 = (parent.inv() * Rotation.from_quat(turns) * parent * own).as_quat().astype(np.float32)
    return out


def _split(node: dict[str, Any]) -> None:
    """Replace the matrix of a node, which cannot be animated, by translation, rotation and scale."""
    from scipy.spatial.transform import Rotation

    if "matrix" in node:
        matrix = np.reshape(node["matrix"], (4, 4)).T
        node["rotation"] = Rotation.from_matrix(rotation_of(node)).as_quat().tolist()
        node["scale"] = np.linalg.norm(matrix[:3, :3], axis=0).tolist()
        node["translation"] = matrix[:3, 3].tolist()
        del node["matrix"]
