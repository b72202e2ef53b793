"""Landmarks computed from the shape of a head, which help to locate feature points."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import label
from scipy.spatial import cKDTree

from realizer.core.array_types import Bool, Float64, Int32

GRID = 72  # rows and columns of the depth image of an eye
SLICES = 320  # heights of the profile
BESIDE = 0.002  # eye distances


@dataclass(frozen=True, eq=False)
class HeadGeometry:
    """A head, measured in eye distances."""

    skin: Float64  # (n, 3) in eye distances from the middle between the eyes
    triangles: Int32  # (m, 3)
    normals: Float64  # (n, 3) unit normals
    left: Float64  # (3,) centre of the left eyeball
    right: Float64  # (3,) centre of the right one
    radius: float  # of the eyeballs


def find_anchors(head: HeadGeometry) -> dict[str, Float64]:
    """Return anchor name -> position (3,), for the anchors that are found."""
    found = _profile(head)
    for side, centre in (("l", head.left), ("r", head.right)):
        found |= {f"{side}_{name}": position for name, position in _opening(head, centre, side).items()}
    found |= _corners(head, found)
    found |= _outline(head)
    return found


def profile_line(head: HeadGeometry) -> tuple[Float64, Float64]:
    """Return heights, and the foremost z of the middle of the face at each; NaN where there is no skin."""
    at, tri = head.skin, head.triangles
    strip = at[tri[(np.abs(at[tri, 0]) < 0.6).all(axis=1) & (at[tri, 2] > -0.4).all(axis=1)]]
    heights = np.linspace(-2.2, 1.0, SLICES)
    front = np.full(SLICES, np.nan)
    # The profile is measured beside x = 0, where meshes have edges.
    sides = strip[:, :, 0] > BESIDE
    for corners, past in zip(strip, sides, strict=True):
        if past.all() or not past.any():
            continue
        apex = int(np.flatnonzero(past == (past.sum() == 1))[0])
        p = corners[apex]
        crossings = []
        for q in (corners[apex - 1], corners[apex - 2]):
            t = (p[0] - BESIDE) / (p[0] - q[0])
            crossings.append(p + t * (q - p))
        low, high = sorted(crossings, key=lambda end: float(end[1]))
        rows = np.flatnonzero((heights >= low[1]) & (heights <= high[1]))
        z = np.interp(heights[rows], [low[1], high[1]], [low[2], high[2]])
        front[rows] = np.fmax(front[rows], z)
    return heights, front


def _profile(head: HeadGeometry) -> dict[str, Float64]:
    heights, front = profile_line(head)
    kernel = np.array([1, 2, 3, 2, 1]) / 9

    def point(k: int) -> Float64:
        return np.array([0.0, heights[k], front[k]])

    out: dict[str, Float64] = {}
    nose = np.flatnonzero((heights > -1.1) & (heights < -0.15) & np.isfinite(front))
    if len(nose) < 5:
        return out
    tip = int(nose[np.argmax(front[nose])])
    out["tip"] = point(tip)
    # The bridge is the deepest point between the brows and the tip.
    bridge = np.flatnonzero((heights > heights[tip] + 0.1) & (heights < 0.4) & np.isfinite(front))
    if len(bridge):
        out["bridge"] = point(int(bridge[np.argmin(front[bridge])]))
    reach = (heights < heights[tip]) & (heights > heights[tip] - 1.6)
    below = np.flatnonzero(reach & np.isfinite(front))[::-1]
    if len(below) < 20:
        return out
    z = np.convolve(np.pad(front[below], 2, mode="edge"), kernel, "valid")
    peaks = [i for i in range(2, len(z) - 2) if z[i] == z[i - 2 : i + 3].max() and z[i] > z[i - 2]]
    if len(peaks) < 2:
        return out
    upper, lower = peaks[:2]
    # A receding chin makes no peak.
    chin = peaks[2] if len(peaks) > 2 else None
    base = int(np.argmin(z[:upper]))
    slit = upper + int(np.argmin(z[upper:lower]))
    landmarks = {"base": base, "upper": upper, "slit": slit, "lower": lower}
    if chin is not None:
        landmarks |= {"dip": lower + int(np.argmin(z[lower:chin])), "chin": chin}
    for name, i in landmarks.items():
        out[name] = point(int(below[i]))
    first = heights[below[lower if chin is None else chin]] - (0.25 if chin is None else 0)
    under = [int(k) for k in below if first - 0.35 < heights[k] <= first]
    if under:
        # The underside of the chin begins at the point farthest down and forwards.
        out["under"] = point(max(under, key=lambda k: 0.5 * front[k] - 0.5 * heights[k]))
    return out


def _opening(head: HeadGeometry, centre: Float64, side: str) -> dict[str, Float64]:
    """Return the corners and edges of the opening between the lids, from a depth image of the front."""
    size = 1.25 * head.radius
    x = centre[0] + np.linspace(-size, size, GRID)
    y = centre[1] + np.linspace(-size, size, GRID)
    depth = np.full((GRID, GRID), -np.inf)
    at, tri = head.skin, head.triangles
    nearby = tri[
        (np.abs(at[tri, 0] - centre[0]).min(axis=1) < size)
        & (np.abs(at[tri, 1] - centre[1]).min(axis=1) < size)
        & (at[tri, 2] > centre[2] - 0.1).all(axis=1)
    ]
    px, py = np.meshgrid(x, y)
    for a, b, c in at[nearby]:
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
    regions, _ = label(~covered)
    # The opening of an almost shut eye is below or above the centre of the ball.
    open_ = np.argwhere(regions > 0)
    if not len(open_):
        return {}
    distance = np.linalg.norm((open_ - (GRID - 1) / 2) * [1, 2], axis=1)
    if distance.min() > 0.3 * GRID:
        return {}
    eye = regions[tuple(open_[np.argmin(distance)])]
    rows, columns = np.nonzero(regions == eye)
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
    """Return the corners of the mouth, which are the ends of the line where the lips touch."""
    if "slit" not in found:
        return {}
    slit = found["slit"]
    box = np.flatnonzero(
        (np.abs(head.skin[:, 0]) < 0.75)
        & (np.abs(head.skin[:, 1] - slit[1]) < 0.14)
        & (head.skin[:, 2] > slit[2] - 0.45)
    )
    at, normals = head.skin[box], head.normals[box]
    if len(box) < 8:
        return {}
    pairs = cKDTree(at).query_pairs(0.045, output_type="ndarray")
    if not len(pairs):
        return {}
    i, j = pairs.T
    facing = (normals[i] * normals[j]).sum(axis=1) < -0.25
    touching = np.unique(pairs[facing])
    outer = touching[np.abs(at[touching, 0]) > 0.12] if len(touching) else touching
    out = {}
    for name, sign in (("l_corner", 1), ("r_corner", -1)):
        corner = outer[at[outer, 0] * sign > 0] if len(outer) else outer
        # Points that touch farther back are inside the mouth.
        corner = corner[at[corner, 2] > slit[2] - 0.30] if len(corner) else corner
        if len(corner):
            ends = corner[np.argsort(-at[corner, 0] * sign)[:3]]
            out[name] = at[ends].mean(axis=0)
    if len(out) == 2 and abs(abs(out["l_corner"][0]) - abs(out["r_corner"][0])) > 0.1:
        return {}
    return out


def _outline(head: HeadGeometry) -> dict[str, Float64]:
    """Return the ears, and the top and the back of the skull."""
    at, out = head.skin, {}
    above = at[at[:, 1] > -1.3]
    top, back = above[np.argmax(above[:, 1])], above[np.argmin(above[:, 2])]
    # A skull is round: its height and depth are known, but not the exact position. NaN means unknown.
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
