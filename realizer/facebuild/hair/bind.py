"""What each vertex of a card follows: vertices of the mesh, with weights that may be negative."""

from __future__ import annotations

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.cards import Cards
from realizer.face.mesh_geometry import vertex_normals
from realizer.facebuild.hair.cards import Patch
from realizer.facebuild.person.scalp import Scalp

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
