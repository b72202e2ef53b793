"""Small avatars, as GLB and VRM: a plate with a mouth and two eyes on a skeleton."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from realizer.face.glb_file import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, GlbFile
from realizer.tables import toml_table

EYES = {"leftEye": (0.03, 0.07, 0.1), "rightEye": (-0.03, 0.07, 0.1)}  # metres from the head
QUAD = np.array([0, 1, 2, 0, 2, 3], np.uint32)
META = {"name": "plate", "authors": ["tests"], "licenseUrl": "https://vrm.dev/licenses/1.0/"}
RANGE = {"inputMaxValue": 90, "outputScale": 90}
WAYS = ("HorizontalInner", "HorizontalOuter", "VerticalDown", "VerticalUp")
VRM0 = {"blinkLeft": "blink_l", "aa": "a", "ih": "i", "ou": "u", "ee": "e", "oh": "o", "happy": "joy"}


def avatar(
    shapes: Sequence[str] = ("jawOpen", "mouthSmileLeft"),
    *,
    vrm: int | None = None,
    expressions: Mapping[str, str] | None = None,
    twist: int | None = None,
    eye_shapes: bool = False,
    matrices: bool = False,
) -> bytes:
    """Return an avatar. Each shape lowers the lower edge of its mouth by 3 cm.

    Args:
        vrm: 0 or 1: with the extension of that version. Avatars of VRM 0 look along -z.
        expressions: name of an expression of VRM -> the shape that shows it.
        twist: the seed of rotations at rest; None: the bones lie along the axes.
        eye_shapes: whether the eyeballs have a shape eyeLookUpLeft that moves them.
        matrices: whether nodes have matrices instead of rotations.
    """
    file, back = GlbFile(), np.array([-1, 1, -1] if vrm == 0 else [1, 1, 1], np.float32)
    nodes, bones = skeleton(back, twist, matrices)
    head = back * _place("head")
    meshes: list[dict[str, Any]] = [
        {"name": "Face", "primitives": [_quad(file, head, back, 0.1, (-0.1, 0.14), 0.1, (0.9, 0.7, 0.6))]},
        {"name": "Mouth", "primitives": [_quad(file, head, back, 0.05, (-0.03, -0.02), 0.11, (0.3, 0, 0))]},
    ]
    lowered = np.zeros((4, 3), np.float32)
    lowered[:2, 1] = -0.03
    if shapes:
        moves = file.add(lowered, bounds=True)
        meshes[1]["primitives"][0]["targets"] = [{"POSITION": moves} for _ in shapes]
        meshes[1] |= {"weights": [0.0] * len(shapes), "extras": {"targetNames": list(shapes)}}
    unbound = np.linalg.inv(_world(nodes, bones["head"])).T[None].astype(np.float32)
    skin = {"joints": [bones["head"]], "inverseBindMatrices": file.add(unbound.reshape(1, 16))}
    for mesh in (0, 1):
        nodes.append({"name": meshes[mesh]["name"], "mesh": mesh, "skin": 0})
    for bone in EYES:
        ball = _quad(file, np.zeros(3), back, 0.01, (-0.01, 0.01), 0.01, (1, 1, 1), skinned=False)
        if eye_shapes:
            ball["targets"] = [{"POSITION": file.add(lowered, bounds=True)}]
        meshes.append({"name": bone, "primitives": [ball]})
        if eye_shapes:
            meshes[-1]["extras"] = {"targetNames": ["eyeLookUpLeft"]}
        nodes[bones[bone]]["mesh"] = len(meshes) - 1
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "tests"},
        "scene": 0,
        "scenes": [{"nodes": [bones["hips"], len(nodes) - 2, len(nodes) - 1]}],
        "nodes": nodes,
        "meshes": meshes,
        "skins": [skin],
        "materials": [{"name": "skin", "doubleSided": True, "pbrMetallicRoughness": {"metallicFactor": 0}}],
    }
    mouth = len(nodes) - 1
    binds = {name: list(shapes).index(shape) for name, shape in (expressions or {}).items()}
    if vrm == 1:
        custom = {
            name: {"morphTargetBinds": [{"node": mouth, "index": k, "weight": 1.0}]}
            for name, k in binds.items()
        }
        preset = {name: custom.pop(name) for name in [*custom] if name in toml_table("vrm.toml")["vrm0"]}
        document["extensionsUsed"] = ["VRMC_vrm"]
        document["extensions"] = {
            "VRMC_vrm": {
                "specVersion": "1.0",
                "meta": META,
                "humanoid": {"humanBones": {bone: {"node": node} for bone, node in bones.items()}},
                "expressions": {"preset": preset, "custom": custom},
                "lookAt": {"type": "bone", "offsetFromHeadBone": [0, 0.06, 0]}
                | {f"rangeMap{way}": RANGE for way in WAYS},
            }
        }
    if vrm == 0:
        groups = [
            {"name": name, "presetName": VRM0.get(name, "unknown"),
             "binds": [{"mesh": 1, "index": k, "weight": 100}]}
            for name, k in binds.items()
        ]  # fmt: skip
        document["extensionsUsed"] = ["VRM"]
        document["extensions"] = {
            "VRM": {
                "specVersion": "0.0",
                "meta": {"title": "plate"},
                "humanoid": {"humanBones": [{"bone": bone, "node": node} for bone, node in bones.items()]},
                "blendShapeMaster": {"blendShapeGroups": groups},
                "firstPerson": {"firstPersonBone": bones["head"], "lookAtTypeName": "Bone"},
                "secondaryAnimation": {},
                "materialProperties": [],
            }
        }
    return file.bytes_of(document)


def skeleton(
    back: np.ndarray, twist: int | None, matrices: bool
) -> tuple[list[dict[str, Any]], dict[str, int]]:
    """Return the nodes of VRM's required bones and of the eyes, and the number of each."""
    table = toml_table("vrm.toml")["bones"] | {
        bone: {"parent": "head", "at": at} for bone, at in EYES.items()
    }
    bones = {name: k for k, name in enumerate(table)}
    turns = Rotation.identity(len(table))
    if twist is not None:
        turns = Rotation.random(len(table), rng=np.random.default_rng(twist))
    nodes: list[dict[str, Any]] = []
    for k, (name, bone) in enumerate(table.items()):
        above = turns[bones[bone["parent"]]].inv() if "parent" in bone else Rotation.identity()
        place, turn = above.apply(back * bone["at"]), above * turns[k]
        if name.endswith("Eye"):  # their meshes have no skin
            turn = above
        node: dict[str, Any] = {
            "name": name,
            "translation": place.tolist(),
            "rotation": turn.as_quat().tolist(),
        }
        if matrices:
            matrix = np.eye(4)
            matrix[:3, :3], matrix[:3, 3] = turn.as_matrix(), place
            node = {"name": name, "matrix": matrix.T.ravel().tolist()}
        nodes.append(node)
        if "parent" in bone:
            nodes[bones[bone["parent"]]].setdefault("children", []).append(k)
    return nodes, bones


