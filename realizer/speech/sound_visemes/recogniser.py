"""Phonemes of the mouth shapes that a small network hears in sound, while it arrives."""

from functools import cache
from pathlib import Path

import numpy as np

from realizer.core.array_types import Float32, Int16
from realizer.speech.sound_visemes.mel_stream import (
    BANDS,
    BLOCK,
    HOP,
    QUIETEST,
    RATE,
    MelStream,
    viseme_facts,
)
from realizer.speech.utterance import Phoneme

WEIGHTS = Path(__file__).with_name("weights.npz")
# The context of a frame: each frame near it, and every other one before.
PAST, FUTURE = 25, 7
OFFSETS = np.array([*range(-PAST, -9, 2), *range(-8, FUTURE + 1)])
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
    """Return the inputs (..., frames x BANDS) of the network, of `log` (..., frames, BANDS) at `OFFSETS`.

    `level` and `mean` are (...,) and (..., BANDS) at the last of these frames.
    """
    loud = np.maximum(log - level[..., None, None], np.float32(-FLOOR)) - mean[..., None, :]
    inputs: Float32 = (loud * np.float32(1 / SCALE)).reshape(*log.shape[:-2], len(OFFSETS) * BANDS)
    return inputs


def log_probabilities(inputs: Float32) -> Float32:
    """Return the logarithms (..., classes) of the probabilities; the last two axes are one product."""
    arrays, x = _arrays(), inputs
    layers = len(arrays) // 2
    for k in range(layers):
        x = x @ arrays[f"w{k}"] + arrays[f"b{k}"]
        if k + 1 < layers:
            x = np.maximum(x, 0)
    x = x - x.max(axis=-1, keepdims=True)
    found: Float32 = x - np.log(np.exp(x).sum(axis=-1, keepdims=True))
    return found


LOWEST = 8000  # Hz; in sound of a lower rate consonants are missing
EARLY = FUTURE % BLOCK  # frames
LAG = 2  # frames after which the class of a frame is final
TAIL = 0.25  # s of silence after the end, in which all contexts end
AT_ONCE = 5  # s; longer pieces are divided, which limits the memory


class VisemeRecogniser:
    """Recognises mouth shapes in PCM that arrives in pieces; how it is divided changes nothing.

    The end of a phoneme is known 119 ms after it at most: half a frame, half a window, the frames after it in
    the context, the rest of the block, the lag of the path, and less than a millisecond of resampling. The
    rate, in Hz, is at least `LOWEST`.
    """

    def __init__(self, rate: int) -> None:
        self._rate, self._length = rate, 0
        self._stream = MelStream(rate)
        # Frames that are in contexts to come; silence before the first one. The first block begins `EARLY`,
        # so that the context of each block ends with a block of frames.
        self._log: Float32 = np.full((PAST + EARLY, BANDS), SILENT, np.float32)
        self._level: Float32 = np.zeros(PAST + EARLY, np.float32)
        self._mean: Float32 = np.zeros((PAST + EARLY, BANDS), np.float32)
        self._path = _Path()
        self._count = -EARLY  # the first frame whose class is not final
        self._start, self._class = 0.0, -1  # of the last phoneme

    def feed(self, pcm: Int16) -> list[Phoneme]:
        """Return the phonemes, "" for a pause, whose end is known with this piece, without gaps."""
        self._length += len(pcm)
        size = AT_ONCE * self._rate
        parts = (pcm[at : at + size] for at in range(0, len(pcm), size))
        return [phoneme for part in parts for phoneme in self._advance(part)]

    def close(self) -> list[Phoneme]:
        found = self._advance(np.zeros(round(TAIL * self._rate), np.int16))
        end = self._length / self._rate
        found.append(Phoneme(self._start, end, _ipa(self._class)))
        return [Phoneme(p.start, min(p.end, end), p.ipa) for p in found if p.start < end]

    def _advance(self, pcm: Int16) -> list[Phoneme]:
        frames = self._stream.feed(pcm)
        self._log = np.concatenate((self._log, frames.log))
        self._level = np.concatenate((self._level, frames.level))
        self._mean = np.concatenate((self._mean, frames.mean))
        blocks = max(0, (len(self._log) - PAST - FUTURE) // BLOCK)
        at = (np.arange(blocks) * BLOCK + PAST)[:, None] + np.arange(BLOCK)
        now = at + FUTURE
        inputs = context(self._log[at[..., None] + OFFSETS], self._level[now], self._mean[now])
        numbers = self._path.advance(log_probabilities(inputs).reshape(at.size, -1)) if blocks else []
        used = blocks * BLOCK
        self._log, self._level, self._mean = self._log[used:], self._level[used:], self._mean[used:]
        return [phoneme for number in numbers for phoneme in self._decide(number)]

    def _decide(self, number: int) -> list[Phoneme]:
        """Add a frame of a class; return the phoneme that ends with it, if any."""
        # A frame stands for the time half way to its neighbours.
        now = max(0.0, (self._count - 0.5) * HOP / RATE)
        self._count += 1
        if number == self._class:
            return []
        ended = Phoneme(self._start, now, _ipa(self._class))
        self._start, self._class = now, number
        return [ended] if ended.end > ended.start else []


class _Path:
    """The most probable classes of frames, by the algorithm of Viterbi with a fixed lag."""

    def __init__(self) -> None:
        facts = viseme_facts()
        self._cost = float(facts["change"])
        self._added = np.array([c.get("added", 0.0) for c in facts["class"]]) - facts["rarity"] * np.log(
            shares()
        )
        self._best = [0.0] * len(self._added)
        self._before: list[list[int]] = []  # of the last frames: the class before, for each class

    def advance(self, scores: Float32) -> list[int]:
        """Return the classes that are final with further frames, by their (n, classes) log probabilities."""
        found = []
        for row in (scores + self._added).tolist():
            jump = max(self._best)
            top = self._best.index(jump)
            jump -= self._cost
            self._before.append([k if best >= jump else top for k, best in enumerate(self._best)])
            self._best = [score + max(best, jump) for score, best in zip(row, self._best, strict=True)]
            if len(self._before) > LAG:
                number = self._best.index(max(self._best))
                for before in reversed(self._before[-LAG:]):
                    number = before[number]
                found.append(number)
                del self._before[0]
        return found


def recognised(pcm: Int16, rate: int) -> tuple[Phoneme, ...]:
    """Return phonemes and pauses that cover a sound without gaps; () if it is no speech."""
    if rate < LOWEST:
        return ()
    recogniser = VisemeRecogniser(rate)
    found = (*recogniser.feed(pcm), *recogniser.close())
    return found if any(phoneme.ipa for phoneme in found) else ()


def _ipa(number: int) -> str:
    return str(viseme_facts()["class"][number]["ipa"]) if number >= 0 else ""
