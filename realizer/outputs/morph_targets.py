"""Morph targets and weights that show a face's poses: within a tolerance, or by ARKit's 52 shapes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from realizer.animation.arkit import ARKIT_NAMES, arkit, shape_faps
from realizer.animation.axis import fap
from realizer.core.array_types import Float32, Float64
from realizer.core.units import ANGLE_UNIT
from realizer.face.model import Face
from realizer.realization import Realization

HEAD = (48, 49, 50)  # FAPs that turn the head: pitch, yaw, roll
EYES = ((25, 23), (26, 24))  # FAPs that turn the eyeballs: pitch and yaw of the left, of the right
THRUST = (27, 28)  # FAPs that push them forward
TOLERANCE = 1e-4  # m; greatest error of a vertex in any frame
NEGLIGIBLE = 5e-6  # m; smaller movements are omitted from a target
CHUNK = 64  # frames at once
SAMPLED = 256  # frames, spread over the performance, that are analysed first


@dataclass(frozen=True, eq=False)
class MorphTargets:
    """Morph targets and weights that reproduce poses of a face within a tenth of a millimetre.

    Attributes:
        names: (k,) of the targets: FAPs and action units, then "correction 1", ...; the opposite direction is
            a target of its own, such as "open_jaw reversed".
        moves: (k, n_vertices, 3) float32 metres at weight 1.
        weights: (n, k) float32, 0..1, because many programs clip other values.
        head: (n, 3) float32 radians: pitch, yaw, roll; vertices rotate by the part `basis["head"]` of it.
        eyes: (n, 2, 2) float32 radians: pitch and yaw of the left and the right eyeball; zeros if the face
            has no separate eyeballs.
        thrust: (n, 2) float32 metres by which the eyeballs are pushed forward in the head.
    """

    names: tuple[str, ...]
    moves: Float32
    weights: Float32
    head: Float32
    eyes: Float32
    thrust: Float32


def make_morph_targets(face: Face, poses: Float32) -> MorphTargets:
    """Return targets for the used columns, and corrections for their combinations.

    Each used column is a target: the movement of its strongest value alone. The remaining differences (the
    jaw moves in an arc, lids slide over eyeballs, contours of a lip hold together) are corrected by as many
    principal components as necessary.

    Args:
        poses: (n, len(face.inputs)), `Realization.poses`.
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
            # Lids move with the ball, so the thrust remains in the shape.
            thrust[:, eye] = still[:, columns[fap(THRUST[eye]).name]] * face.basis["thrust"]
    rest = face.vertices.astype(np.float64)

    def moved(rows: Float32) -> Float64:
        moves = deform(face, rows) - rest
        moves[:, ~shaped] = 0
        return np.asarray(moves.reshape(len(rows), -1))

    names, targets, weights = _used(face, still, moved)
    found = np.empty((0, rest.size))
    whole = [np.arange(len(still))[k : k + CHUNK] for k in range(0, len(still), CHUNK)]
    spread = np.unique(np.linspace(0, len(still) - 1, min(SAMPLED, len(still))).astype(int))
    for frames in (spread, *whole):
        left = moved(still[frames]) - weights[frames] @ targets
        left -= left @ found.T @ found
        found = np.concatenate([found, _components(left)])
    shares = np.zeros((len(still), len(found)))
    for frames in whole:
        shares[frames] = (moved(still[frames]) - weights[frames] @ targets) @ found.T
    more, ways, shares = _one_way(shares, [f"correction {k + 1}" for k in range(len(found))])
    moves = np.concatenate([targets, ways @ found]).reshape(-1, len(face.vertices), 3)
    moves[np.abs(moves).max(axis=2) < NEGLIGIBLE] = 0
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
    """Split signed columns (n, k) into weights (n, m), 0..1; return names, values (m, k) at 1, weights."""
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
    """Return names, moves (k, 3 n_vertices) and weights (n, k) of the columns that move vertices."""
    names, alone, weights = _one_way(still, face.inputs)
    moves = moved(alone.astype(np.float32)) if names else np.empty((0, 3 * len(face.vertices)))
    kept = np.flatnonzero(np.abs(moves).max(axis=1, initial=0) > NEGLIGIBLE)
    return [names[k] for k in kept], moves[kept], weights[:, kept]


def _components(left: Float64) -> Float64:
    """Return the fewest orthonormal components (k, m) that bring errors (n, m) below TOLERANCE."""
    if np.abs(left).max(initial=0) <= TOLERANCE / 2:
        return np.empty((0, left.shape[1]))
    # By the products of frames, which are fewer than coordinates.
    sizes, mixes = np.linalg.eigh(left @ left.T)
    order = np.argsort(-sizes)
    order = order[sizes[order] > 1e-12 * sizes.max()]
    axes = (mixes[:, order] / np.sqrt(sizes[order])).T @ left
    for k in range(1, len(axes) + 1):
        rest = left - left @ axes[:k].T @ axes[:k]
        if np.linalg.norm(rest.reshape(len(left), -1, 3), axis=2).max() <= TOLERANCE / 2:
            return np.asarray(axes[:k])
    return np.asarray(axes)


def make_arkit_targets(realization: Realization) -> MorphTargets:
    """Return ARKit's 52 shapes of the first character's face, and the weights that come nearest to it.

    Each shape is what the FAPs of its action unit make of the face. Head and eyeballs turn by joints.
    """
    from realizer.face.deform import deform

    face, frames = realization.face, arkit(realization.aus, realization.mapping)
    rows = shape_faps(realization.mapping).astype(np.float32)
    rows[:, [fap - 1 for fap in HEAD]] = 0
    balls = np.zeros(len(face.vertices), bool)
    eyes = frames.eyes[..., ::-1].copy()
    for eye, ((first, last), _) in enumerate(face.basis["eyes"]):
        balls[first:last] = True
        if last > first:
            rows[:, [fap - 1 for fap in EYES[eye]]] = 0
        else:
            eyes[:, eye] = 0
    moves = deform(face, rows) - face.vertices
    moves[:, balls] = 0
    moves[np.abs(moves).max(axis=2) < NEGLIGIBLE] = 0
    return MorphTargets(
        ARKIT_NAMES(),
        moves.astype(np.float32),
        frames.weights,
        frames.head[:, [1, 0, 2]],
        eyes,
        np.zeros((len(eyes), 2), np.float32),
    )
