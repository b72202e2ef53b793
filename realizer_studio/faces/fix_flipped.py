"""Removal of triangle flips from displacement fields."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from realizer.core.array_types import Bool, Float32, Float64, Int32
from realizer.face.basis import BEYOND, FAPS, JAW_COS, JAW_DROP, JAW_SIN, ROWS
from realizer.face.coupling import CONTOURS, Contours, contours_of, couple_lips
from realizer.face.deform import jaw_pose
from realizer.face.mesh_geometry import triangle_normals
from realizer.face.model import Fapu
from realizer.tables import faps
from realizer_studio.faces.mpeg4.fap_limits import OPEN_JAW, ROLLED, accompanying_faps, required_range

ROUNDS = 60
PASSES = 6  # repairs of neighbouring fields interact
MIN_STEP = 1e-4
SHARE = 0.5  # of the difference from the mean of the flipped triangles, removed in each round

# The fields of the lips add up to one along a lip, so they are softened together.
LIPS = frozenset({*range(4, 14), *range(51, 61), 16, 17})
JAW = (JAW_COS + 1, JAW_SIN + 1, JAW_DROP + 1)


def flipped_triangles(rest: Float64, now: Float64, triangles: Int32, cosine: float = 0.0) -> Bool:
    """Return which triangles (m,) have turned by more than the angle with this cosine."""
    before, after = triangle_normals(rest, triangles), triangle_normals(now, triangles)
    sizes = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    flipped: Bool = np.asarray((before * after).sum(axis=1) < cosine * sizes)
    return flipped


def soften_flips(
    fields: Float64,
    at: Float64,
    triangles: Int32,
    plays: Sequence[tuple[Float64, Any, float]],
    fixed: Collection[int],
) -> Float64:
    """Return fields that flip no triangle: they are softened together around flipped triangles.

    Where softening does not lead to fewer flips, the fields are returned as they are: it would make lumps.

    Args:
        fields: (g, n, 3) metres per metre of FAP; at: (n, 3) metres; triangles: (m, 3).
        plays: amounts (g,) of the fields in metres, signed; the displacement (n, 3) that accompanies them;
            and the cosine of the angle at which a triangle counts as flipped.
        fixed: vertices that keep their displacement.
    """

    def flips_of(fields: Float64, plays: Sequence[tuple[Float64, Any, float]]) -> list[Bool]:
        return [
            flipped_triangles(at, at + np.tensordot(amounts, fields, 1) + along, triangles, cosine)
            for amounts, along, cosine in plays
        ]

    out = fields.copy()
    free = np.ones(len(at), bool)
    free[list(fixed)] = False
    watched = list(plays)
    for _ in range(ROUNDS):
        flipped = flips_of(out, watched)
        bad = np.any(flipped, axis=0)
        if not bad.any():
            if len(watched) == len(plays):
                return out
            watched = list(plays)
            continue
        # Combinations without flips are checked again when no others are left.
        watched = [play for play, flips in zip(watched, flipped, strict=True) if flips.any()]
        # A triangle whose corners move alike does not turn.
        corners = triangles[bad]
        count = np.bincount(corners.ravel(), minlength=len(at))
        loose = np.flatnonzero((count > 0) & free)
        step = np.empty((len(out), len(loose), 3))
        for k, field in enumerate(out):
            pulled = np.zeros_like(at)
            np.add.at(pulled, corners.ravel(), np.repeat(field[corners].mean(axis=1), 3, axis=0))
            step[k] = SHARE * (pulled[loose] / count[loose, None] - field[loose])
        if np.abs(step).max(initial=0.0) < MIN_STEP:
            break  # the remaining flips come from coupled movement
        out[:, loose] += step
    before, after = (np.sum(flips_of(some, plays)) for some in (fields, out))
    return out if after < before else fields


def without_flips(
    fields: Mapping[int, Float64],
    at: Float64,
    triangles: Int32,
    points: Mapping[str, int],
    fapu: Fapu,
    pivot: Float64,
    twin: Int32,
) -> dict[int, Float64]:
    """Return fields of FAPs that flip no triangle; feature points keep their displacement.

    Each FAP is tried at its required range, with the coupled contour of the lips, and with the other FAPs of
    the action unit that uses it most.

    Args:
        fields: row number (`basis`) -> (n, 3); at: (n, 3) metres; triangles: (m, 3).
        points: feature point -> vertex; pivot: (3,), of the jaw.
        twin: (n,) each vertex's mirror image, or the vertex itself.
    """
    out = {number: np.array(field, np.float64) for number, field in fields.items()}
    contours = contours_of(
        {name: np.asarray(at[vertex], np.float32) for name, vertex in points.items()}, fapu
    )
    chin = at[points["2.1"], 1:] - pivot[1:]
    fixed = np.zeros(len(at), bool)
    fixed[list(points.values())] = True
    for _ in range(PASSES):
        for requested, mended in _groups(out):
            moving = np.any([np.abs(out[n]).any(axis=1) for n in mended], axis=0)
            region = triangles[moving[triangles].any(axis=1)]
            if not len(region):
                continue
            vertices, local = np.unique(region, return_inverse=True)
            rest = sorted(set(out) - set(mended))
            fixed_fields = np.stack([out[n][vertices] for n in rest])
            plays = []
            for values, cosine in _played(requested, contours):
                metres = _metres(values, fapu, chin)
                accompanying = np.tensordot(metres[np.array(rest) - 1], fixed_fields, 1)
                plays.append((metres[np.array(mended) - 1], accompanying, cosine))
            soft = soften_flips(
                np.stack([out[n][vertices] for n in mended]),
                at[vertices], local.reshape(region.shape), plays, np.flatnonzero(fixed[vertices]).tolist(),
            )  # fmt: skip
            for number, field in zip(mended, soft, strict=True):
                out[number][vertices] = field
        out = symmetrize(out, twin)
    return out


def _groups(fields: Mapping[int, Float64]) -> list[tuple[list[int], list[int]]]:
    """Return groups of FAPs to try, with the fields to soften together: a pair, all lips, the jaw."""
    table = faps()
    left = [n for n in sorted(fields) if n <= FAPS and n not in LIPS]
    pairs = sorted({tuple(sorted({n, table[n - 1].mirror})) for n in left})
    jaw = [([OPEN_JAW], [n for n in JAW if n in fields])]
    lips = sorted(LIPS & set(fields))
    groups = [*jaw, *((list(pair), list(pair)) for pair in pairs), (lips, lips)]
    return [(requested, mended) for requested, mended in groups if mended]


def _played(numbers: Sequence[int], contours: Contours) -> list[tuple[Float32, float]]:
    """Return FAP values (68,) that each of the FAPs must support, and the cosine of a flip."""
    table, out = faps(), []
    partner = {**CONTOURS, **{outer: inner for inner, outer in CONTOURS.items()}}
    for number in numbers:
        for sign in (1, -1) if table[number - 1].least < 0 else (1,):
            requested = np.zeros((3, FAPS), np.float32)
            requested[:2, number - 1] = sign * required_range(number, sign)
            requested[1, partner.get(number, number) - 1] = requested[0, number - 1]
            for fap, value in accompanying_faps(number, sign).items():
                requested[2, fap - 1] = value
            alone, paired, accompanied = couple_lips(contours, requested)
            out += [(alone, 0.0), (paired, 0.0), (accompanied, ROLLED)]
    return out


def _metres(values: Float32, fapu: Fapu, chin: Float64) -> Float64:
    """Return the amount of each field (141,) for FAP values (68,)."""
    out = np.zeros(ROWS)
    out[:FAPS] = values * [fapu.metres(row.unit) for row in faps()]
    turn, slid = jaw_pose({"chin": chin}, out[OPEN_JAW - 1])
    out[[JAW_COS, JAW_SIN, JAW_DROP]] = 1 - np.cos(turn), np.sin(turn), slid
    out[OPEN_JAW - 1] = 0
    return out


def symmetrize(fields: Mapping[int, Float64], twin: Int32) -> dict[int, Float64]:
    """Return symmetric fields, each the mean of itself and the mirror image of the other side's field."""
    table, flip = faps(), np.array([-1.0, 1.0, 1.0])
    out = {}
    for number, field in fields.items():
        block, fap = divmod(number - 1, BEYOND)
        mirror, sign = (table[fap].mirror, table[fap].sign) if fap < FAPS else (number, 1)
        out[number] = (field + sign * fields[block * BEYOND + mirror][twin] * flip) / 2
    return out
