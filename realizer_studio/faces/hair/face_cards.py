"""All cards of a face: hair, brows, lashes and beard, outside the skin, and the file that holds them."""

import zlib
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

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

DEEP, OFF = 0.012, 0.0002  # m under the skin that hair is looked for, and above it that it is put


def face_cards(face: Face, recipe: Recipe, margins: Sequence[Margin], bearded: Float64) -> Cards:
    """Return the cards of a face that was built without them.

    Args:
        margins: the edges of the lids.
        bearded: (n,) 0..1, where a beard grows on the skin.
    """
    look, colours = appearance_of(recipe.look), recipe.colours
    points = {name: np.array(place, float) for name, place in face.points.items()}
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
        patches["beard"] = _lying(patches["beard"], skin[0][: face.parts["skin"][1]])
    ends = np.cumsum([0] + [len(patch.places) for patch in patches.values()]).tolist()
    parts = dict(zip(patches, pairwise(ends), strict=True))
    turns = face.basis["head"][:, 0]
    return bind(joined(list(patches.values())), at, face.triangles, scalp, turns, parts)


def _lifted(patch: Patch, at: Float64, triangles: Int32) -> Patch:
    """Return the patch with what lies in the skin lifted off it."""
    depth, out = depths(patch.places, at, without_rim(triangles), DEEP)
    deep = np.maximum(depth, 0)[:, None]
    far = np.maximum(np.linalg.norm(out, axis=1), 1e-9)[:, None]
    return replace(patch, places=patch.places + (depth > 0)[:, None] * out * (deep + OFF) / far)


def _lying(patch: Patch, at: Float64) -> Patch:
    """Return the patch with vertices that follow the skin (n, 3) below them, not that at their roots."""
    from scipy.spatial import cKDTree

    off, near = (np.asarray(found) for found in cKDTree(at).query(patch.places, 3))
    shares = 1 / (off + OFF)
    return replace(patch, skin=near.astype(np.int32), shares=shares / shares.sum(axis=1, keepdims=True))


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


# Directions from the skull's middle to vertices that only the head's turns move: left, right, behind, above.
ANCHORS = (0.85, 0.30, -0.45), (-0.85, 0.30, -0.45), (0.0, 0.25, -1.0), (0.0, 1.0, -0.3)
HANGS = -0.08  # m; the height from the eyes below which hair hangs
STILL = 0.02  # share of the head's turn below which a vertex belongs to the bust


def bind(
    patch: Patch,
    at: Float64,
    triangles: Int32,
    scalp: Scalp,
    turns: Float64,
    parts: dict[str, tuple[int, int]],
) -> Cards:
    """Return cards that follow the mesh.

    Seven vertices lead each vertex of a card: three around its root in the skin, and four of the skull, by
    which the rest is a fixed way off the root in the head's frame. Hair on the skull has no root in the skin:
    the four lead its whole place, and below the skull a vertex at the foot of the neck more and more instead
    of the middle of the four, so that hair there hangs between head and bust.

    Args:
        at: (n, 3) metres, the mesh; turns: (n,) 0..1, how far each vertex turns with the head.
        scalp: of the skin that is drawn.
        parts: name -> (first, last + 1) of the patch.
    """
    ups = vertex_normals(at, triangles)
    skull, foot = _anchors(at, scalp, turns)
    rooted = patch.skin[:, 0] >= 0
    skin = np.where(rooted[:, None], patch.skin, foot)
    shares = patch.shares.copy()
    low = (HANGS - patch.places[:, 1]) / (HANGS - at[foot, 1])
    shares[:, 0] = np.where(rooted, shares[:, 0], np.clip(low, 0, 1))
    hung = np.where(rooted, 0, shares[:, 0])[:, None]
    middle = at[skull].mean(axis=0)
    free = patch.places - (at[skin] * shares[..., None]).sum(axis=1) + hung * middle
    wanted = np.c_[free, 1 - shares.sum(axis=1, keepdims=True) + hung]
    weights = wanted @ np.linalg.inv(np.c_[at[skull], np.ones(4)]) - hung / 4
    turned = patch.ups @ np.linalg.pinv(ups[skull])
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
    """Return four vertices of the skull, and one at the foot of the neck that stays as the head turns."""
    from scipy.spatial import cKDTree

    ways = np.array(ANCHORS)
    turning, still = np.flatnonzero(turns > 0.999), np.flatnonzero(turns < STILL)
    skull = turning[cKDTree(at[turning]).query(scalp.skull(ways / np.linalg.norm(ways, axis=1)[:, None]))[1]]
    foot = still[np.argmax(at[still, 1] - np.abs(at[still, 0]))]
    return skull.astype(np.int32), int(foot)


AROUND = 16  # number of nearest triangles to look at
SAME = 1e-7  # m
MOST = 0.004  # m from a triangle's middle to its corners that are looked at


def without_rim(triangles: Int32) -> Int32:
    """Return the triangles (k, 3) that do not touch the rim of their surface, beyond which is no inside."""
    pairs, counts = edges_of(triangles)
    return triangles[~np.isin(triangles, pairs[counts == 1]).any(axis=1)]


def depths(places: Float64, at: Float64, triangles: Int32, near: float) -> tuple[Float64, Float64]:
    """Return how deep places (k, 3) lie behind triangles (m, 3) of vertices `at`, and how they get out.

    The sign is that of the angle-weighted normal (Baerentzen and Aanaes 2005, "Signed distance computation
    using the angle weighted pseudonormal"), which is right at edges and corners, too.

    Returns:
        (k,) metres, negative in front of the surface, -inf farther than `near` from it; and (k, 3) metres,
        the way to the nearest point of the surface.
    """
    from scipy.spatial import cKDTree
    from trimesh import triangles as shapes

    angles: Any = shapes.angles
    depth, way = np.full(len(places), -np.inf), np.zeros(places.shape)
    corners = at[triangles]
    nearby: Any = cKDTree(corners.mean(axis=1)).query(places, AROUND, distance_upper_bound=near + MOST)
    away, found = nearby
    close = np.flatnonzero(np.isfinite(away[:, 0]))
    if not len(close):
        return depth, way
    known = np.isfinite(away[close])
    found = np.where(known, found[close], found[close, :1])
    here = places[close]
    points = nearest_points(corners[found], here, FINE)
    off = np.linalg.norm(points - here[:, None], axis=2)
    least = off.min(axis=1)
    # All triangles that have the nearest point, each by its angle there.
    touch = known & (off < least[:, None] + SAME)
    at_corner = np.linalg.norm(corners[found] - points[:, :, None], axis=3) < SAME
    at_angle = (np.nan_to_num(angles(FINE * corners))[found] * at_corner).sum(axis=2)
    angle = np.where(at_corner.any(axis=2), at_angle, np.pi)
    ups = triangle_normals(at, triangles)
    ups /= np.maximum(np.linalg.norm(ups, axis=1), 1e-18)[:, None]
    up = ((touch * angle)[..., None] * ups[found]).sum(axis=1)
    out = points[np.arange(len(close)), off.argmin(axis=1)] - here
    inside = (out * up).sum(axis=1) > 0
    depth[close] = np.where(least > near, -np.inf, np.where(inside, least, -least))
    way[close] = out
    return depth, way
