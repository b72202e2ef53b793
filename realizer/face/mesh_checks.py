"""Checks of a mesh: holes, flipped triangles, values out of range."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import components, edges_of, half_edges, part_triangles

NEEDED = ("skin", "left_eye", "right_eye")  # parts that every face has
FARTHEST = 1e4  # m; more counts as infinite
COLLAR = 1  # the clean cut at the bust's end is the hole that every head may have
AT_EYE = 0.024  # m from an eyeball's middle; there skin may end at the lids
AT_MOUTH = 0.045  # m from the lips' middle; there skin may end behind the lips
TURNED = 0.02  # of a part's triangles: fewer than that are turned by mistake, more is another way to build it

Parts = Mapping[str, tuple[int, int]]


def value_faults(mesh: Mapping[str, Any]) -> list[str]:
    """Return the faults of values in a mesh.npz; each names its array."""
    vertices, triangles, n = mesh["vertices"], mesh["triangles"], len(mesh["vertices"])
    faults = []
    for name, array in (("vertices", vertices), ("triangles", triangles), ("colours", mesh["colours"])):
        if array.shape[1] != 3:
            faults.append(f"{name}: wanted 3 columns, got {array.shape[1]}; build the face again")
    bad = np.flatnonzero(~(np.abs(vertices) <= FARTHEST).all(axis=1))
    if len(bad):
        faults.append(f"vertices: {len(bad)} are not finite, the first is {bad[0]}; build the face again")
    if len(triangles) and (triangles.min() < 0 or triangles.max() >= n):
        faults.append(
            f"triangles: wanted indices 0..{n - 1}, got {triangles.min()}..{triangles.max()}; build again"
        )
    for name in ("colours", "occlusion", "gloss"):
        array = mesh[name]
        if len(array) != n:
            faults.append(f"{name}: wanted {n} rows, one a vertex, got {len(array)}; build the face again")
        if len(array) and not (np.isfinite(array).all() and array.min() >= 0 and array.max() <= 255):
            faults.append(f"{name}: wanted 0..255, got {array.min():g}..{array.max():g}; scale it")
        elif array.dtype != np.uint8:
            faults.append(f"{name}: wanted bytes (uint8) 0..255, got {array.dtype}; store it as uint8")
    return faults


def range_faults(parts: Mapping[str, Any], n: int | None) -> list[str]:
    """Return the faults of the parts in face.toml: missing, or no ranges of n vertices (None: unknown)."""
    faults = [f"parts: wanted {name!r}, got none" for name in NEEDED if name not in parts]
    for name, ends in parts.items():
        whole = isinstance(ends, list) and len(ends) == 2 and all(isinstance(end, int) for end in ends)
        if not whole or not 0 <= ends[0] < ends[1] or (n is not None and ends[1] > n):
            most = "the number of vertices" if n is None else n
            faults.append(f"parts: {name}: wanted [first, last + 1] in 0..{most}, got {ends}")
    return faults


def surface_faults(vertices: Float64, triangles: Int32, parts: Parts, mouth: Any) -> list[str]:
    """Return faults: open edges where there must be none, and flipped triangles.

    Args:
        vertices: (n, 3) metres; triangles: (m, 3).
        mouth: (3,) the middle between the lips, or None where that is not known.
    """
    faults = []
    for name, ends in parts.items():
        mine = part_triangles(triangles, ends) + ends[0]
        if len(mine):
            faults += [f"{name}: {fault}" for fault in _turned(mine)]
    mine = part_triangles(triangles, parts["skin"]) + parts["skin"][0]
    eyes = [vertices[slice(*parts[name])].mean(axis=0) for name in ("left_eye", "right_eye") if name in parts]
    return faults + [f"skin: {fault}" for fault in _holes(vertices, mine, eyes, mouth)]


def _turned(triangles: Int32) -> list[str]:
    """Return the triangles whose neighbours are all wound the other way."""
    edges = half_edges(triangles)
    owner = np.tile(np.arange(len(triangles)), 3)
    _, inverse, counts = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    twice = counts[inverse.ravel()] > 1
    amount = np.bincount(owner[twice], minlength=len(triangles))
    # The one that is turned shares all its edges so, those beside it one each.
    wrong = np.flatnonzero(amount >= 2)
    if not len(wrong) or len(wrong) > max(TURNED * len(triangles), 3):
        return []
    corners = triangles[wrong[0]].tolist()
    return [
        f"{len(wrong)} triangles are inverted, one has the vertices {corners}: go round it the other way, "
        "counter-clockwise seen from outside"
    ]


def _holes(vertices: Float64, triangles: Int32, eyes: list[Any], mouth: Any) -> list[str]:
    """Return the rims of the skin beside the bust's end, the lids and the inside of the mouth."""
    pairs, counts = edges_of(triangles)
    rim = pairs[counts == 1]
    if not len(rim):
        return []
    names, index = np.unique(rim, return_inverse=True)
    index = index.reshape(-1, 2)
    label = components(index.astype(np.int32), len(names))
    lowest = label[int(np.argmin(vertices[names, 1]))]
    open_ = []
    for k in range(label.max() + 1):
        mine = names[label == k]
        at = vertices[mine]
        lids = any(np.linalg.norm(at - eye, axis=1).max() < AT_EYE for eye in eyes)
        inside = (
            mouth is not None
            and np.linalg.norm(at - mouth, axis=1).max() < AT_MOUTH
            and (at[:, 2].mean() < mouth[2])
        )
        if k != lowest and not lids and not inside:
            open_.append((int(mine[0]), int((label[index[:, 0]] == k).sum()), at.mean(axis=0)))
    return [
        f"it has {len(open_)} hole{'s' * (len(open_) > 1)} beside the bust's end: "
        + "; ".join(
            f"{edges} open edges at vertex {vertex}, {np.round(place, 3).tolist()}"
            for vertex, edges, place in open_[:4]
        )
        + (" ..." if len(open_) > 4 else "")
        + f"; close {'it' if len(open_) == 1 else 'them'}"
    ] * bool(open_)
