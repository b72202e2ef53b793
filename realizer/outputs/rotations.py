"""Rotations of head and eyes as quaternions."""

import numpy as np

from realizer.core.array_types import Float32


def quaternions(turns: Float32) -> Float32:
    """Convert pitch, yaw, roll (n, 3) to x, y, z, w (n, 4), as `face.deform` does: roll first, yaw last."""
    from scipy.spatial.transform import Rotation

    rotations = Rotation.from_euler("YXZ", turns[:, [1, 0, 2]].astype(np.float64)).as_quat()
    out: Float32 = np.where(rotations[:, 3:] < 0, -rotations, rotations).astype(np.float32)
    return out


def half_turns(turns: Float32) -> Float32:
    """Return quaternions (n, 4), w >= 0, of half the angles: neck and head turn by half each."""
    out: Float32 = turns + np.array([0, 0, 0, 1], np.float32)
    out /= np.linalg.norm(out, axis=-1, keepdims=True)
    return out
