"""The mesh that is drawn: a smooth subdivision of the one that is deformed, with places in maps, and hair."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from realizer.core.array_types import Bool, Float32, Int32, UInt8
from realizer.face.cards import Cards
from realizer.face.model import Face
from realizer.face.subdivision import subdivided

# How the surface of each part reflects light; parts that are not listed are skin.
SKIN, EYE, HAIR, WET, CLOTH = range(5)
KINDS: Mapping[str, int] = {
    "left_eye": EYE, "right_eye": EYE, "hair": HAIR, "brows": HAIR, "lashes": HAIR,
    "upper_teeth": WET, "lower_teeth": WET, "tongue": WET, "tears": WET, "shirt": CLOTH,
}  # fmt: skip
# Parts with an inside that is never seen; all others (hair, clothes, lashes) may be sheets.
SOLID = ("skin", "left_eye", "right_eye", "upper_teeth", "lower_teeth", "tongue")
GLOSSY = 0.8  # how much of its roughness a surface of gloss 1 loses
NEUTRAL = 4 / 1024  # u and v of the middle of the square in maps that changes nothing


@dataclass(frozen=True, eq=False)
class DrawnMesh:
    """What is drawn of a face: d vertices and t triangles.

    A vertex at a seam of the maps is there once for each of its places in them.
    """

    places: Any  # sparse (d, n) float32; drawn vertices = places @ vertices of the face
    # Sparse (d, n) float32; direction of hairs = strands @ vertices of the face, of any length; 0 where there
    # are no hairs.
    strands: Any
    ups: Any  # sparse (d, n) float32; drawn normals = ups @ normals of the face, at length 1
    triangles: Int32  # (t, 3) int32, counter-clockwise seen from outside, part after part
    uv: Float32  # (d, 2) float32, place in the maps, (0, 0) at the top left
    colours: UInt8  # (d, 3) uint8 sRGB, multiplied with the albedo map
    occlusion: Float32  # (d,) float32 0..1
    gloss: Float32  # (d,) float32 0..1
    kind: UInt8  # (d,) uint8, SKIN to CLOTH
    parts: Mapping[str, tuple[int, int]]  # name -> (first, last + 1) vertex
    two_sided: Bool  # (t,) whether a triangle is seen from both sides
    see_through: Bool  # (t,) whether the albedo map's alpha cuts holes into a triangle

    @property
    def roughness(self) -> Float32:
        """(d,) 0..1, which is multiplied with the map's."""
        return 1 - np.float32(GLOSSY) * self.gloss

    def __call__(self, vertices: Float32, normals: Float32, amounts: Float32) -> tuple[Float32, Float32]:
        """Return vertices (d, 3), and unit normals with an amount behind each (d, 4), float32.

        The normal of a vertex without a triangle points forward.

        Args:
            vertices, normals: (n, 3) of the face; amounts: (n,) at its vertices.
        """
        ups = self.ups @ np.hstack([normals, amounts[:, None]])
        sizes = np.sqrt(np.einsum("ij,ij->i", ups[:, :3], ups[:, :3]))
        ups[sizes == 0, 2] = 1
        ups[:, :3] /= np.where(sizes > 0, sizes, 1)[:, None]
        return self.places @ vertices, ups


