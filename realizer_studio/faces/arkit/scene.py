"""The surfaces of a glTF scene: vertices, colours and blend shapes."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.core.colours import srgb
from realizer.core.errors import FaceError
from realizer_studio.faces.arkit.gltf import Gltf
from realizer_studio.faces.arkit.materials import CLAMP, Material, read_material

TRIANGLES, STRIP, FAN = 4, 5, 6
MAX_GLASS_ALPHA = 0.35  # more transparent surfaces are glass, such as a cornea or a tear line
FARTHEST = 1000.0  # copies of a repeating texture


@dataclass(eq=False)
class Piece:
    """A primitive in scene coordinates."""

    names: tuple[str, str, str]  # names of its material, mesh and node; "" for a missing name
    vertices: Float64  # (n, 3) in the unit and the axes of the file
    triangles: Int32  # (m, 3)
    colours: Float64  # (n, 3) sRGB 0..255, of the vertices alone
    uv: Float64  # (n, 2) texture coordinates, (0, 0) at the top left
    material: Material
    glass: bool = False  # whether the surface is transparent
    notes: tuple[str, ...] = ()  # properties of its material that are not drawn
    moves: dict[str, Float64] = field(default_factory=dict)  # name of a morph target -> (n, 3) displacements


def read_pieces(gltf: Gltf) -> list[Piece]:
    """Return the surfaces of the file's scene.

    Raises:
        FaceError: an index or an array does not exist.
    """
    worlds = dict(_world_matrices(gltf))
    pieces = []
    for number, world in worlds.items():
        node = gltf.item("nodes", number)
        if "mesh" not in node:
            continue
        mesh = gltf.item("meshes", node["mesh"])
        for k, primitive in enumerate(mesh.get("primitives", [])):
            if primitive.get("mode", TRIANGLES) not in (TRIANGLES, STRIP, FAN):
                continue
            where = f"{gltf.path}: mesh {mesh.get('name', node['mesh'])!r}, primitive {k}"
            unpack_primitive(gltf, primitive, where)
            pieces.append(_piece(gltf, node, mesh, primitive, world, worlds, where))
    return [piece for piece in pieces if len(piece.vertices) and len(piece.triangles)]


def _world_matrices(gltf: Gltf) -> Iterator[tuple[int, Float64]]:
    """Yield the number and the world matrix (4, 4) of each node of the scene."""
    scenes = gltf.list("scenes")
    nodes = gltf.list("nodes")
    if scenes:
        pending = [(k, np.eye(4)) for k in gltf.item("scenes", gltf.json.get("scene", 0)).get("nodes", [])]
    else:
        children = {k for node in nodes for k in node.get("children", [])}
        pending = [(k, np.eye(4)) for k in range(len(nodes)) if k not in children]
    visited: set[int] = set()
    while pending:
        number, parent = pending.pop(0)
        if number in visited:
            raise FaceError(
                f"{gltf.path}: wanted a tree, got nodes[{number}] twice: of two parents or of itself"
            )
        visited.add(number)
        node = gltf.item("nodes", number)
        world = parent @ _matrix(node)
        yield number, world
        pending += [(k, world) for k in node.get("children", [])]


def _matrix(node: dict[str, Any]) -> Float64:
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    out = np.eye(4)
    out[:3, :3] = rotation * np.array(node.get("scale", (1, 1, 1)), float)
    out[:3, 3] = node.get("translation", (0, 0, 0))
    return out


def _piece(
    gltf: Gltf, node: dict[str, Any], mesh: dict[str, Any], primitive: dict[str, Any], world: Float64,
    worlds: dict[int, Float64], where: str,
) -> Piece:  # fmt: skip
    attributes = primitive.get("attributes", {})
    if "POSITION" not in attributes:
        raise FaceError(f"{where}: wanted POSITION, got {', '.join(attributes) or 'no attribute'}")
    at = gltf.accessor(attributes["POSITION"])
    n = len(at)
    if at.shape[1:] != (3,) or not np.isfinite(at).all() or not np.isfinite(world).all():
        raise FaceError(f"{where}: POSITION: wanted finite x, y, z of each vertex; export the head again")
    corners = gltf.accessor(primitive["indices"]).ravel() if "indices" in primitive else np.arange(n)
    if len(corners) and not (corners.min() >= 0 and corners.max() < n):
        got = f"{corners.min():g}..{corners.max():g}"
        raise FaceError(f"{where}: indices: wanted 0..{n - 1}, got {got}; export the head again")
    corners = corners.astype(np.int64)
    material, notes = read_material(gltf, primitive.get("material"))
    colours, alpha = _colours(gltf, attributes, n, where)
    uv, material, lost = _texture_coordinates(gltf, material, attributes, n, where)
    skinning = _skinning(gltf, node, attributes, worlds, n, where)
    matrices = np.broadcast_to(world, (n, 4, 4)) if skinning is None else skinning
    triangles = _triangles(corners, primitive.get("mode", TRIANGLES))
    if np.linalg.det(matrices[:, :3, :3]).mean() < 0:
        triangles = triangles[:, ::-1]  # a reflection reverses their orientation
    names = _target_names(gltf, mesh, primitive)
    moves: dict[str, Float64] = {}
    for name, target in zip(names, primitive.get("targets", []), strict=True):
        if "POSITION" in target:
            move = gltf.accessor(target["POSITION"])
            if len(move) != n:
                raise FaceError(f"{where}: shape {name!r}: wanted {n} moves, one a vertex, got {len(move)}")
            if move.shape != at.shape or not np.isfinite(move).all():
                raise FaceError(f"{where}: shape {name!r}: wanted finite x, y, z of each move; export again")
            moves[name] = np.einsum("nij,nj->ni", matrices[:, :3, :3], move)
    return Piece(
        names=(material.name, str(mesh.get("name", "")), str(node.get("name", ""))),
        vertices=np.einsum("nij,nj->ni", matrices[:, :3, :3], at) + matrices[:, :3, 3],
        triangles=triangles.astype(np.int32),
        colours=colours,
        uv=uv,
        material=material,
        glass=_is_glass(gltf, material, uv, alpha, triangles),
        notes=(*notes, *lost),
        moves=moves,
    )


def _attribute(
    gltf: Gltf, attributes: dict[str, Any], name: str, n: int, widths: tuple[int, ...], where: str
) -> Float64:
    """Return an attribute (n, width) of the vertices of a primitive.

    Raises:
        FaceError: it has another shape, or a value is not finite.
    """
    values = gltf.accessor(attributes[name])
    is_finite = bool(np.isfinite(values).all())
    if len(values) != n or values.shape[1] not in widths or not is_finite:
        expected = f"{n} x {' or '.join(map(str, widths))} finite numbers"
        got = " x ".join(map(str, values.shape)) if is_finite else "NaN or infinity"
        raise FaceError(f"{where}: {name}: wanted {expected}, got {got}; export the head again")
    return values


def _triangles(corners: Any, mode: int) -> Any:
    if mode == TRIANGLES:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    k = np.arange(max(len(corners) - 2, 0))
    if mode == FAN:
        return np.stack([corners[0] * np.ones_like(k), corners[k + 1], corners[k + 2]], 1)
    # Every second triangle of a strip has the opposite orientation.
    odd = k % 2
    return np.stack([corners[k], corners[k + 1 + odd], corners[k + 2 - odd]], 1)


def _target_names(gltf: Gltf, mesh: dict[str, Any], primitive: dict[str, Any]) -> list[str]:
    """Return the names of a primitive's morph targets.

    glTF does not define a place for them. Most programs write mesh.extras.targetNames, some the extras of the
    primitive, and some name the accessors.
    """
    targets = primitive.get("targets", [])
    for holder in (mesh, primitive):
        extras = holder.get("extras")
        names = extras.get("targetNames") if isinstance(extras, dict) else None
        if isinstance(names, list) and len(names) == len(targets):
            return [str(name) for name in names]
    return [
        str(gltf.item("accessors", target["POSITION"]).get("name", f"target {k}"))
        if "POSITION" in target
        else f"target {k}"
        for k, target in enumerate(targets)
    ]


def _skinning(
    gltf: Gltf, node: dict[str, Any], attributes: dict[str, Any], worlds: dict[int, Float64], n: int,
    where: str,
) -> Any:  # fmt: skip
    """Return the skinning matrix (n, 4, 4) of each vertex in the file's pose, or None without a skeleton."""
    if "skin" not in node or "JOINTS_0" not in attributes or "WEIGHTS_0" not in attributes:
        return None
    skin = gltf.item("skins", node["skin"])
    joints = skin.get("joints", [])
    bind = np.tile(np.eye(4).ravel(), (len(joints), 1))
    if "inverseBindMatrices" in skin:
        bind = gltf.accessor(skin["inverseBindMatrices"])
    if not joints or len(bind) < len(joints) or bind.shape[1] != 16:
        got = f"{len(joints)} and {len(bind)} x {bind.shape[1]} numbers"
        raise FaceError(f"{where}: skins[{node['skin']}]: wanted joints and a matrix for each, got {got}")
    bind = bind.reshape(-1, 4, 4).transpose(0, 2, 1)
    posed = np.stack([worlds.get(joint, np.eye(4)) @ bind[k] for k, joint in enumerate(joints)])
    index, weight = (_attribute(gltf, attributes, name, n, (4,), where) for name in ("JOINTS_0", "WEIGHTS_0"))
    weight = weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-9)
    index = np.clip(index, 0, len(joints) - 1).astype(int)
    out = np.zeros((n, 4, 4))
    for k in range(index.shape[1]):
        out += posed[index[:, k]] * weight[:, k, None, None]
    return out


