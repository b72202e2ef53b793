"""GLB and VRM avatars: the morph targets that show ARKit's shapes, and the bones that turn head and eyes."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.glb_file import read_glb
from realizer.tables import toml_table
from realizer.tables.arkit_names import canonical
from realizer.tables.arkit_names import shapes as arkit_shapes

# Letters of a node's name behind a prefix such as "mixamorig:" -> its bone, in VRM's spelling.
BONES = {
    "head": "head", "neck": "neck",
    **dict.fromkeys(("lefteye", "eyeleft", "eyel", "leye"), "leftEye"),
    **dict.fromkeys(("righteye", "eyeright", "eyer", "reye"), "rightEye"),
}  # fmt: skip
BALL = re.compile(r"eye(?!.*(lash|brow|lid|shadow|occlusion))", re.IGNORECASE)
LISTED = 8  # names in a message
# The shapes without which a face does not seem to speak or to live.
MOST_SEEN = (
    "jawOpen", "eyeBlinkLeft", "eyeBlinkRight", "mouthFunnel", "mouthPucker", "mouthClose", "mouthSmileLeft",
    "mouthSmileRight",
)  # fmt: skip
DRACO = "KHR_draco_mesh_compression"
UNPACK = "unpack them with npx @gltf-transform/cli copy"
Bind = tuple[int, int, float]  # node, number of a morph target, its weight when the shape has weight 1


@dataclass(frozen=True, eq=False)
class Avatar:
    """An avatar, as read from its file.

    Attributes:
        document: the glTF document.
        data: the binary chunk.
        shapes: ARKit's name -> the morph targets that show the shape.
        expressions: the same for VRM's preset expressions.
        bones: those of neck, head, leftEye and rightEye that the avatar has -> node.
        rest: node of a bone -> rotation of its parent in the scene (3, 3), and its own in its parent (3, 3).
        faces_back: whether the avatar looks along -z, as those of VRM 0 do.
    """

    document: dict[str, Any]
    data: bytes
    shapes: Mapping[str, Sequence[Bind]]
    expressions: Mapping[str, Sequence[Bind]]
    bones: Mapping[str, int]
    rest: Mapping[int, tuple[Float64, Float64]]
    faces_back: bool

    @property
    def missing(self) -> tuple[str, ...]:
        """ARKit's shapes that nothing shows, the most seen first; none if it has VRM's expressions alone."""
        turned = self.bones.keys() >= {"leftEye", "rightEye"}
        names = dict.fromkeys((*MOST_SEEN, *arkit_shapes())) if self.shapes else ()
        lost = (name for name in names if name not in self.shapes)
        return tuple(name for name in lost if not (turned and name.startswith("eyeLook")))

    @property
    def lines(self) -> tuple[str, ...]:
        """What was found and what is missing, in words."""
        found = [f"{len(self.shapes)} of ARKit's {len(arkit_shapes())} shapes"] if self.shapes else []
        found += [f"VRM's expressions {', '.join(self.expressions)}"] if self.expressions else []
        found += [f"bones of {', '.join(self.bones)}"] if self.bones else []
        missing = (f"missing: {', '.join(self.missing)}",) if self.missing else ()
        return (f"found: {'; '.join(found)}", *missing)


def read_avatar(path: Path | str) -> Avatar:
    """Read a .glb or .vrm file whose morph targets have ARKit's names, or VRM's expressions.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no GLB file, is broken, has neither, or has meshes packed with Draco.
    """
    raw = Path(path).read_bytes()
    try:
        document, data = read_glb(raw)
        _check_meshes(document, len(data))
        avatar, names = _avatar(document, data)
    except (KeyError, IndexError, TypeError, AttributeError, RecursionError) as error:
        fault = f"{type(error).__name__}: {error}"
        raise ValueError(f"avatar: {path}: wanted a glTF 2.0 document, got a broken one ({fault})") from None
    except ValueError as error:
        raise ValueError(f"avatar: {path}: {error}") from None
    if not (avatar.shapes or avatar.expressions):
        got = ", ".join(names[:LISTED]) + ", ..." * (len(names) > LISTED)
        raise ValueError(
            f"avatar: {path}: wanted morph targets with ARKit's names, such as jawOpen and mouthSmileLeft, "
            f"or VRM's expressions, got {got or 'no morph targets'}"
        )
    return avatar


def rotation_of(node: Mapping[str, Any]) -> Float64:
    """Return the rotation (3, 3) of a node in its parent."""
    from scipy.spatial.transform import Rotation

    if "matrix" not in node:
        return np.asarray(Rotation.from_quat(node.get("rotation", (0, 0, 0, 1))).as_matrix())
    matrix = np.reshape(node["matrix"], (4, 4)).T[:3, :3]
    return np.asarray(matrix / np.linalg.norm(matrix, axis=0))


def _avatar(document: dict[str, Any], data: bytes) -> tuple[Avatar, list[str]]:
    """Return the avatar, and the names of its morph targets."""
    nodes, shapes = document["nodes"], dict[str, list[Bind]]()
    named = list(_targets(document))
    for node, target, name, _ in named:
        if shape := canonical(name):
            shapes.setdefault(shape, []).append((node, target, 1.0))
    expressions = {name: binds for name, binds in _expressions(document) if binds}
    # "Perfect sync": the shapes as expressions, whose morph targets may have any names.
    shapes |= {shape: binds for name, binds in expressions.items() if (shape := canonical(name))}
    bones = dict(_bones(document))
    if any(moves and BALL.search(_name(document, node)) for node, _, name, moves in named if _looks(name)):
        bones = {bone: node for bone, node in bones.items() if not bone.endswith("Eye")}
    parents = {child: k for k, node in enumerate(nodes) for child in node.get("children", ())}

    def in_scene(node: int | None) -> Float64:
        return np.eye(3) if node is None else in_scene(parents.get(node)) @ rotation_of(nodes[node])

    rest = {node: (in_scene(parents.get(node)), rotation_of(nodes[node])) for node in bones.values()}
    preset = {name: expressions[name] for name in toml_table("vrm.toml")["vrm0"] if name in expressions}
    is_vrm0 = "VRM" in document.get("extensions", {})
    avatar = Avatar(document, data, shapes, preset, bones, rest, is_vrm0)
    return avatar, list(dict.fromkeys(name for _, _, name, _ in named))


def _check_meshes(document: Mapping[str, Any], size: int) -> None:
    """Raise ValueError for meshes that are packed with Draco, or are not in the file."""
    primitives = [primitive for mesh in document.get("meshes", ()) for primitive in mesh["primitives"]]
    packed = {name for primitive in primitives for name in primitive.get("extensions", ())}
    if DRACO in packed | set(document.get("extensionsRequired", ())):
        raise ValueError(f"wanted meshes that are not packed with Draco, got packed ones: {UNPACK}")
    views, accessors = document.get("bufferViews", ()), document.get("accessors", ())
    for k, view in enumerate(views):
        end = view.get("byteOffset", 0) + view["byteLength"]
        if view["buffer"] == 0 and end > size:
            raise ValueError(f"wanted {end} bytes for bufferViews[{k}], got {size}: export it again")
    for k, accessor in enumerate(accessors):
        sparse = accessor.get("sparse", {})
        for part in (accessor, sparse.get("indices", {}), sparse.get("values", {})):
            if not 0 <= (view := part.get("bufferView", 0)) < max(1, len(views)):
                raise ValueError(f"wanted one of {len(views)} bufferViews in accessors[{k}], got {view}")
    for primitive in primitives:
        places = (primitive["attributes"], *primitive.get("targets", ()))
        for accessor in (primitive.get("indices", 0), *(k for place in places for k in place.values())):
            if not 0 <= accessor < len(accessors):
                raise ValueError(f"wanted one of {len(accessors)} accessors in a mesh, got {accessor}")


def _targets(document: Mapping[str, Any]) -> Iterator[tuple[int, int, str, bool]]:
    """Yield node, number, name of each morph target, and whether it moves anything."""
    for k, node in enumerate(document["nodes"]):
        if "mesh" not in node:
            continue
        mesh = document["meshes"][node["mesh"]]
        first = mesh["primitives"][0]
        names = (mesh.get("extras") or {}).get("targetNames") or (first.get("extras") or {}).get(
            "targetNames"
        )
        for target, places in enumerate(first.get("targets", ())):
            moved = document["accessors"][places["POSITION"]] if "POSITION" in places else {}
            name = names[target] if names else moved.get("name", f"target {target}")
            yield k, target, str(name), any(map(abs, (*moved.get("min", ()), *moved.get("max", ()))))


def _looks(name: str) -> bool:
    return (canonical(name) or "").startswith("eyeLook")


def _name(document: Mapping[str, Any], node: int) -> str:
    found = document["nodes"][node]
    return f"{found.get('name', '')} {document['meshes'][found['mesh']].get('name', '')}"


def _expressions(document: Mapping[str, Any]) -> Iterator[tuple[str, list[Bind]]]:
    """Yield the names of VRM's expressions, in the spelling of VRM 1, and their morph targets."""
    extensions = document.get("extensions", {})
    groups = extensions.get("VRMC_vrm", {}).get("expressions", {})
    for name, expression in {**groups.get("custom", {}), **groups.get("preset", {})}.items():
        binds = expression.get("morphTargetBinds", ())
        yield name, [(bind["node"], bind["index"], float(bind["weight"])) for bind in binds]
    spelled = {old: name for name, old in toml_table("vrm.toml")["vrm0"].items()}
    for group in extensions.get("VRM", {}).get("blendShapeMaster", {}).get("blendShapeGroups", ()):
        preset = group.get("presetName", "unknown")
        name = group["name"] if preset == "unknown" else preset
        users = [
            (node, bind)
            for bind in group.get("binds", ())
            for node, found in enumerate(document["nodes"])
            if found.get("mesh") == bind["mesh"]
        ]
        yield spelled.get(name.lower(), name), [(k, bind["index"], bind["weight"] / 100) for k, bind in users]


