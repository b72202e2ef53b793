"""Displacement fields in, the same out without triangles that turn over when they are played."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from realizer.arrays import Float32, Float64, Int32
from realizer.face.basis import FAPS, JAW_COS, JAW_DROP, JAW_SIN
from realizer.face.contours import CONTOURS, contours_of, together
from realizer.face.deform import jaw_pose
from realizer.face.model import Fapu
from realizer.face.mpeg4.reach import OPEN_JAW, ROLLED, company, usual
from realizer.tables import faps

__all__: list[str] = []

ROUNDS = 60
PASSES = 2  # neighbours that were mended change what a field has to fit
STILL = 1e-4
SHARE = 0.5  # of the way to the mean of the triangles that turn over, each round


def turned(rest: Float64, now: Float64, triangles: Int32, cosine: float = 0.0) -> Any:
    """(m,) which triangles face away from where they faced at rest: turned past the angle of this cosine."""
    before, after = _ups(rest[triangles]), _ups(now[triangles])
    sizes = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    return np.asarray((before * after).sum(axis=1) < cosine * sizes)


def untangled(
    field: Float64,
    at: Float64,
    triangles: Int32,
    plays: Sequence[tuple[float, Any, float]],
    fixed: Collection[int],
) -> Float64:
    """The field, softened around the triangles that it turns over, until it turns none over.

    Args:
        field: (n, 3) metres for each metre that is asked; at: (n, 3) metres; triangles: (m, 3).
        plays: metres (signed) up to which the field is played, each with what moves along then, (n, 3),
            and the cosine of the turn that counts.
        fixed: vertices that keep their move.
    """
    out = field.copy()
    free = np.ones(len(at), bool)
    free[list(fixed)] = False
    moving = (np.abs(field) > 0).any(axis=1)
    triangles = triangles[moving[triangles].any(axis=1)]
    for _ in range(ROUNDS):
        bad: Any = np.zeros(len(triangles), bool)
        for amount, along, cosine in plays:
            moves = amount * out + along
            bad |= turned(at, at + moves, triangles, cosine)
        if not bad.any():
            break
        # A triangle that moves as one cannot turn over.
        corners = triangles[bad]
        count = np.bincount(corners.ravel(), minlength=len(at))
        whole = np.repeat(out[corners].mean(axis=1), 3, axis=0)
        pulled = np.stack([np.bincount(corners.ravel(), whole[:, k], len(at)) for k in range(3)], axis=1)
        loose = (count > 0) & free
        step = SHARE * (pulled[loose] / count[loose, None] - out[loose])
        if np.abs(step).max(initial=0.0) < STILL:
            break  # what is left comes from what moves along
        out[loose] += step
    return out


def without_flips(
    fields: Mapping[int, Float64],
    at: Float64,
    triangles: Int32,
    points: Mapping[str, int],
    fapu: Fapu,
    pivot: Float64,
    twin: Int32,
) -> dict[int, Float64]:
    """Fields of FAPs that turn no triangle over; feature points keep their moves.

    Each is played as far as is usual, with the contour of the lips that it drags along or that goes with it,
    and with all that the action unit asks for that asks most of it.

    Args:
        fields: row number (`basis`) -> (n, 3); at: (n, 3) metres; triangles: (m, 3).
        points: feature point -> vertex; pivot: (3,), where the jaw turns.
        twin: (n,) each vertex's mirror image, itself where it has none.
    """
    table, out = faps(), dict(fields)
    contours = contours_of(
        {name: np.asarray(at[vertex], np.float32) for name, vertex in points.items()}, fapu
    )
    partner = {**CONTOURS, **{outer: inner for inner, outer in CONTOURS.items()}}
    chin = at[points["2.1"], 1:] - pivot[1:]
    for _ in range(PASSES):
        for number in sorted(n for n in out if n <= FAPS and np.abs(out[n][triangles]).any()):
            row, plays = table[number - 1], []
            for sign in (1, -1) if row.least < 0 else (1,):
                asked = np.zeros((3, FAPS), np.float32)
                asked[:2, number - 1] = sign * usual(number, sign)
                asked[1, partner.get(number, number) - 1] = asked[0, number - 1]
                for fap, value in company(number, sign).items():
                    asked[2, fap - 1] = value
                for values, cosine in zip(together(contours, asked), (0.0, 0.0, ROLLED), strict=True):
                    if values[number - 1]:
                        plays.append((*_played(values, number, out, fapu, chin), cosine))
            out[number] = untangled(out[number], at, triangles, plays, list(points.values()))
        out = even(out, twin)
    return out


def even(fields: Mapping[int, Float64], twin: Int32) -> dict[int, Float64]:
    """The fields as even as a face is: each the mean of itself and its twin's mirror image."""
    table, flip = faps(), np.array([-1.0, 1.0, 1.0])
    out = {}
    for number, field in fields.items():
        mirror, sign = (table[number - 1].mirror, table[number - 1].sign) if number <= FAPS else (number, 1)
        out[number] = (field + sign * fields[mirror][twin] * flip) / 2
    return out


def _played(
    values: Float32, number: int, fields: Mapping[int, Float64], fapu: Fapu, chin: Float64
) -> tuple[float, Float64]:
    """Metres that a FAP's own field is played by under FAP values (68,), and what all others do then."""
    units = [fapu.metres(row.unit) for row in faps()]
    along = np.zeros_like(fields[number])
    for k in np.flatnonzero(values).tolist():
        if k + 1 == OPEN_JAW:
            turn, slid = jaw_pose({"chin": chin}, float(values[k]) * units[k])
            for part, share in ((JAW_COS, 1 - np.cos(turn)), (JAW_SIN, np.sin(turn)), (JAW_DROP, slid)):
                along += float(share) * fields[part + 1]
        elif k + 1 != number and k + 1 in fields:
            along += float(values[k]) * units[k] * fields[k + 1]
    return float(values[number - 1]) * units[number - 1], along


def _ups(corners: Float64) -> Float64:
    a, b, c = corners.transpose(1, 0, 2)
    return np.asarray(np.cross(b - a, c - a))
