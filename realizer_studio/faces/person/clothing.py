"""Clothing cut from and lifted above the body, and glasses: two rims, a bridge and two temples."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.core.errors import FaceError
from realizer.core.similar import did_you_mean, similar
from realizer.face.mesh_geometry import edges_of, grid, vertex_normals
from realizer.tables import toml_table
from realizer_studio.faces.decimate import decimate
from realizer_studio.faces.parts import Part, Submesh, smooth

COLLAR = 0.486  # heights of the face, hairline to chin, from the chin down to the front of the collar
TILT = 0.42  # slope of the plane of the collar, which rises backwards
POINT = 0.045  # m; half width of the point of a collar


def under_collar(at: Float64, chin: Float64, face: float, low: float = 0.0, point: float = 0.0) -> Float64:
    """Return the distance of points below the neckline in metres.

    Args:
        chin: (3,) metres; face: metres from hairline to chin.
        low, point: metres by which the collar is lower, and by which its middle in front extends down.
    """
    front = np.maximum(1 - np.abs(at[:, 0]) / POINT, 0) * smooth(at[:, 2] - chin[2], -0.09, -0.05)
    collar = chin[1] - COLLAR * face - low - point * front
    return np.asarray(collar - (at[:, 1] + TILT * (at[:, 2] + 0.01)))


def shirt(skin: Submesh, base: Float64, low: Float64, colour: list[float]) -> Part:
    """Return a shirt, which is the lifted body below the neckline; `low`: (n,) as from `under_collar`."""
    chosen = (low > -0.03)[skin.triangles].any(axis=1)
    low = low[np.unique(skin.triangles[chosen])]
    piece = skin.with_triangles(chosen)
    piece, mix = piece.clipped(low)
    low = np.asarray(mix @ low)
    at = piece.positions(base)
    normals = vertex_normals(at, piece.triangles)
    thick = 0.0028 + 0.0016 * smooth(low, 0.010, 0.004)
    piece = piece.moved(normals * thick[:, None])
    tint = np.repeat(np.array([colour], float), len(piece), 0)
    tint *= (1 - 0.22 * smooth(low, 0.012, 0.009))[:, None]
    return Part("shirt", piece, piece.positions(base), piece.triangles, tint, np.zeros(len(piece)))


# Baked light below which a surface is invisible, and metres by which decimation may change surfaces.
HIDDEN = 0.27
UNSEEN, EVEN, BUST, CLOTH, DEEP_CLOTH = 0.003, 0.0006, 0.0005, 0.0008, 0.003


def decimate_hidden(part: Part, keep: Any, even: Any, chin: float, floor: float) -> Part:
    """Return a part with fewer vertices where it is hidden, evenly curved or far from the face.

    Args:
        part: with baked occlusion.
        keep: (n,) vertices that stay; even: (n,) vertices of ears and scalp.
        chin, floor: metres, heights of the chin and of the bust's lower end.
    """
    at, light = part.vertices, np.asarray(part.occlusion)
    if part.name == "skin":
        tolerance = np.where(light < HIDDEN, UNSEEN, 0)
        tolerance = np.maximum(tolerance, np.where(even, EVEN, 0))
        tolerance = np.maximum(tolerance, np.where(at[:, 1] < chin - 0.012, BUST, 0))
        pairs, count = edges_of(part.triangles)
        tolerance[pairs[count == 1].ravel()] = 0
    elif part.name == "shirt":
        tolerance = np.where(at[:, 1] < floor + 0.05, DEEP_CLOTH, CLOTH)
    else:
        tolerance = np.full(len(at), BUST)
    return part.subset(*decimate(at, part.triangles, np.where(keep, 0, tolerance)))


AROUND, RIM, TEMPLE = 6, 28, 9  # vertices around a tube, along a rim and along a temple
VERTEX_DISTANCE = 0.013  # m from the cornea to the lens
CLEAR = 0.0022  # m between a temple and the skin
NEAR = 0.007  # m; the radius in which skin is searched around a point of a temple
HOOK = np.array([0.0, -0.020, -0.013])  # m from the top of the ear to the end of the temple


def glasses_of(table: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the numbers of a pair of glasses from [glasses] of a recipe; None if it is empty.

    Raises:
        FaceError: no such style or figure, or a value out of range.
    """
    if not table:
        return None
    styles = toml_table("glasses.toml")
    if (style := table.get("style")) not in styles:
        raise FaceError(f"glasses: style: wanted one of {', '.join(styles)}, got {style!r}")
    defaults, changes = styles[style], {key: value for key, value in table.items() if key != "style"}
    for key, value in changes.items():
        if key not in defaults:
            hint = did_you_mean(similar(key, defaults, 1))
            raise FaceError(f"glasses: wanted one of style, {', '.join(defaults)}, got {key!r}{hint}")
        kind = list if key == "colour" else (int, float)
        if not isinstance(value, kind) or isinstance(value, bool):
            raise FaceError(f"glasses: {key}: wanted {defaults[key]!r} or the like, got {value!r}")
    return {**defaults, **changes}


