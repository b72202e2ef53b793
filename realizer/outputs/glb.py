"""The output .glb: an animated glTF 2.0 head with morph targets and joints, or somebody's own avatar."""

import logging
from collections.abc import Mapping
from itertools import count
from typing import Any

import numpy as np

from realizer.animation.arkit import ARKIT_NAMES, arkit
from realizer.core.array_types import Float32
from realizer.face.glb_file import GlbFile, half_turns, quaternions
from realizer.face.model import Face
from realizer.outputs.avatar import LISTED, Avatar, Bind, read_avatar, rotation_of
from realizer.outputs.glb_mesh import GlbMesh
from realizer.outputs.morph_targets import MorphTargets, make_arkit_targets, make_morph_targets
from realizer.outputs.output import Output, RenderSettings
from realizer.outputs.vrma import expressions
from realizer.realization import Realization

# Node numbers; those of the eyes follow.
log = logging.getLogger(__name__)

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
    # A file that was written here has an animation of that name: it gets a number.
    others = list(document.get("animations", ()))
    names = {other.get("name") for other in others}
    free = next(name for k in count(2) if (name := f"{animation['name']} {k}") not in names)
    others = [{**a, "name": free} if a.get("name") == animation["name"] else a for a in others]
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


def _encode(realization: Realization, drawing: RenderSettings) -> bytes:
    if drawing.avatar is not None:
        avatar = read_avatar(drawing.avatar)
        if missing := avatar.missing:
            more = f" and {len(missing) - LISTED} more" if len(missing) > LISTED else ""
            log.warning("%s: lacks ARKit's %s%s", drawing.avatar, ", ".join(missing[:LISTED]), more)
        return encode_avatar(realization, avatar)
    if drawing.morphs == "arkit":
        return encode_glb(realization.face, make_arkit_targets(realization), realization.fps)
    targets = make_morph_targets(realization.face, realization.poses)
    return encode_glb(realization.face, targets, realization.fps)


GLB = Output(
    ".glb", "model/gltf-binary", "the head, animated: textures, morph targets, head and eyes", _encode
)