def _colours(gltf: Gltf, attributes: dict[str, Any], n: int, where: str) -> tuple[Float64, Float64]:
    """Return the colours (n, 3) of vertices in sRGB 0..255, and their alpha (n,)."""
    light = np.ones((n, 4))
    if "COLOR_0" in attributes:
        found = _attribute(gltf, attributes, "COLOR_0", n, (3, 4), where)
        light[:, : found.shape[1]] = found
    return np.asarray(srgb(light[:, :3].astype(np.float32)), np.float64) * 255, light[:, 3]


def _texture_coordinates(
    gltf: Gltf, material: Material, attributes: dict[str, Any], n: int, where: str
) -> tuple[Float64, Material, tuple[str, ...]]:
    """Return the texture coordinates (n, 2) of a material, which loses its textures if there are none."""
    chart = material.chart
    if not material.textures or chart.name not in attributes:
        notes = (f"no {chart.name}: textures are left out",) if material.textures else ()
        return np.full((n, 2), 0.5), replace(material, textures=()), notes
    uv = _attribute(gltf, attributes, chart.name, n, (2,), where) * np.array(chart.scale)
    c, s = np.cos(chart.rotation), np.sin(chart.rotation)
    uv = np.clip(uv @ np.array([[c, -s], [s, c]]) + np.array(chart.offset), -FARTHEST, FARTHEST)
    for axis, wrap in enumerate(chart.wrap):
        if wrap == CLAMP:
            uv[:, axis] = np.clip(uv[:, axis], 0, 1)
    return uv, material, ()


