"""Landmarks that the shape of a head shows by itself, for locating feature points."""

from dataclasses import dataclass

import numpy as np

from realizer.core.array_types import Bool, Float64, Int32

GRID = 72  # rows and columns that an eye's opening is looked at with
SLICES = 320  # heights that the profile is looked at with
ASIDE = 0.002  # eye distances


@dataclass(frozen=True, eq=False)
class HeadGeometry:
    """A head in its own measure."""

    skin: Float64  # (n, 3) in eye distances from the middle between the eyes
    triangles: Int32  # (m, 3)
    ups: Float64  # (n, 3) unit normals
    left: Float64  # (3,) centre of the left eyeball
    right: Float64  # (3,) centre of the right one
    radius: float  # theirs


def find_anchors(head: HeadGeometry) -> dict[str, Float64]:
    """Return anchor name -> place (3,), for the anchors that were found."""
    found = _profile(head)
    for side, centre in (("l", head.left), ("r", head.right)):
        found |= {f"{side}_{name}": place for name, place in _opening(head, centre, side).items()}
    found |= _corners(head, found)
    found |= _outline(head)
    return found


def profile_line(head: HeadGeometry) -> tuple[Float64, Float64]:
    """Return heights, and how far forward the middle of the face reaches at each; NaN without skin."""
    at, tri = head.skin, head.triangles
    near = at[tri[(np.abs(at[tri, 0]) < 0.6).all(axis=1) & (at[tri, 2] > -0.4).all(axis=1)]]
    heights = np.linspace(-2.2, 1.0, SLICES)
    front = np.full(SLICES, np.nan)
    # Beside the very middle, where meshes have their edges.
    sides = near[:, :, 0] > ASIDE
    for corners, beyond in zip(near, sides, strict=True):
        if beyond.all() or not beyond.any():
            continue
        odd = int(np.flatnonzero(beyond == (beyond.sum() == 1))[0])
        p = corners[odd]
        ends = []
        for q in (corners[odd - 1], corners[odd - 2]):
            t = (p[0] - ASIDE) / (p[0] - q[0])
            ends.append(p + t * (q - p))
        low, high = sorted(ends, key=lambda end: float(end[1]))
        here = np.flatnonzero((heights >= low[1]) & (heights <= high[1]))
        z = np.interp(heights[here], [low[1], high[1]], [low[2], high[2]])
        front[here] = np.fmax(front[here], z)
    return heights, front


def _profile(head: HeadGeometry) -> dict[str, Float64]:
    heights, front = profile_line(head)
    kernel = np.array([1, 2, 3, 2, 1]) / 9

    def place(k: int) -> Float64:
        return np.array([0.0, heights[k], front[k]])

    out: dict[str, Float64] = {}
    nose = np.flatnonzero((heights > -1.1) & (heights < -0.15) & np.isfinite(front))
    if len(nose) < 5:
        return out
    tip = int(nose[np.argmax(front[nose])])
    out["tip"] = place(tip)
    # Between the brows and the tip, the bridge is the deepest point.
    bridge = np.flatnonzero((heights > heights[tip] + 0.1) & (heights < 0.4) & np.isfinite(front))
    if len(bridge):
        out["bridge"] = place(int(bridge[np.argmin(front[bridge])]))
    reach = (heights < heights[tip]) & (heights > heights[tip] - 1.6)
    below = np.flatnonzero(reach & np.isfinite(front))[::-1]
    if len(below) < 20:
        return out
    z = np.convolve(np.pad(front[below], 2, mode="edge"), kernel, "valid")
    peaks = [i for i in range(2, len(z) - 2) if z[i] == z[i - 2 : i + 3].max() and z[i] > z[i - 2]]
    if len(peaks) < 2:
        return out
    upper, lower = peaks[:2]
    # A chin that recedes has no peak of its own.
    chin = peaks[2] if len(peaks) > 2 else None
    base = int(np.argmin(z[:upper]))
    slit = upper + int(np.argmin(z[upper:lower]))
    marks = {"base": base, "upper": upper, "slit": slit, "lower": lower}
    if chin is not None:
        marks |= {"dip": lower + int(np.argmin(z[lower:chin])), "chin": chin}
    for name, i in marks.items():
        out[name] = place(int(below[i]))
    first = heights[below[lower if chin is None else chin]] - (0.25 if chin is None else 0)
    under = [int(k) for k in below if first - 0.35 < heights[k] <= first]
    if under:
        # The chin's underside begins farthest down and forwards.
        out["under"] = place(max(under, key=lambda k: 0.5 * front[k] - 0.5 * heights[k]))
    return out