@lru_cache(maxsize=16)
def drawn_mesh(face: Face) -> DrawnMesh:
    """Return what is drawn of a face."""
    import scipy.sparse as sp

    split = subdivided(face)
    fine, n = split.face, len(face.vertices)
    place = np.argsort(np.concatenate([split.vertex, split.middle]))
    stays = sp.eye_array(n, format="csr", dtype=np.float32)
    places, ups = (sp.vstack([stays, rows], format="csr")[place] for rows in (split.smooth, split.mean))
    corners = np.full((*face.triangles.shape, 3), NEUTRAL, np.float32)  # u, v, and whether there are holes
    corners[..., 2] = 0
    if face.maps:
        corners[..., :2], corners[..., 2] = face.maps.uv, face.maps.see_through[:, None]
    corners = split.corners(corners)
    order = np.argsort(fine.triangles.min(axis=1), kind="stable")
    corners = corners[order]
    source, uv, triangles = _cut(fine.triangles[order], corners[..., :2])
    parts = {
        name: (int(np.searchsorted(source, first)), int(np.searchsorted(source, last)))
        for name, (first, last) in fine.parts.items()
    }
    kind, solid = np.full(len(source), SKIN, np.uint8), np.zeros(len(source), bool)
    for name, ends in parts.items():
        kind[slice(*ends)] = KINDS.get(name, SKIN)
        solid[slice(*ends)] = name in SOLID
    bald = 0 * places[source]
    bald.eliminate_zeros()
    mesh = DrawnMesh(
        places[source], bald, ups[source], triangles, uv, fine.colours[source], fine.occlusion[source],
        fine.gloss[source], kind, parts,
        np.asarray(~solid[triangles].all(axis=1)), np.asarray(corners[:, 0, 2] > 0),
    )  # fmt: skip
    return mesh if face.cards is None else _with_cards(mesh, face.cards, n)


def _cut(triangles: Int32, corners: Float32) -> tuple[Int32, Float32, Int32]:
    """Return the vertex (d,) and the place (d, 2) in the maps of each drawn vertex, and the triangles."""
    steps = np.rint(corners * 0x3FFFF).astype(np.int64).clip(0, 0x3FFFF)
    keys = (triangles.astype(np.int64) << 36) + (steps[..., 0] << 18) + steps[..., 1]
    unique, index = np.unique(keys, return_inverse=True)
    uv = np.stack([unique >> 18 & 0x3FFFF, unique & 0x3FFFF], axis=1) / np.float32(0x3FFFF)
    return (unique >> 36).astype(np.int32), uv.astype(np.float32), index.reshape(-1, 3).astype(np.int32)


def _with_cards(mesh: DrawnMesh, cards: Cards, n: int) -> DrawnMesh:
    """Return the mesh with hair, in parts named hair_cards and the like."""
    import scipy.sparse as sp

    first, count = len(mesh.uv), len(cards.uv)

    def rows(weights: Float32) -> Any:
        card, column = np.nonzero(weights)
        return sp.csr_matrix((weights[card, column], (card, cards.roots[card, column])), (count, n))

    places, ups = (
        sp.vstack([whole, rows(own)], format="csr").astype(np.float32)
        for whole, own in ((mesh.places, cards.weights), (mesh.ups, cards.ups))
    )
    sides = np.ones(len(cards.triangles), bool)
    strands = sp.vstack([mesh.strands, _along_v(cards) @ places[first:]], format="csr").astype(np.float32)
    return DrawnMesh(
        places, strands, ups,
        np.concatenate([mesh.triangles, cards.triangles + first]).astype(np.int32),
        np.concatenate([mesh.uv, cards.uv]),
        np.concatenate([mesh.colours, cards.colours]),
        np.concatenate([mesh.occlusion, cards.occlusion]),
        np.concatenate([mesh.gloss, cards.gloss]),
        np.concatenate([mesh.kind, np.full(count, HAIR, np.uint8)]),
        {**mesh.parts, **{f"{name}_cards": (first + a, first + b) for name, (a, b) in cards.parts.items()}},
        np.concatenate([mesh.two_sided, sides]),
        np.concatenate([mesh.see_through, sides]),
    )  # fmt: skip


def _along_v(cards: Cards) -> Any:
    """Return a sparse matrix (c, c): times the places of cards' vertices, the direction in which v grows."""
    import scipy.sparse as sp

    a, b, c = cards.triangles.T
    (u, v), (s, t) = ((cards.uv[end] - cards.uv[a]).T for end in (b, c))
    # On a triangle that direction is u (c - a) - s (b - a), over u t - s v; its area weighs it.
    way = np.sign(u * t - s * v)
    weights = np.concatenate([(s - u) * way, -s * way, u * way])
    corners = np.concatenate([a, b, c])
    rows = np.concatenate([np.tile(end, 3) for end in (a, b, c)])
    entries = np.tile(weights, 3), (rows, np.tile(corners, 3))
    return sp.csr_matrix(entries, (len(cards.uv), len(cards.uv)))