def glasses(
    figures: Mapping[str, Any], skin: Float64, eyes: list[tuple[Float64, float]], ears: list[Any]
) -> Part:
    """Return the glasses of a head, which turn with it.

    Args:
        figures: as `glasses_of` returns them.
        skin: (n, 3) metres; eyes: centre and radius of both eyeballs; ears: tops of both (3,).
    """
    front = max(centre[2] + radius for centre, radius in eyes) + VERTEX_DISTANCE
    turn = np.linspace(0, 2 * np.pi, RIM, endpoint=False)
    # A superellipse: |x / width|^p + |y / height|^p = 1.
    bent = 2 / figures["power"]
    x = figures["width"] * np.sign(np.cos(turn)) * np.abs(np.cos(turn)) ** bent
    y = figures["height"] * np.sign(np.sin(turn)) * np.abs(np.sin(turn)) ** bent
    tubes, inner, outer = [], [], []
    for (centre, _), ear in zip(eyes, ears, strict=True):
        side = np.sign(centre[0])
        # Lenses wrap around the face a little, and stand low on the eyes.
        rim = np.stack([centre[0] + x, centre[1] - 0.002 + y, front - 0.10 * np.abs(centre[0] + x)], axis=1)
        tubes.append(_tube(rim, figures["thick"], closed=True))
        height = centre[1] + figures["bridge"]
        beside = rim[np.argsort(np.abs(rim[:, 1] - height))[:4]]
        inner.append(beside[np.argmin(np.abs(beside[:, 0]))])
        outer.append(beside[np.argmax(np.abs(beside[:, 0]))])
        tubes.append(_tube(_temple(outer[-1], np.asarray(ear, float), side, skin), figures["thick"]))
    middle = (inner[0] + inner[1]) / 2 + [0, 0.0025, 0.001]
    left, right = ((end + middle) / 2 for end in inner)
    tubes.append(_tube(np.array([inner[0], left, middle, right, inner[1]]), figures["thick"]))
    first = np.cumsum([0, *(len(points) for points, _ in tubes[:-1])])
    vertices = np.concatenate([points for points, _ in tubes])
    triangles = np.concatenate([sheet + start for (_, sheet), start in zip(tubes, first, strict=True)])
    colours = np.tile(np.array(figures["colour"], float), (len(vertices), 1))
    shine = np.full(len(vertices), float(figures["gloss"]))
    return Part("glasses", None, vertices, triangles.astype(np.int32), colours, shine)


def _temple(hinge: Float64, ear: Float64, side: float, skin: Float64) -> Float64:
    """Return the path from a rim's outer side to behind the ear, outside the skin."""
    share = np.linspace(0, 1, TEMPLE)[:, None]
    path = hinge + (np.add(ear, (0, 0.002, 0)) - hinge) * share
    path[1:3, 0] += side * 0.004  # the hinge stands out
    for point in path[1:]:
        near = (np.abs(skin[:, 1:] - point[1:]) < NEAR).all(axis=1) & (skin[:, 0] * side > 0)
        if near.any():
            point[0] = side * max(side * point[0], float(np.abs(skin[near, 0]).max()) + CLEAR)
    # The last points lie between ear and head, so the ear must not push them out.
    path[-2:, 0] = ear[0]
    return np.vstack([path, path[-1] + HOOK])


def _tube(path: Float64, radius: float, closed: bool = False) -> tuple[Float64, Any]:
    """Return vertices and triangles of a tube of that radius about a path (k, 3), with open ends."""
    ends = (path[-1], path[0]) if closed else (2 * path[0] - path[1], 2 * path[-1] - path[-2])
    extended = np.vstack([ends[0], path, ends[1]])
    along = extended[2:] - extended[:-2]
    along /= np.linalg.norm(along, axis=1)[:, None]
    across = np.cross(along, [0.0, 0.0, 1.0] if closed else [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across, axis=1)[:, None]
    up = np.cross(across, along)
    angle = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
    rings = path[:, None] + radius * (
        np.cos(angle)[None, :, None] * across[:, None] + np.sin(angle)[None, :, None] * up[:, None]
    )
    points = np.concatenate([rings, rings[:1]]) if closed else rings
    sheet = grid(len(points), AROUND, closed=True)
    if closed:
        sheet = sheet % (len(rings) * AROUND)
    return rings.reshape(-1, 3), sheet