def _opening(head: HeadGeometry, centre: Float64, side: str) -> dict[str, Float64]:
    """Return the corners and edges of the gap between the lids, seen from the front."""
    size = 1.25 * head.radius
    x = centre[0] + np.linspace(-size, size, GRID)
    y = centre[1] + np.linspace(-size, size, GRID)
    depth = np.full((GRID, GRID), -np.inf)
    at, tri = head.skin, head.triangles
    mine = tri[
        (np.abs(at[tri, 0] - centre[0]).min(axis=1) < size)
        & (np.abs(at[tri, 1] - centre[1]).min(axis=1) < size)
        & (at[tri, 2] > centre[2] - 0.1).all(axis=1)
    ]
    px, py = np.meshgrid(x, y)
    for a, b, c in at[mine]:
        lo = np.searchsorted(x, min(a[0], b[0], c[0])), np.searchsorted(y, min(a[1], b[1], c[1]))
        hi = np.searchsorted(x, max(a[0], b[0], c[0])), np.searchsorted(y, max(a[1], b[1], c[1]))
        area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
        if abs(area) < 1e-12 or lo[0] == hi[0] or lo[1] == hi[1]:
            continue
        box = slice(lo[1], hi[1]), slice(lo[0], hi[0])
        u = ((px[box] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (py[box] - a[1])) / area
        v = ((b[0] - a[0]) * (py[box] - a[1]) - (px[box] - a[0]) * (b[1] - a[1])) / area
        z = a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2])
        inside = (u >= 0) & (v >= 0) & (u + v <= 1)
        depth[box] = np.where(inside, np.maximum(depth[box], z), depth[box])
    ball = head.radius**2 - (px - centre[0]) ** 2 - (py - centre[1]) ** 2
    front = centre[2] + np.sqrt(np.maximum(ball, 0))
    covered = np.asarray((depth > front) | (ball < 0))
    from scipy.ndimage import label

    regions, _ = label(~covered)
    # An eye that is almost shut shows below or above the ball's middle.
    open_ = np.argwhere(regions > 0)
    if not len(open_):
        return {}
    off = np.linalg.norm((open_ - (GRID - 1) / 2) * [1, 2], axis=1)
    if off.min() > 0.3 * GRID:
        return {}
    seen = regions[tuple(open_[np.argmin(off)])]
    rows, columns = np.nonzero(regions == seen)
    inner_first = side == "l"

    def mean(chosen: Bool) -> Float64:
        r, c = rows[chosen], columns[chosen]
        return np.array([x[c].mean(), y[r].mean(), front[r, c].mean()])

    middle = np.abs(x[columns] - centre[0]) < 0.12 * head.radius
    if not middle.any():
        return {}
    low, high = columns.min(), columns.max()
    left, right = mean(columns == low), mean(columns == high)
    return {
        "inner": left if inner_first else right,
        "outer": right if inner_first else left,
        "upper": mean(middle & (rows == rows[middle].max())),
        "lower": mean(middle & (rows == rows[middle].min())),
    }


def _corners(head: HeadGeometry, found: dict[str, Float64]) -> dict[str, Float64]:
    """Return the mouth's corners: the ends of where skin touches skin."""
    from scipy.spatial import cKDTree

    if "slit" not in found:
        return {}
    slit = found["slit"]
    box = np.flatnonzero(
        (np.abs(head.skin[:, 0]) < 0.75)
        & (np.abs(head.skin[:, 1] - slit[1]) < 0.14)
        & (head.skin[:, 2] > slit[2] - 0.45)
    )
    at, ups = head.skin[box], head.ups[box]
    if len(box) < 8:
        return {}
    pairs = cKDTree(at).query_pairs(0.045, output_type="ndarray")
    if not len(pairs):
        return {}
    i, j = pairs.T
    facing = (ups[i] * ups[j]).sum(axis=1) < -0.25
    touching = np.unique(pairs[facing])
    outer = touching[np.abs(at[touching, 0]) > 0.12] if len(touching) else touching
    out = {}
    for name, sign in (("l_corner", 1), ("r_corner", -1)):
        mine = outer[at[outer, 0] * sign > 0] if len(outer) else outer
        # Of touching points, the edge of the mouth is in front.
        mine = mine[at[mine, 2] > slit[2] - 0.30] if len(mine) else mine
        if len(mine):
            ends = mine[np.argsort(-at[mine, 0] * sign)[:3]]
            out[name] = at[ends].mean(axis=0)
    if len(out) == 2 and abs(abs(out["l_corner"][0]) - abs(out["r_corner"][0])) > 0.1:
        return {}
    return out


def _outline(head: HeadGeometry) -> dict[str, Float64]:
    """Return the ears, and the top and the back of the skull."""
    at, out = head.skin, {}
    above = at[at[:, 1] > -1.3]
    top, back = above[np.argmax(above[:, 1])], above[np.argmin(above[:, 2])]
    # Round as a skull is, it shows how high and how far back, but not where: NaN is not known.
    out["top"] = np.array([0, top[1], np.nan])
    out["back"] = np.array([0, np.nan, back[2]])
    for name, sign in (("l_ear", 1), ("r_ear", -1)):
        near = at[(at[:, 1] > -1.1) & (at[:, 1] < 0.6) & (at[:, 2] < -0.4)]
        if not len(near):
            continue
        wide = near[near[:, 0] * sign > 0.94 * (near[:, 0] * sign).max()]
        out[f"{name}_high"] = wide[np.argmax(wide[:, 1])]
        out[f"{name}_low"] = wide[np.argmin(wide[:, 1])]
        out[f"{name}_back"] = wide[np.argmin(wide[:, 2])]
    return out
