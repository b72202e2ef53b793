"""The jaw joint and its vertex weights, found from the shape of an opening jaw."""

import numpy as np

from realizer.core.array_types import Float64

STRONG = 0.7  # of the largest move: there the skin is the bone's
FAR = 0.7  # distances between the eyes; a joint farther than that from where joints are is none


def joint_of(at: Float64, move: Float64, usual: Float64, eyes: float) -> tuple[Float64, bool]:
    """Return the axis of the jaw (3,) in metres, found from what a jaw-opening shape moves most.

    A turn about +x by a moves y and z by A (p - c), A = [[cos a - 1, -sin a], [sin a, cos a - 1]]: two
    numbers and a shift, which least squares find.

    Args:
        at: (n, 3) metres; move: (n, 3), the jaw's opening.
        usual: (3,) the joint by proportions; eyes: metres between the eyes.

    Returns:
        The joint, and whether it was found from the shape; if not, it is `usual`.
    """
    size = np.linalg.norm(move, axis=1)
    if size.max() < 1e-6:
        return usual, False
    mine = size > STRONG * size.max()
    y, z = at[mine, 1], at[mine, 2]
    one, none = np.ones_like(y), np.zeros_like(y)
    rows = np.concatenate(
        [np.stack([y, -z, one, none], 1), np.stack([z, y, none, one], 1)]
    )  # unknown: cos a - 1, sin a, shift of y, shift of z
    (c, s, dy, dz), *_ = np.linalg.lstsq(rows, np.concatenate([move[mine, 1], move[mine, 2]]), rcond=None)
    turn = np.array([[c, -s], [s, c]])
    if abs(np.linalg.det(turn)) < 1e-6:
        return usual, False
    place = np.array([usual[0], *np.linalg.solve(turn, [-dy, -dz])])
    plausible = bool(s > 0 and np.linalg.norm(place - usual) < FAR * eyes)
    return (place, True) if plausible else (usual, False)


def drag_of(at: Float64, move: Float64, pivot: Float64, chin: int) -> Float64:
    """Return how far each vertex follows the jaw when it opens as in the shape, (n,) 0..1.

    Args:
        move: (n, 3), the opening; chin: the vertex that goes all the way.
    """
    arm = at - pivot
    angle = float(np.linalg.norm(move[chin, 1:]) / max(float(np.linalg.norm(arm[chin, 1:])), 1e-9))
    turned = np.zeros_like(arm)
    turned[:, 1] = arm[:, 1] * (np.cos(angle) - 1) - arm[:, 2] * np.sin(angle)
    turned[:, 2] = arm[:, 1] * np.sin(angle) + arm[:, 2] * (np.cos(angle) - 1)
    share = (move * turned).sum(axis=1) / np.maximum((turned**2).sum(axis=1), 1e-12)
    share = share / max(float(share[chin]), 1e-6)
    return np.asarray(np.clip(share, 0, 1))
