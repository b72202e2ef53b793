"""Morph targets with ARKit's names: any program that drives an ARKit head drives the exported one."""

import numpy as np

from realizer.animation.arkit import ARKIT_NAMES, arkit, shape_faps
from realizer.outputs.morph_targets import EYES, HEAD, NEGLIGIBLE, MorphTargets
from realizer.realization import Realization


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
