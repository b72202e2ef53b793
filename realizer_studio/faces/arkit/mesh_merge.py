"""Merging of surface pieces into one mesh with ARKit's shape names, and naming of parts."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import Any

import numpy as np
import scipy.sparse as sp

from realizer.core.array_types import Float64, Int32
from realizer.core.colours import linear, srgb
from realizer.core.errors import FaceError
from realizer.face.mesh_geometry import components, half_edges
from realizer.tables import csv_rows
from realizer.tables.arkit_names import canonical
from realizer_studio.faces.arkit.materials import Material
from realizer_studio.faces.arkit.scene import Piece

LARGEST = 1e6  # times the size of the head; int64 holds such coordinates in steps of `SAME`
SAME = 2e-6  # of the size of the head; nearer vertices that move alike are merged


@dataclass(frozen=True, eq=False)
class Surface:
    """A head as one mesh."""

    vertices: Float64  # (n, 3)
    triangles: Int32  # (m, 3)
    colours: Float64  # (n, 3) sRGB 0..255, of the vertices alone
    piece: Int32  # (n,) the piece of each vertex
    names: tuple[tuple[str, str, str], ...]  # of each piece's material, mesh and node
    moves: Mapping[str, Float64]  # ARKit's name -> (n, 3), at weight 1
    uv: Float64  # (m, 3, 2) texture coordinates of the triangles' corners
    material: Int32  # (m,) index of each triangle's material
    materials: tuple[Material, ...]

    def move(self, name: str) -> Float64:
        """Return the displacement (n, 3) of a shape, or zeros if the head lacks it."""
        return self.moves.get(name, np.zeros_like(self.vertices))

    def total(self, *names: str) -> Float64 | None:
        """Return the sum of shapes, (n, 3), or None if one is missing."""
        if any(name not in self.moves for name in names):
            return None
        return np.asarray(np.sum([self.moves[name] for name in names], axis=0))

    def centre(self, moves: Iterable[Float64]) -> Float64:
        """Return the centroid (3,) of vertices, weighted by their squared displacements in shapes (n, 3)."""
        weight = np.sum([(move**2).sum(axis=1) for move in moves], axis=0)
        return np.asarray((self.vertices * weight[:, None]).sum(axis=0) / weight.sum())

    def components(self) -> Int32:
        """Return the number of the connected piece of each vertex, (n,)."""
        return components(half_edges(self.triangles), len(self.vertices))

    def painted_colours(self) -> Float64:
        """Return the colours (n, 3) of vertices multiplied by those of their materials, without textures."""
        factors = np.array([material.colour[:3] for material in self.materials], np.float32)
        share = np.ones((len(self.vertices), 3), np.float32)
        share[self.triangles] = factors[self.material][:, None]
        return np.asarray(srgb(linear(self.colours) * share), np.float64) * 255

    def subset(self, vertices: Any) -> Surface:
        """Return the surface of the given vertices, in their order, with the triangles between them."""
        index = np.asarray(vertices)
        new_index = np.full(len(self.vertices), -1)
        new_index[index] = np.arange(len(index))
        corners = new_index[self.triangles]
        keep = (corners >= 0).all(axis=1)
        return self._taken(index, corners[keep], self.uv[keep], self.material[keep])

    def _taken(self, index: Any, triangles: Any, uv: Any, material: Any) -> Surface:
        return replace(
            self,
            vertices=self.vertices[index],
            triangles=triangles.astype(np.int32),
            colours=self.colours[index],
            piece=self.piece[index],
            uv=uv,
            material=material,
            moves={name: move[index] for name, move in self.moves.items()},
        )


def merge_pieces(pieces: Sequence[Piece]) -> Surface:
    """Return the pieces as one surface, without transparent pieces.

    Raises:
        FaceError: all pieces are transparent, or numbers are not finite or far larger than the head.
    """
    pieces = [piece for piece in pieces if not piece.glass]
    if not pieces:
        raise FaceError("wanted surfaces that can be seen, got transparent ones alone; export the head again")
    counts = np.cumsum([0] + [len(piece.vertices) for piece in pieces])
    total = int(counts[-1])
    moves: dict[str, Float64] = {}
    for piece, first in zip(pieces, counts, strict=False):
        for given, move in piece.moves.items():
            name = canonical(given)
            if name is not None:
                # The halves of a shape are added.
                moves.setdefault(name, np.zeros((total, 3)))[first : first + len(move)] += move
    materials = tuple(dict.fromkeys(piece.material for piece in pieces))
    which = [materials.index(piece.material) for piece in pieces]
    surface = Surface(
        vertices=np.concatenate([piece.vertices for piece in pieces]),
        triangles=np.concatenate([p.triangles + f for p, f in zip(pieces, counts, strict=False)]),
        colours=np.concatenate([piece.colours for piece in pieces]),
        piece=np.repeat(np.arange(len(pieces)), np.diff(counts)).astype(np.int32),
        names=tuple(piece.names for piece in pieces),
        uv=np.concatenate([piece.uv[piece.triangles] for piece in pieces]),
        material=np.repeat(which, [len(piece.triangles) for piece in pieces]).astype(np.int32),
        materials=materials,
        moves=moves,
    )
    return _welded(surface)


def _welded(surface: Surface) -> Surface:
    """Merge vertices of a part with one position and equal displacements, which texture seams double.

    Hair that is rooted in a vertex of the skin remains a separate part.
    """
    values = np.concatenate([surface.vertices, *surface.moves.values()], axis=1)
    is_finite = bool(np.isfinite(values).all())
    size = (float(np.ptp(surface.vertices, axis=0).max()) or 1.0) if is_finite else 0.0
    if not is_finite or np.abs(values).max() > LARGEST * size:
        expected = f"wanted finite places and moves, up to {LARGEST:g} times the size of the head"
        raise FaceError(f"{expected}, got NaN, infinity or more; export the head again")
    parts = [part_of(names) or "skin" for names in surface.names]
    part = np.array([parts.index(name) for name in parts])[surface.piece]
    key = np.column_stack([part, np.rint(values / (size * SAME)).astype(np.int64)])
    _, first, group = np.unique(key, axis=0, return_index=True, return_inverse=True)
    group = group.ravel()
    corners = group[surface.triangles]
    complete = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    corners = corners[complete]
    count = np.bincount(group)[:, None]
    colours = np.stack([np.bincount(group, surface.colours[:, k]) for k in range(3)], 1) / count
    # Vertices without triangles are dropped.
    taken = surface._taken(first, corners, surface.uv[complete], surface.material[complete])
    return replace(taken, colours=colours).subset(np.unique(corners))


@dataclass(frozen=True)
class _Rule:
    part: str
    pattern: str


_rules = cache(partial(csv_rows, "parts.csv", _Rule, __package__))


def part_of(names: tuple[str, ...]) -> str:
    """Return the part that the names of a material, a mesh and a node suggest, or "".

    Names for skin are used last, because whole heads, with all their parts, have such names.
    """
    weak = ""
    for name in names:
        rule = next((rule for rule in _rules() if re.search(rule.pattern, name.lower())), None)
        if rule is not None and rule.part != "skin":
            return rule.part
        weak = weak or (rule.part if rule is not None else "")
    return weak


def cut(surface: Surface, height: Float64) -> Surface:
    """Return the surface where `height` (n,) is above zero, cut along the line of zeros."""
    if (height > 0).all():
        return surface
    from realizer_studio.faces.parts import SLIVER, Submesh

    n = len(surface.vertices)
    flat = Submesh(sp.csr_matrix(sp.eye_array(n)), np.zeros((n, 3)), surface.triangles)
    piece, mix = flat.clipped(height)
    # `clipped` keeps the order of triangles, and makes two of a triangle with two corners inside.
    inside = (height > -SLIVER)[surface.triangles].sum(axis=1)
    of = np.repeat(np.arange(len(inside)), np.array([0, 1, 2, 1])[inside])
    corners = np.repeat(surface.triangles[of], 3, axis=0)
    shares = mix[np.repeat(piece.triangles.ravel(), 3), corners.ravel()]
    uv = np.asarray(shares).reshape(-1, 3, 3) @ surface.uv[of]
    at = np.asarray(mix.argmax(axis=1)).ravel()
    nearest = surface._taken(at, piece.triangles, uv, surface.material[of])
    moves = {name: np.asarray(mix @ move) for name, move in surface.moves.items()}
    return replace(nearest, vertices=mix @ surface.vertices, colours=mix @ surface.colours, moves=moves)