def _bones(document: Mapping[str, Any]) -> Iterator[tuple[str, int]]:
    """Yield bones of a VRM humanoid, or nodes that are called like them; joints of skins win."""
    extensions, nodes = document.get("extensions", {}), document["nodes"]
    wanted = set(BONES.values())
    if humans := extensions.get("VRMC_vrm", {}).get("humanoid", {}).get("humanBones"):
        yield from ((bone, found["node"]) for bone, found in humans.items() if bone in wanted)
    elif humans := extensions.get("VRM", {}).get("humanoid", {}).get("humanBones"):
        yield from ((found["bone"], found["node"]) for found in humans if found["bone"] in wanted)
    else:
        joints = {joint for skin in document.get("skins", ()) for joint in skin["joints"]}
        children = {child for node in nodes for child in node.get("children", ())}
        # The last of a bone wins. A node with a skin is placed by its joints.
        for k in sorted((k for k, node in enumerate(nodes) if "skin" not in node), key=joints.__contains__):
            letters = re.sub("[^a-z]", "", str(nodes[k].get("name", "")).rpartition(":")[2].lower())
            bone = BONES.get(letters, "")
            holds = k in joints or "children" in nodes[k] or (bone.endswith("Eye") and "mesh" in nodes[k])
            # A neck below which nothing is would turn the whole bust.
            if bone and holds and (bone != "neck" or k in children):
                yield bone, k
