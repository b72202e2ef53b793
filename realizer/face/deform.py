"""Deforms a face: displacements by a sparse matrix, then rigid parts and eyelids."""

from typing import Any

import numpy as np

from realizer.core.array_types import Bool, Float32, Float64
from realizer.core.units import ANGLE_UNIT
from realizer.face.au.deformer import moves_of
from realizer.face.basis import (
    BEYOND,
    FAPS,
    JAW_COS,
    JAW_DROP,
    JAW_SIN,
    LIMITS,
    ROWS,
    TONGUE_COS,
    TONGUE_SIN,
    bulge_at,
)
from realizer.face.coupling import couple_lips, join_neighbours
from realizer.face.model import Face
from realizer.face.mouth_room import rooms

# Columns of poses.
OPEN_JAW, TONGUE_ROLL, HEAD, EYES, THRUST = 2, 46, slice(47, 50), slice(22, 26), slice(26, 28)
LIDS = slice(18, 22)  # upper left and right, lower left and right
CHUNK = 16  # frames at once, so that they fit into the processor's cache
LIMITED, MOST = np.array(list(LIMITS)) - 1, np.array(list(LIMITS.values()), np.float32)  # columns, FAPU
MAX_JAW_TURN = 0.42  # rad, 24 degrees
# Columns of rotations, which the sparse matrix does not apply. It has no rows for the rotations of eyeballs;
# eyes without eyeballs have rows.
ROTATING = [OPEN_JAW, TONGUE_ROLL, 47, 48, 49]


def deform(face: Face, poses: Any) -> Float32:
    """Return the vertices of a face in poses.

    FAPs move every face. If a face has a model of action units, its displacements are added to those of the
    FAPs. In both cases rigid parts turn, and lids slide over the eyeballs.

    Args:
        poses: (n, len(face.inputs)): FAP values in FAPU, column = FAP - 1 (FAPs 1 and 2 are ignored), then
            intensities 0..1 of the model's inputs, as `animation.pose` makes them; or (n, 68) FAPs alone.

    Returns:
        (n, n_vertices, 3) float32 metres.

    Raises:
        ValueError: another shape, or values that are not finite.
    """
    rows = complete_poses(poses, face.inputs)
    if not np.isfinite(rows).all():
        raise ValueError("poses: wanted finite values, got NaN or infinity")
    basis, units = face.basis, moves_of(face)
    rows, unit_values = rows[:, :FAPS], rows[:, FAPS:]
    moved: Bool = np.asarray(rows[:, LIDS.start : THRUST.stop].any(axis=1))
    if units is not None:
        shown, lips, mixing = (
            units.intensities(unit_values),
            unit_values[:, units.lips],
            unit_values[:, units.mixing],
        )
        moved |= units.lids(shown)
        # Where a unit closes the lids, FAPs of gaze and others must not move them further.
        rows = rows.copy()
        rows[:, LIDS] *= 1 - np.tile(units.closed(shown), 2)
    out = np.empty((len(rows), *face.vertices.shape), np.float32)
    weights = _weights(basis, rows)
    moved |= weights[:, BEYOND:].any(axis=1)
    first, last = basis["moving"]
    for start in range(0, len(rows), CHUNK):
        part = slice(start, start + CHUNK)
        here = out[part]
        here[:] = face.vertices
        moves = basis["fields"] @ np.ascontiguousarray(weights[part].T)
        here.reshape(len(here), -1)[:, 3 * first : 3 * last] += moves.T
        if units is not None:
            units(shown[part], lips[part], mixing[part], here)
        for room in rooms(face):
            room(here)
        _turn_eyes(basis, rows[part], here)
        _keep_lids_over_balls(basis, rows[part], moved[part], here)
        _turn_head(basis, rows[part], here)
    return out


def complete_poses(poses: Any, inputs: tuple[str, ...]) -> Float32:
    """Return poses (n, len(inputs)) float32, with zeros added to FAPs alone.

    Raises:
        ValueError: another shape.
    """
    rows = np.ascontiguousarray(poses, np.float32)
    if rows.ndim != 2 or rows.shape[1] not in (FAPS, len(inputs)):
        also = f" or (n, {len(inputs)})" if len(inputs) != FAPS else ""
        raise ValueError(f"poses: wanted (n, {FAPS}){also}, got {rows.shape}")
    return np.pad(rows, ((0, 0), (0, len(inputs) - rows.shape[1])))


def jaw_pose(basis: Any, opening: Any) -> tuple[Float64, Float64]:
    """Return the rotation (rad) and the slide (m) of the jaw that lower the chin (2.1) by `opening` metres.

    The jaw turns about its joint up to `MAX_JAW_TURN`; then the joint slides.
    """
    y, z = basis["chin"]
    opening = np.asarray(opening, np.float64)
    # y' = y cos a - z sin a, so y - y' = opening is one sine of a shifted angle.
    length, rest = float(np.hypot(y, z)), float(np.arctan2(y, z))
    turned = np.minimum(np.arcsin(np.clip((opening - y) / length, -1, 1)) + rest, MAX_JAW_TURN)
    reached = y - (y * np.cos(turned) - z * np.sin(turned))
    # The neutral face must be exact.
    return np.where(opening == 0, 0, turned), np.where(opening == 0, 0, opening - reached)


