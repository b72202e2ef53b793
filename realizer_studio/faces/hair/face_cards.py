"""The cards of a face: hair, brows, lashes and beard, and a writer of their file."""

import zlib
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from realizer.core.array_types import Float64, Int32
from realizer.face.cards import FILE, Cards
from realizer.face.mesh_geometry import (
    FINE,
    edges_of,
    nearest_points,
    part_triangles,
    triangle_normals,
    vertex_normals,
)
from realizer.face.model import Face
from realizer.face.subdivision import subdivided
from realizer_studio.faces.face_files import to_bytes
from realizer_studio.faces.hair.brows import brow
from realizer_studio.faces.hair.cards import Patch, joined
from realizer_studio.faces.hair.facial_hair import BEARD_CARDS, Margin, beard, lashes
from realizer_studio.faces.hair.grow import hair, tints
from realizer_studio.faces.hair.style import style_of
from realizer_studio.faces.person.recipe import Recipe, appearance_of
from realizer_studio.faces.person.scalp import Scalp

DEEP, CLEARANCE = 0.012, 0.0002  # m below the skin down to which hair is lifted; its height above the skin


def face_cards(face: Face, recipe: Recipe, margins: Sequence[Margin], bearded: Float64) -> Cards:
    """Return the cards of a face that was built without cards.

    Args:
        margins: the edges of the lids.
        bearded: (n,) 0..1, the weight of a beard on the skin.
    """
    look, colours = appearance_of(recipe.look), recipe.colours
    points = {name: np.array(position, float) for name, position in face.points.items()}
    at, fine = face.vertices.astype(float), subdivided(face).face
    skin = at, face.triangles[(face.triangles < face.parts["skin"][1]).all(axis=1)]
    first, last = fine.parts["skin"]
    drawn = fine.vertices[first:last].astype(float), part_triangles(fine.triangles, (first, last))
    style = style_of(recipe.hair)
    scalp = Scalp(*drawn, points, style.line, style.rise)
    rng = np.random.default_rng(zlib.crc32(face.name.encode()))
    groups = {
        "hair": [hair(scalp, drawn[1], style, colours["hair"], rng)],
        "brows": [brow(skin, drawn, points, side, colours["brows"], look, rng) for side in (1, -1)],
        "lashes": [lashes(at, margin, colours["lashes"], look.lash, rng) for margin in margins],
    }
    if look.beard:
        tint = tints(style, colours["hair"], BEARD_CARDS, rng)
        groups["beard"] = [beard(skin, scalp, bearded, points, look.beard, tint, rng)]
    patches = {name: joined(group) for name, group in groups.items()}
    patches |= {name: _lifted(patches[name], *drawn) for name in ("hair", "beard") if name in patches}
    if look.beard:
        patches["beard"] = _bound_below(patches["beard"], skin[0][: face.parts["skin"][1]])
    ends = np.cumsum([0] + [len(patch.positions) for patch in patches.values()]).tolist()
    parts = dict(zip(patches, pairwise(ends), strict=True))
    turns = face.basis["head"][:, 0]
    return bind(joined(list(patches.values())), at, face.triangles, scalp, turns, parts)


def _lifted(patch: Patch, at: Float64, triangles: Int32) -> Patch:
    """Return the patch with vertices below the skin lifted off it."""
    depth, out = depths(patch.positions, at, without_rim(triangles), DEEP)
    deep = np.maximum(depth, 0)[:, None]
    far = np.maximum(np.linalg.norm(out, axis=1), 1e-9)[:, None]
    return replace(patch, positions=patch.positions + (depth > 0)[:, None] * out * (deep + CLEARANCE) / far)


def _bound_below(patch: Patch, at: Float64) -> Patch:
    """Return the patch with vertices that follow the skin (n, 3) below them instead of their roots' skin."""
    distance, nearest = (np.asarray(found) for found in cKDTree(at).query(patch.positions, 3))
    shares = 1 / (distance + CLEARANCE)
    return replace(patch, skin=nearest.astype(np.int32), shares=shares / shares.sum(axis=1, keepdims=True))


