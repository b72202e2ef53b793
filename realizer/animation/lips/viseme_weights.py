"""Weights of MPEG-4 (FAP 1) and Oculus visemes over time."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from realizer import tables
from realizer.animation.lips.closures import BILABIAL, LABIODENTAL, closure_mask, lip_weight
from realizer.animation.lips.dominance import dominances, key_times, track_of
from realizer.animation.lips.visemes import VISEME_COUNT
from realizer.core.array_types import Float64, Int32
from realizer.speech.utterance import Phoneme

MAX_BLEND = 63  # FAP 1 then shows the first viseme alone


@dataclass(frozen=True, slots=True)
class OculusViseme:
    """A viseme of Oculus (of Ready Player Me as `viseme_NAME`), and the number of the same one in MPEG-4."""

    name: str
    viseme: int


# () -> the 15 Oculus visemes in the order of their numbers
oculus_visemes = cache(partial(tables.csv_rows, "visemes_oculus.csv", OculusViseme))


def viseme_weights(phonemes: Sequence[Phoneme], times: Float64) -> Float64:
    """Return the weight of each MPEG-4 viseme over time, (n, 15) float64, column = viseme; rows add up to 1.

    Weights are the mean of the dominances of sounds in jaw, lips, width and tongue (see `lip_channels`). A
    sound that closes the lips or presses the lower lip to the teeth has weight 1 meanwhile. Times, (n,), are
    on the clock of the phonemes, seconds from the start of the utterance; "" is a pause.
    """
    weights = np.zeros((len(times), VISEME_COUNT))
    weights[:, 0] = 1.0
    track = track_of(phonemes)
    if track is None:
        return weights
    keys = key_times(phonemes)
    shown = np.zeros((len(keys), VISEME_COUNT))
    classes = list(dominances(track, keys))
    for near, parts, _ in classes:
        shown += np.einsum("kn,knv->nv", parts, track.mix[near]) / len(classes)
    for viseme, holds in zip((BILABIAL, LABIODENTAL), closure_mask(track, keys), strict=True):
        # With a transition of one key on either side, as for the lips.
        share = np.convolve(np.pad(holds.astype(float), 1, "edge"), [0.25, 0.5, 0.25], "valid")[:, None]
        shown = shown * (1 - share) + share * np.eye(VISEME_COUNT)[viseme]
    shown *= lip_weight(track, keys)[:, None]
    for viseme in range(1, VISEME_COUNT):
        weights[:, viseme] = np.interp(times, keys, shown[:, viseme], left=0.0, right=0.0)
    weights[:, 0] = np.maximum(1 - weights[:, 1:].sum(axis=1), 0.0)
    return weights


def oculus_weights(weights: Float64) -> Float64:
    """Reorder the weights (n, 15) of MPEG-4's visemes as in `oculus_visemes`."""
    return np.ascontiguousarray(weights[:, [row.viseme for row in oculus_visemes()]])


def fap_1(weights: Float64) -> Int32:
    """Return FAP 1, (n, 4) int32, with the two strongest visemes of (n, 15): select1, select2, blend, def.

    A decoder shows select1 x blend / 63 + select2 x (1 - blend / 63); a single viseme is select1 with 63.
    `def` is 0, which means the standard's visemes.
    """
    order = np.argsort(-weights, axis=1, kind="stable")[:, :2]
    first, second = np.take_along_axis(weights, order, axis=1).T
    blend = np.rint(MAX_BLEND * first / np.maximum(first + second, 1e-12)).astype(np.int32)
    out = np.zeros((len(weights), 4), np.int32)
    out[:, :2], out[:, 2] = order, blend
    out[blend == MAX_BLEND, 1] = 0
    return out
