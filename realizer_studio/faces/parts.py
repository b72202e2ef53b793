"""The parts of a face that is being built, and submeshes of the base mesh."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from realizer.core.array_types import Float64, Int32

SLIVER = 1e-6  # of the height of a cut


@dataclass(frozen=True, eq=False)
class Submesh:
    """A surface whose vertices are linear combinations of the base mesh's."""

    # (n, n_base) sparse; vertices = mix @ base vertices + offset, and displacements likewise.
    mix: sp.csr_matrix
    offset: Float64  # (n, 3) metres
    triangles: Int32  # (m, 3) counter-clockwise seen from outside

    @classmethod
    def of_quads(cls, quads: Int32, n_base: int) -> Submesh:
        """Make a submesh of some quads of the base mesh; quads with three corners have the last repeated."""
        triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        triangles = triangles[(triangles[:, 0] != triangles[:, 2]) & (triangles[:, 1] != triangles[:, 2])]
        used, inverse = np.unique(triangles, return_inverse=True)
        mix = sp.csr_matrix((np.ones(len(used)), (np.arange(len(used)), used)), (len(used), n_base))
        return cls(mix, np.zeros((len(used), 3)), inverse.reshape(-1, 3).astype(np.int32))

    def __len__(self) -> int:
        return int(self.mix.shape[0])

    def sources(self) -> Int32:
        """Return the base vertex that each vertex equals, (n,); -1 for combinations of several."""
        first = self.mix.indices[self.mix.indptr[:-1]]
        return np.where(np.diff(self.mix.indptr) == 1, first, -1).astype(np.int32)

    def positions(self, base: Float64) -> Float64:
        """Return the positions of the vertices, (n, 3) metres."""
        return np.asarray(self.mix @ base) + self.offset

    def mixed(self, mix: sp.csr_matrix, triangles: Any) -> Submesh:
        """Return a submesh whose vertices are linear combinations of the vertices of this one."""
        return Submesh((mix @ self.mix).tocsr(), np.asarray(mix @ self.offset), triangles.astype(np.int32))

    def with_triangles(self, keep: Any) -> Submesh:
        """Return the submesh of the triangles in the mask `keep` (m,), with the vertices that they use."""
        used, inverse = np.unique(self.triangles[keep], return_inverse=True)
        pick = sp.eye_array(len(self), format="csr")[used]
        return self.mixed(sp.csr_matrix(pick), inverse.reshape(-1, 3))

    def moved(self, offset: Float64) -> Submesh:
        """Return the submesh with `offset` (n, 3) added."""
        return replace(self, offset=self.offset + offset)

    def clipped(self, height: Float64) -> tuple[Submesh, sp.csr_matrix]:
        """Return the part of the surface with `height` (n,) above zero, and its mix of vertices."""
        # A cut very close to a vertex would leave slivers, so such cuts pass through the vertex.
        height = np.where(np.abs(height) < SLIVER, SLIVER, height)
        inside = height > 0
        rows: list[dict[int, float]] = [{i: 1.0} for i in range(len(self))]
        cuts: dict[tuple[int, int], int] = {}

        def cut(a: int, b: int) -> int:
            key = (a, b) if a < b else (b, a)
            if key not in cuts:
                t = height[key[0]] / (height[key[0]] - height[key[1]])
                rows.append({key[0]: 1 - t, key[1]: t})
                cuts[key] = len(rows) - 1
            return cuts[key]

        triangles: list[tuple[int, int, int]] = []
        for triangle in self.triangles.tolist():
            count = int(inside[triangle].sum())
            if count == 3:
                triangles.append(tuple(triangle))
            elif count:
                # Turn the triangle so that the odd vertex comes first.
                odd = [inside[i] == (count == 1) for i in triangle].index(True)
                a, b, c = triangle[odd:] + triangle[:odd]
                ab, ca = cut(a, b), cut(a, c)
                triangles += [(a, ab, ca)] if count == 1 else [(ab, b, c), (ab, c, ca)]
        used, inverse = np.unique(np.array(triangles).reshape(-1, 3), return_inverse=True)
        mix = mix_of(rows, len(self))[used]
        return self.mixed(mix, inverse.reshape(-1, 3)), mix

    def threaded(self, loops: list[list[int]]) -> Submesh:
        """Return the surface with the edges of closed loops subdivided, which makes the loops smoother.

        Each new vertex is a combination of four points (Dyn, Levin and Gregory 1987).

        Args:
            loops: the vertices of each loop; no vertex is in two loops.
        """
        middle: dict[tuple[int, int], int] = {}
        rows: list[dict[int, float]] = [{i: 1.0} for i in range(len(self))]
        for loop in loops:
            for k in range(len(loop)):
                a, b, c, d = (loop[(k + step) % len(loop)] for step in (-1, 0, 1, 2))
                middle[(b, c) if b < c else (c, b)] = len(rows)
                rows.append({a: -1 / 16, b: 9 / 16, c: 9 / 16, d: -1 / 16})
        triangles: list[tuple[int, int, int]] = []
        for a, b, c in self.triangles.tolist():
            cut = [(p, q) for p, q in ((a, b), (b, c), (c, a)) if ((p, q) if p < q else (q, p)) in middle]
            if not cut:
                triangles.append((a, b, c))
                continue
            if len(cut) > 1:
                raise ValueError(f"triangle {a}, {b}, {c} has two edges on the loops; wanted one at most")
            p, q = cut[0]
            tip = ({a, b, c} - {p, q}).pop()
            new = middle[(p, q) if p < q else (q, p)]
            triangles += [(p, new, tip), (new, q, tip)]
        return self.mixed(mix_of(rows, len(self)), np.array(triangles))


def mix_of(rows: Sequence[Mapping[int, float]], n: int) -> sp.csr_matrix:
    """Return the sparse matrix (len(rows), n) of rows that map columns to values."""
    shares = [share for row in rows for share in row.values()]
    indices = [i for i, row in enumerate(rows) for _ in row], [j for row in rows for j in row]
    return sp.csr_matrix((shares, indices), (len(rows), n))


@dataclass(eq=False)
class Part:
    """A part of a face that is being built."""

    name: str
    patch: Submesh | None  # where its vertices come from on the base mesh, or None
    vertices: Float64  # (n, 3) metres
    triangles: Int32  # (m, 3)
    colours: Float64  # (n, 3) sRGB 0..255
    gloss: Float64  # (n,) 0..1
    occlusion: Float64 | None = None  # (n,) 0..1, or None: to be baked
    # Row number -> (n, 3), fields that do not come from the base mesh.
    fields: dict[int, Float64] = field(default_factory=dict)
    uv: Float64 | None = None  # (n, 2) texture coordinates, or None: the part has none

    @property
    def submesh(self) -> Submesh:
        """The submesh of a part that comes from the base mesh."""
        assert self.patch is not None
        return self.patch

    def subset(self, index: Any, triangles: Int32) -> Part:
        """Return the part with the vertices of (k,) indices, and other triangles over them."""
        patch = self.patch and Submesh(self.patch.mix[index], self.patch.offset[index], triangles)
        light = None if self.occlusion is None else self.occlusion[index]
        fields = {number: moves[index] for number, moves in self.fields.items()}
        return Part(
            self.name, patch, self.vertices[index], triangles, self.colours[index], self.gloss[index], light,
            fields, None if self.uv is None else self.uv[index],
        )  # fmt: skip


def smooth(x: Any, low: Any, high: Any) -> Any:
    """Return Perlin's cubic step: 0 below low, 1 above high; descending if high < low."""
    t = np.clip((np.asarray(x, float) - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)