def _weights(basis: Any, rows: Float32) -> Float32:
    """Return the factors (n, 141) of the rows of the basis."""
    weights = np.zeros((len(rows), ROWS), np.float32)
    weights[:, 2:FAPS] = couple_lips(basis["contours"], join_neighbours(rows))[:, 2:]
    limited = weights[:, LIMITED]
    weights[:, BEYOND + LIMITED] = limited - np.clip(limited, -MOST, MOST)
    weights[:, ROTATING] = 0
    jaw, slid = jaw_pose(basis, rows[:, OPEN_JAW].astype(np.float64) * basis["open_jaw"])
    weights[:, JAW_COS], weights[:, JAW_SIN] = 1 - np.cos(jaw), np.sin(jaw)
    weights[:, JAW_DROP] = slid
    roll = rows[:, TONGUE_ROLL] * ANGLE_UNIT
    weights[:, TONGUE_COS], weights[:, TONGUE_SIN] = 1 - np.cos(roll), np.sin(roll)
    return weights


def rotations(pitch: Float32, yaw: Float32, roll: Float32) -> Float32:
    """Return rotations (n, 3, 3): radians of pitch down, yaw to the character's left, roll to the right."""
    (a, b, c), (d, e, f) = np.cos([pitch, yaw, roll]), np.sin([pitch, yaw, roll])
    zero, one = np.zeros_like(a), np.ones_like(a)

    def stack(*rows: tuple[Any, Any, Any]) -> Any:
        return np.stack([np.stack(row, -1) for row in rows], -2)

    about_x = stack((one, zero, zero), (zero, a, -d), (zero, d, a))
    about_y = stack((b, zero, e), (zero, one, zero), (-e, zero, b))
    about_z = stack((c, -f, zero), (f, c, zero), (zero, zero, one))
    turned: Float32 = (about_y @ about_x @ about_z).astype(np.float32)
    return turned


def _turn_eyes(basis: Any, rows: Float32, out: Float32) -> None:
    angles = rows[:, EYES] * np.float32(ANGLE_UNIT)
    for side, ((first, last), centre) in enumerate(basis["eyes"]):
        yaw, pitch = angles[:, side], angles[:, 2 + side]
        if yaw.any() or pitch.any():
            turn = rotations(pitch, yaw, np.zeros_like(yaw))
            out[:, first:last] = (out[:, first:last] - centre) @ turn.transpose(0, 2, 1) + centre
        thrust = rows[:, THRUST][:, side]
        if thrust.any():
            out[:, first:last, 2] += (thrust * basis["thrust"])[:, None]


def _keep_lids_over_balls(basis: Any, rows: Float32, moved: Bool, out: Float32) -> None:
    """Move vertices of lids forwards until they are as far from ball and cornea as at rest."""
    frames = np.flatnonzero(moved)
    pushed = rows[frames][:, THRUST] * basis["thrust"]
    axes = _axes(rows[frames])
    for k, (_, centre) in enumerate(basis["eyes"]):
        mine = basis["lid_eye"] == k
        lid = basis["lid"][mine]
        at = out[np.ix_(frames, lid)]
        away = at - centre
        away[..., 2] -= pushed[:, k, None]
        least = basis["lid_radius"][mine] + bulge_at(basis["bulges"][k], away, axes[:, k, None])
        room = np.square(least) - np.square(away[..., 0]) - np.square(away[..., 1])
        push = np.sqrt(np.maximum(room, 0)) - away[..., 2]
        at[..., 2] += np.where(room > 0, np.maximum(push, 0), 0)
        out[np.ix_(frames, lid)] = at


def _axes(rows: Float32) -> Float32:
    """Return the unit vectors (n, 2, 3) along which the eyes look."""
    yaw, pitch = np.moveaxis((rows[:, EYES] * np.float32(ANGLE_UNIT)).reshape(-1, 2, 2), 1, 0)
    return np.stack([np.sin(yaw) * np.cos(pitch), -np.sin(pitch), np.cos(yaw) * np.cos(pitch)], axis=-1)


def _turn_head(basis: Any, rows: Float32, out: Float32) -> None:
    angles = rows[:, HEAD] * np.float32(ANGLE_UNIT)
    if not angles.any():
        return
    turns = rotations(*angles.T) - np.eye(3, dtype=np.float32)
    for vertices, turn in zip(out, turns, strict=True):
        moves = vertices @ turn.T
        moves -= turn @ basis["head_pivot"]
        moves *= basis["head"]
        vertices += moves
