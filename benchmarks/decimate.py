"""Reduces a mesh to fewer of its vertices."""

from __future__ import annotations

import heapq
from collections import defaultdict

import numpy as np
import numpy.typing as npt

Float64 = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]

BORDER = 30.0  # weight of a border, relative to the surface
EVEN = 1e-5  # of an edge's squared length; it makes triangles of flat places even


def decimated(at: Float64, triangles: Index, size: int) -> tuple[Index, Index]:
    """Collapse edges into one of their ends, in the order of the error that this causes.

    The error is measured by quadrics of planes (Garland and Heckbert 1997). Borders have planes of their
    own. No triangle turns over, and no hole closes.

    Args:
        at: (n, 3) vertices.
        triangles: (m, 3).
        size: wanted number of vertices; more remain if no further edge can be collapsed.

    Returns:
        (k,) indices of the remaining vertices, and (j, 3) triangles of indices into these.
    """
    faces = {number: tuple(map(int, corners)) for number, corners in enumerate(triangles)}
    around: dict[int, set[int]] = defaultdict(set)
    edges: dict[tuple[int, int], list[int]] = defaultdict(list)
    for number, corners in faces.items():
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            around[a].add(number)
            edges[min(a, b), max(a, b)].append(number)
    quadrics = np.zeros((len(at), 4, 4))
    for corners in faces.values():
        plane, area = _plane(at[list(corners)])
        quadrics[list(corners)] += area * np.outer(plane, plane)
    border = set()
    for (a, b), owners in edges.items():
        if len(owners) == 1:
            normal = _plane(at[list(faces[owners[0]])])[0][:3]
            side = np.cross(at[b] - at[a], normal)
            long = float(np.linalg.norm(side))
            plane = np.append(side, -side @ at[a]) / max(long, 1e-12)
            quadrics[[a, b]] += BORDER * long**2 * np.outer(plane, plane)
            border |= {a, b}

    def cost(gone: int, kept: int) -> float:
        place = np.append(at[kept], 1)
        away = float(((at[gone] - at[kept]) ** 2).sum())
        return float(place @ (quadrics[gone] + quadrics[kept]) @ place) + EVEN * away * away

    heap = [(cost(*pair), *pair) for a, b in edges for pair in ((a, b), (b, a))]
    heapq.heapify(heap)
    remaining = len(around)
    while heap and remaining > size:
        before, gone, kept = heapq.heappop(heap)
        shared = around[gone] & around[kept]
        if not shared or before != cost(gone, kept):
            continue
        near = [{v for number in around[end] for v in faces[number]} - {gone, kept} for end in (gone, kept)]
        opposite = {v for number in shared for v in faces[number]} - {gone, kept}
        on_border = len(shared) == 1
        if (
            near[0] & near[1] != opposite
            or (gone in border and not on_border)
            or (on_border and kept not in border)
        ):
            continue
        moved = [number for number in around[gone] if number not in shared]
        if any(_turns(at, faces[number], gone, kept) for number in moved):
            continue
        for number in shared:
            for v in faces.pop(number):
                around[v].discard(number)
        for number in moved:
            faces[number] = tuple(kept if v == gone else v for v in faces[number])
            around[kept].add(number)
        around[gone].clear()
        quadrics[kept] += quadrics[gone]
        remaining -= 1
        for v in {v for number in around[kept] for v in faces[number]} - {kept}:
            heapq.heappush(heap, (cost(v, kept), v, kept))
            heapq.heappush(heap, (cost(kept, v), kept, v))
    corners = np.array(list(faces.values()), np.intp)
    return np.unique(corners, return_inverse=True)[0], np.searchsorted(np.unique(corners), corners)


def _plane(corners: Float64) -> tuple[Float64, float]:
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    long = float(np.linalg.norm(normal))
    normal = normal / max(long, 1e-12)
    return np.append(normal, -normal @ corners[0]), long / 2


def _turns(at: Float64, corners: tuple[int, ...], gone: int, kept: int) -> bool:
    """Return whether a triangle would turn over, or become a sliver."""
    before = np.cross(at[corners[1]] - at[corners[0]], at[corners[2]] - at[corners[0]])
    a, b, c = (at[kept if v == gone else v] for v in corners)
    after = np.cross(b - a, c - a)
    long = max(float(((x - y) ** 2).sum()) for x, y in ((a, b), (b, c), (c, a)))
    area = float(np.linalg.norm(after))
    return float(before @ after) < 0.3 * float(np.linalg.norm(before)) * area or area < 0.05 * long