def _is_glass(gltf: Gltf, material: Material, uv: Float64, alpha: Float64, triangles: Any) -> bool:
    """Return whether nearly all triangles are transparent."""
    if material.transmission > 1 - MAX_GLASS_ALPHA:
        return True
    if material.alpha != "BLEND" or not len(triangles):
        return False
    opacity = alpha[triangles].mean(axis=1) * material.colour[3]
    base = dict(material.textures).get("base")
    pixels = gltf.pixels(base.image) if base else None
    if pixels is not None:
        height, width = pixels.shape[:2]
        x, y = (uv[triangles].mean(axis=1) * (width, height)).astype(int).T
        opacity = opacity * pixels[y % height, x % width, 3] / 255
    return float(np.percentile(opacity, 90)) < MAX_GLASS_ALPHA


EXTENSION = "KHR_draco_mesh_compression"
UNDO = "npx @gltf-transform/cli copy HEAD.glb PLAIN.glb"


def unpack_primitive(gltf: Gltf, primitive: dict[str, Any], where: str) -> None:
    """Replace the accessors of a primitive by its decoded Draco data.

    Raises:
        FaceError: DracoPy is not installed, or the data are broken.
    """
    packed = primitive.get("extensions", {}).get(EXTENSION)
    if packed is None:
        return
    try:
        import DracoPy
    except ImportError:
        raise FaceError(
            f"{where}: Draco packs its geometry: pip install DracoPy, or undo it: {UNDO}"
        ) from None
    try:
        found = DracoPy.decode(gltf.view(packed.get("bufferView")))
        values = {one["unique_id"]: one["data"] for one in found.attributes}
        for name, number in packed.get("attributes", {}).items():
            gltf.put(primitive["attributes"][name], values[number])
        if "indices" in primitive:
            gltf.put(primitive["indices"], found.faces.reshape(-1, 1))
    except FaceError:
        raise
    except Exception as error:  # errors of DracoPy have no common class
        raise FaceError(f"{where}: Draco's data are broken ({error}); export the head again") from None
