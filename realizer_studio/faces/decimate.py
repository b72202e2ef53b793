"""A symmetric decimation of meshes."""

import heapq
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import edges_of, mirror_twins, triangle_normals

PAIRED = 3e-4  # m that a vertex and its mirror image may be apart
TURN = 0.25  # least cosine between a triangle before and after
FLAT = 0.06  # least area of a triangle, in squares of its longest edge


def decimate(vertices: Float64, triangles: Int32, tolerance: Float64) -> tuple[Any, Int32]:
    """Collapse edges in the order of their errors (quadrics: Garland & Heckbert 1997).

    Args:
        vertices: (n, 3) metres; triangles: (m, 3).
        tolerance: (n,) metres by which the surface may change where a vertex is removed; 0 keeps the vertex.

    Returns:
        The remaining vertices, (k,) indices ascending, and the triangles over them, (l, 3). Boundaries
        keep their shape within the tolerance.
    """
    return _Surface(vertices, triangles, tolerance).decimated()


class _Surface:
    def __init__(self, vertices: Float64, triangles: Int32, tolerance: Float64) -> None:
        self.positions = [tuple(row) for row in vertices.tolist()]
        self.faces: list[tuple[int, int, int] | None] = [tuple(row) for row in triangles.tolist()]
        n = len(self.positions)
        self.triangles_at: list[set[int]] = [set() for _ in range(n)]
        for k, face in enumerate(triangles.tolist()):
            for corner in face:
                self.triangles_at[corner].add(k)
        normals = triangle_normals(vertices, triangles)
        area = np.linalg.norm(normals, axis=1)
        planes = (
            np.c_[normals, -(normals * vertices[triangles[:, 0]]).sum(axis=1)]
            / np.maximum(area, 1e-20)[:, None]
        )
        each = planes[:, :, None] * planes[:, None, :] * area[:, None, None]
        self.quadric = np.zeros((n, 4, 4))
        self.weight = np.zeros(n)
        for k in range(3):
            np.add.at(self.quadric, triangles[:, k], each)
            np.add.at(self.weight, triangles[:, k], area)
        pairs, count = edges_of(triangles)
        self.free = np.asarray(tolerance) > 0
        self.rim: dict[int, set[int]] = {}
        for p, q in pairs[count != 2].tolist():
            self.rim.setdefault(p, set()).add(q)
            self.rim.setdefault(q, set()).add(p)
        self.free[[v for v, ends in self.rim.items() if len(ends) != 2]] = False
        self.tolerance = tolerance
        self.twin = mirror_twins(vertices, PAIRED).tolist()

    def decimated(self) -> tuple[Any, Int32]:
        queue = [entry for v in np.flatnonzero(self.free).tolist() if (entry := self.best_collapse(v))]
        heapq.heapify(queue)
        while queue:
            cost, v, u = heapq.heappop(queue)
            entry = self.best_collapse(v) if self.triangles_at[v] else None
            if entry is None:
                continue
            if entry[0] > cost * 1.001 + 1e-12:
                heapq.heappush(queue, entry)
                continue
            _, v, u = entry
            pairs = self.with_mirror(v, u)
            if pairs is None:
                continue
            touched: set[int] = set()
            for removed, target in pairs:
                touched |= self.collapse(removed, target)
            for other in touched:
                if self.free[other] and self.triangles_at[other] and (again := self.best_collapse(other)):
                    heapq.heappush(queue, again)
        left = np.array([face for face in self.faces if face is not None], np.int32)
        used, inverse = np.unique(left, return_inverse=True)
        return used, inverse.reshape(-1, 3).astype(np.int32)

    def neighbours(self, v: int) -> set[int]:
        out: set[int] = set()
        for k in self.triangles_at[v]:
            out.update(self.faces[k])  # type: ignore[arg-type]
        out.discard(v)
        return out

    def best_collapse(self, v: int) -> tuple[float, int, int] | None:
        """Return the lowest cost of collapsing v, at most 1, with v and the neighbour, or None."""
        neighbours = list(self.rim.get(v) or self.neighbours(v))
        if len(neighbours) < 2:
            return None
        ends = np.c_[np.array([self.positions[u] for u in neighbours]), np.ones(len(neighbours))]
        error = np.einsum("ni,ij,nj->n", ends, self.quadric[v], ends) / max(self.weight[v], 1e-20)
        cost = np.sqrt(np.maximum(error, 0))
        if v in self.rim:
            p, q = (self.positions[u] for u in neighbours)
            cost = np.maximum(
                cost, _length(_cross(self.positions[v], p, q)) / max(_square(p, q) ** 0.5, 1e-9)
            )
        cost = cost / self.tolerance[v]
        for k in np.argsort(cost)[:3]:
            if cost[k] < 1 and self.is_allowed(v, neighbours[k]):
                return float(cost[k]), v, neighbours[k]
        return None

    def is_allowed(self, v: int, u: int) -> bool:
        """Return whether collapsing v into u makes no fold, sliver or hole."""
        if len(self.neighbours(v) & self.neighbours(u)) != (1 if v in self.rim else 2):
            return False
        if v in self.rim and len(self.rim[v] | self.rim[u]) < 4:
            return False
        for k in self.triangles_at[v]:
            face = self.faces[k]
            if face is None or u in face:
                continue
            before = _cross(*(self.positions[i] for i in face))
            corners = [self.positions[u if i == v else i] for i in face]
            after = _cross(*corners)
            long = max(_square(corners[k - 1], corners[k]) for k in range(3))
            size, old = _length(after), _length(before)
            along = sum(x * y for x, y in zip(before, after, strict=True))
            if size < FLAT * long or along < TURN * size * old:
                return False
        return True

    def with_mirror(self, v: int, u: int) -> list[tuple[int, int]] | None:
        """Return the collapse and its mirror image, or None if one is not allowed or both share triangles."""
        tv, tu = self.twin[v], self.twin[u]
        if tv < 0 or tu < 0:
            return [(v, u)]
        if tv == v:
            return [(v, u)] if tu == u else None
        if tv == u or not self.free[tv] or not self.triangles_at[tv] or tu not in self.neighbours(tv):
            return None
        # Collapses whose triangles meet could fold together.
        if self.triangles_at[v] & self.triangles_at[tv] or not self.is_allowed(tv, tu):
            return None
        return [(v, u), (tv, tu)]

    def collapse(self, v: int, u: int) -> set[int]:
        near = self.neighbours(v)
        for k in list(self.triangles_at[v]):
            face = self.faces[k]
            assert face is not None
            if u in face:
                for corner in face:
                    self.triangles_at[corner].discard(k)
                self.faces[k] = None
            else:
                self.faces[k] = tuple(u if i == v else i for i in face)  # type: ignore[assignment]
                self.triangles_at[u].add(k)
        self.triangles_at[v] = set()
        if v in self.rim:
            for end in self.rim.pop(v) - {u}:
                self.rim[end] = (self.rim[end] - {v}) | {u}
                self.rim[u] = (self.rim[u] - {v}) | {end}
        self.quadric[u] += self.quadric[v]
        self.weight[u] += self.weight[v]
        return near


def _cross(a: Any, b: Any, c: Any) -> tuple[float, float, float]:
    px, py, pz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    qx, qy, qz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    return py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx


def _length(a: Any) -> float:
    return float((a[0] * a[0] + a[1] * a[1] + a[2] * a[2]) ** 0.5)


def _square(a: Any, b: Any) -> float:
    return float((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)
