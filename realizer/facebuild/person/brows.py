"""Meshes of brows and lashes that follow the skin."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy.sparse as sp

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import flat_cross, grid, vertex_normals
from realizer.facebuild.parts import Part, smooth
from realizer.facebuild.person.lids import Lid
from realizer.facebuild.person.recipe import Appearance
from realizer.facebuild.submesh import Submesh, mix_of

ALONG, ACROSS = 26, 7  # vertices of a brow
HALF = 0.0047  # m, half its width where it is widest, soft edges included
GREY = np.array([168, 164, 160.0])
UPPER, LOWER = 26, 9  # lashes of a lid
CURL = 0.55  # how much further than its root a lash's tip goes when the lid falls
SEED = 3


def brow(
    skin: Submesh,
    base: Float64,
    tints: Float64,
    points: Mapping[str, Float64],
    side: float,
    colour: Any,
    look: Appearance,
) -> Part:
    """Return a brow: a sheet on the skin with hairs drawn on it, its edges in the skin's colour.

    Args:
        tints: (n, 3) sRGB, the skin's.
        points: feature points, metres; side: 1 left, -1 right.
    """
    from scipy.interpolate import PchipInterpolator

    rng = np.random.default_rng(SEED)
    a, b, c = (points[k] for k in (("4.1", "4.3", "4.5") if side > 0 else ("4.2", "4.4", "4.6")))
    # The points lie on the bone; a calm brow begins a little higher and arches a little less.
    x = np.abs([a[0] - side * 0.003, (a[0] + b[0]) / 2, b[0], c[0] + side * 0.002])
    y = np.array([a[1] + 0.0016, (a[1] + b[1]) / 2 + 0.0012, b[1] - 0.0012, c[1] - 0.0008]) - look.brow_low
    t = np.linspace(0, 1, ALONG)
    v = np.linspace(-1, 1, ACROSS)
    middle = PchipInterpolator(x, y)
    half = HALF * look.brow_thick * smooth(t, -0.35, 0.25) * (1 - 0.80 * smooth(t, 0.35, 1.02))
    # Ragged by lock: no two columns end at the same height.
    top, low = (half * (1 + 0.16 * rng.uniform(-1, 1, ALONG)) for _ in range(2))
    reach = np.where(v[:, None] > 0, v[:, None] * top, v[:, None] * low)
    # Hairs stand up at the inner end and lie along the brow further out: columns lean as they do.
    lean = 0.0016 + 0.0030 * smooth(t, 0.05, 0.7)
    across = x[0] + (x[-1] - x[0]) * t + v[:, None] * lean * np.minimum(half / HALF, 1)
    height = middle(np.clip(across, x[0], x[-1])) + reach
    flat = np.stack([side * across.ravel(), height.ravel()], 1)
    sheet = grid(ACROSS, ALONG)
    patch = _laid(skin, base, flat, sheet[:, [0, 2, 1]] if side > 0 else sheet)
    at = patch.positions(base)
    thick = (1 - np.abs(v[:, None]) ** 2) * np.ones(ALONG)
    thick = thick * smooth(t, 0.0, 0.12) * smooth(t, 1.0, 0.9)
    # Over the skin's folds, as its triangles are larger than the brow's.
    patch = patch.moved(vertex_normals(at, patch.triangles) * (0.00025 + 0.0007 * thick.ravel())[:, None])
    core = np.clip(1.15 - np.abs(v[:, None]) ** 1.6 * 1.15, 0, 1)
    seen = (
        core
        * (0.25 + 0.75 * smooth(t, 0.0, 0.30))
        * smooth(t, -0.04, 0.09)
        * (1 - 0.45 * smooth(t, 0.7, 1.0))
    )
    seen = seen * smooth(t, 1.0, 0.93) * look.brow_cover
    stroke = 1 + 0.26 * rng.uniform(-1, 1, ALONG) + 0.10 * rng.uniform(-1, 1, (ACROSS, ALONG))
    seen = np.clip(seen * (0.90 + 0.35 * (stroke - 1)), 0, 0.96).ravel()[:, None]
    hair = np.array(colour, float) * (1 - look.brow_grey) + GREY * look.brow_grey
    under = np.asarray(patch.mix @ _spread(skin, tints))
    tint = under * (1 - seen) + hair * stroke.ravel()[:, None] * seen
    gloss = np.full(len(patch), 0.06)
    return Part("brows", patch, patch.positions(base), patch.triangles, np.clip(tint, 0, 255), gloss)


def _spread(skin: Submesh, tints: Float64) -> Float64:
    """Return the skin's tints on the base mesh's vertices, where a vertex is in the skin as it is."""
    out, own = np.zeros((skin.mix.shape[1], 3)), skin.sources()
    out[own[own >= 0]] = tints[own >= 0]
    return out


def _laid(skin: Submesh, base: Float64, flat: Float64, sheet: Int32) -> Submesh:
    """Return a sheet over places (n, 2) in the front view, on the skin's foremost triangle there."""
    at = skin.positions(base)
    low, high = flat.min(axis=0) - 0.01, flat.max(axis=0) + 0.01
    inside = ((at[:, :2] > low) & (at[:, :2] < high)).all(axis=1) & (at[:, 2] > -0.03)
    mine = skin.triangles[inside[skin.triangles].any(axis=1)]
    a, b, c = (at[mine[:, k], :2] for k in range(3))
    turn = flat_cross(b - a, c - a)
    mine, a, b, c, turn = (part[turn > 1e-9] for part in (mine, a, b, c, turn))
    place = flat[:, None]
    s = flat_cross(place - a, c - a) / turn
    t = flat_cross(b - a, place - a) / turn
    # The triangle that holds the place, or else the one that it misses by least; of several the foremost.
    out = np.maximum(np.maximum(-s, -t), np.maximum(s + t - 1, 0))
    best = (out - 0.001 * at[mine, 2].mean(axis=1) / 0.01).argmin(axis=1)
    row = np.arange(len(flat))
    s, t = s[row, best], t[row, best]
    corners, shares = mine[best], np.stack([1 - s - t, s, t], 1)
    pick = sp.csr_matrix((shares.ravel(), (np.repeat(row, 3), corners.ravel())), (len(flat), len(skin)))
    return skin.mixed(pick, sheet)