def _place(name: str) -> np.ndarray:
    table = toml_table("vrm.toml")["bones"]
    bone = table[name]
    return np.asarray(bone["at"], float) + (_place(bone["parent"]) if "parent" in bone else 0)


def _world(nodes: Sequence[Mapping[str, Any]], node: int) -> np.ndarray:
    """Return the matrix of a node in the scene."""
    own = np.eye(4)
    if "matrix" in nodes[node]:
        own = np.reshape(nodes[node]["matrix"], (4, 4)).T
    else:
        own[:3, :3] = Rotation.from_quat(nodes[node]["rotation"]).as_matrix()
        own[:3, 3] = nodes[node]["translation"]
    above = next((k for k, other in enumerate(nodes) if node in other.get("children", ())), None)
    return own if above is None else _world(nodes, above) @ own


def _quad(
    file: GlbFile, at: np.ndarray, back: np.ndarray, wide: float, high: tuple[float, float], depth: float,
    colour: Sequence[float], *, skinned: bool = True,
) -> dict[str, Any]:  # fmt: skip
    """Return a primitive: a rectangle that faces the viewer, its lower edge first."""
    corners = np.array(
        [[-wide, high[0], depth], [wide, high[0], depth], [wide, high[1], depth], [-wide, high[1], depth]]
    )
    add = file.add
    attributes = {
        "POSITION": add((at + back * corners).astype(np.float32), target=ARRAY_BUFFER, bounds=True),
        "NORMAL": add(np.tile(back * np.float32([0, 0, 1]), (4, 1)), target=ARRAY_BUFFER),
        "COLOR_0": file.add_colours(np.tile(np.float32(colour), (4, 1))),
    }
    if skinned:
        attributes["JOINTS_0"] = add(np.zeros((4, 4), np.uint8), target=ARRAY_BUFFER)
        attributes["WEIGHTS_0"] = add(np.tile(np.float32([1, 0, 0, 0]), (4, 1)), target=ARRAY_BUFFER)
    return {"attributes": attributes, "indices": add(QUAD, target=ELEMENT_ARRAY_BUFFER), "material": 0}
