"""The network that hears visemes: probabilities of classes from mel frames."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from realizer.core.array_types import Float32
from realizer.speech.sound_visemes.mel_stream import BANDS, QUIETEST

WEIGHTS = Path(__file__).with_name("weights.npz")
# The context of a frame: each frame near it, and every other one before.
PAST, FUTURE = 25, 7
OFFSETS = np.array([*range(-PAST, -9, 2), *range(-8, FUTURE + 1)])
LAYERS = 3
FLOOR = 14.0  # bands this much below the loud level are silent; natural logarithm of power
SCALE = 3.0  # about the standard deviation of the logarithms
SILENT = float(np.log(QUIETEST))


@cache
def _arrays() -> dict[str, Float32]:
    with np.load(WEIGHTS) as file:
        return {name: file[name].astype(np.float32) for name in file.files}


def shares() -> Float32:
    """Return the share of each class in the training, which its probabilities contain."""
    return _arrays()["shares"]


def context(log: Float32, level: Float32, mean: Float32) -> Float32:
    """Return the inputs (..., frames x BANDS) of the network.

    Args:
        log: (..., frames, BANDS) of the frames at `OFFSETS`.
        level, mean: (...,) and (..., BANDS) at the last of these frames.
    """
    loud = np.maximum(log - level[..., None, None], np.float32(-FLOOR)) - mean[..., None, :]
    inputs: Float32 = (loud * np.float32(1 / SCALE)).reshape(*log.shape[:-2], len(OFFSETS) * BANDS)
    return inputs


def log_probabilities(inputs: Float32) -> Float32:
    """Return the logarithms (..., classes) of the probabilities; the last two axes are one product."""
    arrays, x = _arrays(), inputs
    for k in range(LAYERS):
        x = x @ arrays[f"w{k}"] + arrays[f"b{k}"]
        if k + 1 < LAYERS:
            x = np.maximum(x, 0)
    x = x - x.max(axis=-1, keepdims=True)
    found: Float32 = x - np.log(np.exp(x).sum(axis=-1, keepdims=True))
    return found