def write_cards(folder: Path, cards: Cards) -> None:
    """Write cards.npz, and the parts of the cards to the end of face.toml."""
    np.savez_compressed(
        folder / FILE,
        roots=cards.roots,
        weights=cards.weights,
        ups=cards.ups,
        triangles=cards.triangles,
        uv=np.rint(cards.uv * 65535).astype(np.uint16),
        colours=cards.colours,
        occlusion=to_bytes(cards.occlusion * 255),
        gloss=to_bytes(cards.gloss * 255),
    )
    lines = ["", "[cards]  # first vertex, last + 1"]
    lines += [f"{name} = [{first}, {last}]" for name, (first, last) in cards.parts.items()]
    with (folder / "face.toml").open("a", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")


# Directions from the skull's middle to vertices that only head rotations move: left, right, behind, above.
ANCHORS = (0.85, 0.30, -0.45), (-0.85, 0.30, -0.45), (0.0, 0.25, -1.0), (0.0, 1.0, -0.3)
HANGS = -0.08  # m; height relative to the eyes below which hair hangs
STATIC = 0.02  # share of the head's turn below which a vertex belongs to the bust


def bind(
    patch: Patch,
    at: Float64,
    triangles: Int32,
    scalp: Scalp,
    turns: Float64,
    parts: dict[str, tuple[int, int]],
) -> Cards:
    """Return cards that follow the mesh.

    A vertex of a card depends on seven vertices of the mesh: three of the skin around its root, and four of
    the skull, which carry its offset from the root in the frame of the head. Hair on the skull has no root in
    the skin and depends on the four; the lower it hangs, the more a vertex at the foot of the neck replaces
    their mean, so that it hangs between head and bust.

    Args:
        at: (n, 3) metres, the mesh; turns: (n,) 0..1, the share of the head's rotation for each vertex.
        scalp: of the subdivided skin.
        parts: name -> (first, last + 1) of the patch.
    """
    normals = vertex_normals(at, triangles)
    skull, foot = _anchors(at, scalp, turns)
    rooted = patch.skin[:, 0] >= 0
    skin = np.where(rooted[:, None], patch.skin, foot)
    shares = patch.shares.copy()
    low = (HANGS - patch.positions[:, 1]) / (HANGS - at[foot, 1])
    shares[:, 0] = np.where(rooted, shares[:, 0], np.clip(low, 0, 1))
    hung = np.where(rooted, 0, shares[:, 0])[:, None]
    middle = at[skull].mean(axis=0)
    free = patch.positions - (at[skin] * shares[..., None]).sum(axis=1) + hung * middle
    targets = np.c_[free, 1 - shares.sum(axis=1, keepdims=True) + hung]
    weights = targets @ np.linalg.inv(np.c_[at[skull], np.ones(4)]) - hung / 4
    turned = patch.normals @ np.linalg.pinv(normals[skull])
    return Cards(
        roots=np.c_[skin, np.tile(skull, (len(skin), 1))].astype(np.int32),
        weights=np.c_[shares, weights].astype(np.float32),
        ups=np.c_[patch.shares, np.where(rooted[:, None], 0, turned)].astype(np.float32),
        triangles=patch.triangles,
        uv=patch.uv.astype(np.float32),
        colours=np.clip(np.rint(patch.colours), 0, 255).astype(np.uint8),
        occlusion=patch.occlusion.astype(np.float32),
        gloss=patch.gloss.astype(np.float32),
        parts=parts,
    )


def _anchors(at: Float64, scalp: Scalp, turns: Float64) -> tuple[Int32, int]:
    """Return four vertices of the skull, and one at the foot of the neck that head rotations do not move."""
    directions = np.array(ANCHORS)
    turning, static = np.flatnonzero(turns > 0.999), np.flatnonzero(turns < STATIC)
    skull = turning[
        cKDTree(at[turning]).query(scalp.skull(directions / np.linalg.norm(directions, axis=1)[:, None]))[1]
    ]
    foot = static[np.argmax(at[static, 1] - np.abs(at[static, 0]))]
    return skull.astype(np.int32), int(foot)


AROUND = 16  # nearest triangles that are examined
SAME = 1e-7  # m
MOST = 0.004  # m; the largest distance from the centre of an examined triangle to its corners


def without_rim(triangles: Int32) -> Int32:
    """Return the triangles (k, 3) that do not touch the boundary, beyond which depth is undefined."""
    pairs, counts = edges_of(triangles)
    return triangles[~np.isin(triangles, pairs[counts == 1]).any(axis=1)]


def depths(positions: Float64, at: Float64, triangles: Int32, near: float) -> tuple[Float64, Float64]:
    """Return the depth of points (k, 3) behind triangles (m, 3) of vertices `at`, and offsets to the surface.

    The sign is that of the angle-weighted normal (Baerentzen and Aanaes 2005, "Signed distance computation
    using the angle weighted pseudonormal"), which is also correct at edges and corners.

    Returns:
        (k,) metres, negative in front of the surface, -inf farther than `near` from it; and (k, 3) metres,
        the offset to the nearest point of the surface.
    """
    from trimesh import triangles as shapes

    angles: Any = shapes.angles
    depth, offsets = np.full(len(positions), -np.inf), np.zeros(positions.shape)
    corners = at[triangles]
    nearby: Any = cKDTree(corners.mean(axis=1)).query(positions, AROUND, distance_upper_bound=near + MOST)
    distances, found = nearby
    close = np.flatnonzero(np.isfinite(distances[:, 0]))
    if not len(close):
        return depth, offsets
    valid = np.isfinite(distances[close])
    found = np.where(valid, found[close], found[close, :1])
    close_positions = positions[close]
    points = nearest_points(corners[found], close_positions)
    lengths = np.linalg.norm(points - close_positions[:, None], axis=2)
    least = lengths.min(axis=1)
    # All triangles that contain the nearest point, weighted by their angle there.
    touch = valid & (lengths < least[:, None] + SAME)
    at_corner = np.linalg.norm(corners[found] - points[:, :, None], axis=3) < SAME
    at_angle = (np.nan_to_num(angles(FINE * corners))[found] * at_corner).sum(axis=2)
    angle = np.where(at_corner.any(axis=2), at_angle, np.pi)
    normals = triangle_normals(at, triangles)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-18)[:, None]
    up = ((touch * angle)[..., None] * normals[found]).sum(axis=1)
    out = points[np.arange(len(close)), lengths.argmin(axis=1)] - close_positions
    inside = (out * up).sum(axis=1) > 0
    depth[close] = np.where(least > near, -np.inf, np.where(inside, least, -least))
    offsets[close] = out
    return depth, offsets
