"""Morph targets and weights that reproduce a face's poses within a tolerance."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from realizer.animation.axis import fap
from realizer.core.array_types import Float32, Float64
from realizer.core.units import ANGLE_UNIT

if TYPE_CHECKING:
    from realizer.face.model import Face

HEAD = (48, 49, 50)  # FAPs that turn the head: pitch, yaw, roll
EYES = ((25, 23), (26, 24))  # and the eyeballs: pitch and yaw of the left, of the right
THRUST = (27, 28)  # and what pushes them forward
TRUE = 1e-4  # m; no vertex is further off in any frame
SEEN = 5e-6  # m; what a target moves less stays out of it
CHUNK = 64  # frames at once
FIRST = 256  # frames, all over the performance, that are looked at first


@dataclass(frozen=True, eq=False)
class MorphTargets:
    """What poses of a face are made of, up to a tenth of a millimetre.

    Attributes:
        names: (k,) of the targets: FAPs and action units as they are called, then "correction 1", ...; what
            goes the other way is a target of its own, "open_jaw reversed".
        moves: (k, n_vertices, 3) float32 metres at weight 1.
        weights: (n, k) float32, 0..1: many programs cut off what is less or more.
        head: (n, 3) float32 radians: pitch, yaw, roll; the vertices turn by `basis["head"]` of it.
        eyes: (n, 2, 2) float32 radians: pitch and yaw of the left and the right eyeball; zeros where the eyes
            are no balls.
        thrust: (n, 2) float32 metres that the eyeballs stand forward, in the head.
    """

    names: tuple[str, ...]
    moves: Float32
    weights: Float32
    head: Float32
    eyes: Float32
    thrust: Float32


def make_morph_targets(face: Face, poses: Float32) -> MorphTargets:
    """Targets of what is used, and of what they do not make when they come together.

    Each column that the poses use is a target: what it alone does at its strongest. What remains (the jaw
    goes in an arc, lids slide over eyeballs, contours of a lip hold together) is made of as many principal
    components as it takes.

    Args:
        poses: (n, len(face.takes)), `Realization.poses`.
    """
    from realizer.face.deform import deform

    still = poses.copy()
    columns = {name: k for k, name in enumerate(face.inputs)}
    head = still[:, _columns(columns, HEAD)] * np.float32(ANGLE_UNIT)
    still[:, _columns(columns, HEAD)] = 0
    eyes, thrust = np.zeros((len(poses), 2, 2), np.float32), np.zeros((len(poses), 2), np.float32)
    shaped = np.ones(len(face.vertices), bool)
    for eye, ((first, last), _) in enumerate(face.basis["eyes"]):
        if last > first:
            shaped[first:last] = False
            eyes[:, eye] = still[:, _columns(columns, EYES[eye])] * np.float32(ANGLE_UNIT)
            still[:, _columns(columns, EYES[eye])] = 0
            # Lids go with the ball, so its push stays.
            thrust[:, eye] = still[:, columns[fap(THRUST[eye]).name]] * face.basis["thrust"]
    rest = face.vertices.astype(np.float64)

    def moved(rows: Float32) -> Float64:
        moves = deform(face, rows) - rest
        moves[:, ~shaped] = 0
        return np.asarray(moves.reshape(len(rows), -1))

    names, targets, weights = _used(face, still, moved)
    found = np.empty((0, rest.size))
    whole = [np.arange(len(still))[k : k + CHUNK] for k in range(0, len(still), CHUNK)]
    spread = np.unique(np.linspace(0, len(still) - 1, min(FIRST, len(still))).astype(int))
    for frames in (spread, *whole):
        left = moved(still[frames]) - weights[frames] @ targets
        left -= left @ found.T @ found
        found = np.concatenate([found, _components(left)])
    shares = np.zeros((len(still), len(found)))
    for frames in whole:
        shares[frames] = (moved(still[frames]) - weights[frames] @ targets) @ found.T
    more, ways, shares = _one_way(shares, [f"correction {k + 1}" for k in range(len(found))])
    moves = np.concatenate([targets, ways @ found]).reshape(-1, len(face.vertices), 3)
    moves[np.abs(moves).max(axis=2) < SEEN] = 0
    return MorphTargets(
        (*names, *more),
        moves.astype(np.float32),
        np.concatenate([weights, shares], axis=1).astype(np.float32),
        head,
        eyes,
        thrust,
    )


def _columns(columns: Mapping[str, int], numbers: tuple[int, ...]) -> list[int]:
    return [columns[fap(number).name] for number in numbers]


def _one_way(values: Any, names: Sequence[str]) -> tuple[list[str], Float64, Float64]:
    """Columns (n, k) that go both ways as (n, m) that go from 0 to 1; (m, k) what each of these is at 1."""
    both = np.maximum(np.stack([values, -values]), 0.0).astype(np.float64)
    most = both.max(axis=1)
    found = [(k, way) for k in range(len(names)) for way in (0, 1) if most[way, k] > 0]
    ways, weights = np.zeros((len(found), len(names))), np.empty((len(values), len(found)))
    for row, (k, way) in enumerate(found):
        ways[row, k] = most[way, k] * (1 - 2 * way)
        weights[:, row] = both[way, :, k] / most[way, k]
    return [names[k] + " reversed" * way for k, way in found], ways, weights


def _used(
    face: Face, still: Float32, moved: Callable[[Float32], Float64]
) -> tuple[list[str], Float64, Float64]:
    """Names, (k, 3 n_vertices) moves and (n, k) weights of the columns that alone move anything."""
    names, alone, weights = _one_way(still, face.inputs)
    moves = moved(alone.astype(np.float32)) if names else np.empty((0, 3 * len(face.vertices)))
    kept = np.flatnonzero(np.abs(moves).max(axis=1, initial=0) > SEEN)
    return [names[k] for k in kept], moves[kept], weights[:, kept]


def _components(left: Float64) -> Float64:
    """The fewest principal components, (k, m) orthonormal, that leave no vertex of (n, m) off by TRUE."""
    if np.abs(left).max(initial=0) <= TRUE / 2:
        return np.empty((0, left.shape[1]))
    # Of the few frames' own products: they are fewer than coordinates.
    sizes, mixes = np.linalg.eigh(left @ left.T)
    order = np.argsort(-sizes)
    order = order[sizes[order] > 1e-12 * sizes.max()]
    axes = (mixes[:, order] / np.sqrt(sizes[order])).T @ left
    for k in range(1, len(axes) + 1):
        rest = left - left @ axes[:k].T @ axes[:k]
        if np.linalg.norm(rest.reshape(len(left), -1, 3), axis=2).max() <= TRUE / 2:
            return np.asarray(axes[:k])
    return np.asarray(axes)