def lashes(base: Float64, lid: Lid, centre: Float64, skin: Any, colour: Any, look: Appearance) -> Part:
    """Return lashes: tapered fins on the lids' edges, longest in the outer half, lighter at their tips.

    A lash leans on its lid: where the edge falls further than the fold above it, the tip turns down.

    Args:
        centre: (3,) metres, the eyeball's; skin, colour: sRGB.
    """
    rng = np.random.default_rng(SEED)
    rows: list[tuple[dict[int, float], Float64]] = []
    triangles: list[tuple[int, int, int]] = []
    tints: list[Float64] = []
    dark, light = np.array(colour, float), np.array(skin, float)

    def put(mix: dict[int, float], place: Float64, fade: float) -> None:
        rows.append((mix, place - sum((share * base[i] for i, share in mix.items()), np.zeros(3))))
        tints.append(dark * (1 - fade) + light * fade)

    for margin, count, upper in ((lid.upper, UPPER, True), (lid.lower, LOWER, False)):
        edge = base[margin]
        run = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(edge, axis=0), axis=1))])
        run /= run[-1]
        for k in range(count):
            t = 0.10 + 0.87 * (k + 0.5 + rng.uniform(-0.3, 0.3)) / count
            long = (0.0009 + 0.0043 * smooth(t, 0.0, 0.75)) * (1 - 0.35 * smooth(t, 0.85, 1.0))
            long *= look.lash * (1 + rng.uniform(-0.18, 0.18)) * (1.0 if upper else 0.32)
            root = _between(edge, run, t)
            out = root - centre
            out /= np.linalg.norm(out)
            root = root + out * 0.0003
            along = _between(edge, run, min(t + 0.02, 1)) - _between(edge, run, t - 0.02)
            along /= np.linalg.norm(along)
            fan = (t - 0.42) * 1.1
            rise = np.array([0, 0.25 if upper else -0.55, 0])
            first = out + along * fan * 0.6 + rise * 0.4
            last = out * 0.55 + along * fan + (np.array([0, 0.95, 0.1]) if upper else rise)
            first, last = first / np.linalg.norm(first), last / np.linalg.norm(last)
            wide = along * (0.00026 if upper else 0.00014)
            j = int(np.clip(np.searchsorted(run, t) - 1, 0, len(margin) - 2))
            share = float((t - run[j]) / (run[j + 1] - run[j]))
            rooted = {margin[j]: 1 - share, margin[j + 1]: share}
            fold = lid.rings[3][int(np.argmin(np.linalg.norm(base[lid.rings[3]] - root, axis=1)))]
            middle = root + first * long * 0.5
            tip = middle + last * long * 0.5
            n = len(rows)
            put(rooted, root - wide, 0.0)
            put(rooted, root + wide, 0.0)
            for place, width, curl, fade in ((middle, 0.75, 0.5, 0.10), (tip, 0.0, 1.0, 0.45)):
                bent = rooted | {fold: -CURL * curl * (1 if upper else 0)}
                bent = {i: s * (1 + CURL * curl) if i != fold and upper else s for i, s in bent.items()}
                put(bent, place - wide * width, fade if upper else fade + 0.3)
                if width:
                    put(bent, place + wide * width, fade if upper else fade + 0.3)
            triangles += [(n, n + 1, n + 3), (n, n + 3, n + 2), (n + 2, n + 3, n + 4)]
    order = np.array(triangles, np.int32)
    mix = mix_of([row for row, _ in rows], len(base))
    patch = Submesh(mix, np.array([place for _, place in rows]), order)
    count = len(rows)
    return Part(
        "lashes", patch, patch.positions(base), order, np.array(tints), np.zeros(count), np.full(count, 0.8)
    )


def _between(edge: Float64, run: Float64, t: float) -> Float64:
    return np.array([np.interp(t, run, edge[:, k]) for k in range(3)])
