"""Trains the network that hears visemes: python training/train_sound_visemes.py FILE ...

The files are written by `viseme_frames.py`. Each time a sentence is used, it comes from another throat,
through another microphone, in another noise and level. The network is a perceptron; Adam minimises its
cross-entropy, in which rare classes weigh more. It needs JAX (`pip install jax`).
"""

from __future__ import annotations

import argparse
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from realizer.speech.sound_visemes.mel_stream import (
    ACTIVE,
    BANDS,
    FALL,
    FIRST_LEVEL,
    HIGHEST,
    LOWEST,
    PRIOR,
    mel_triangles,
    viseme_facts,
)
from realizer.speech.sound_visemes.recogniser import FLOOR, FUTURE, OFFSETS, PAST, SCALE, SILENT, WEIGHTS

NOT_SEEN = -1  # the class of sounds without a shape of the lips, such as h
HIDDEN = (512, 256)
LENGTH = 480  # frames at most that are used together
STRIDE = 8  # from one frame of a sentence that is used at a time to the next
EPOCHS, STEP, TOGETHER, TESTED = 100, 1.2e-3, 64, 8
DROPPED = 0.1  # of the hidden units in training
DECAY = 0.02  # of the weights
SMOOTH = 0.05  # of the certainty of each label
KEPT = 0.999  # of the averaged weights in a step
RARITY = 0.6  # exponent of the weight of a rare class
# What varies: the logarithm of the size of the throat, the spectrum of the microphone by its first cosines,
# dB of the noise below the speech, the loudest sample, and the most bands that are hidden.
THROAT, MICROPHONE, NOISE, LOUDEST, HIDDEN_BANDS = 0.13, (1.2, 0.6, 0.4, 0.3), (8.0, 50.0), (0.02, 0.6), 4

Layers = list[list[Any]]


def mel_places() -> np.ndarray:
    """Return (BANDS,) the middles of the bands on the mel scale, log(1 + f / 700 Hz)."""
    low, high = np.log1p(np.array([LOWEST, HIGHEST]) / 700)
    return np.asarray(low + (np.arange(BANDS) + 1) / (BANDS + 1) * (high - low))


def changed(key: Any, log: Any) -> Any:
    """Return the frames (n, BANDS) of a sentence by another speaker in another place."""
    keys, mel, at = jax.random.split(key, 8), mel_places(), np.arange(BANDS)
    warp = jnp.exp(jax.random.uniform(keys[0], minval=-THROAT, maxval=THROAT))
    place = jnp.interp(jnp.log1p(jnp.expm1(mel) * warp), mel, at)
    low = jnp.minimum(place.astype(int), BANDS - 2)
    part = place - low
    log = log[:, low] * (1 - part) + log[:, low + 1] * part
    waves = np.cos(np.pi * np.arange(1, len(MICROPHONE) + 1)[:, None] * (at + 0.5) / BANDS)
    log = log + (jax.random.normal(keys[1], (len(MICROPHONE),)) * jnp.array(MICROPHONE)) @ waves
    # Noise adds its power, which varies as that of a few narrow bands does.
    triangles = mel_triangles(BANDS, LOWEST, HIGHEST)
    widths = triangles.sum(axis=0)
    bins = widths**2 / (triangles**2).sum(axis=0) / 1.5
    power = jnp.exp(log)
    noise = widths * jnp.exp(-2 * mel * jax.random.uniform(keys[2]))
    decibels = jax.random.uniform(keys[3], minval=NOISE[0], maxval=NOISE[1])
    noise *= power.mean() / noise.mean() * 10 ** (-decibels / 10)
    # A gamma distribution with many degrees of freedom, by Wilson & Hilferty 1931.
    normal = jax.random.normal(keys[4], log.shape)
    power += noise * jnp.maximum(1 - 1 / (9 * bins) + normal / jnp.sqrt(9 * bins), 0) ** 3
    level = 2 * jnp.log(jax.random.uniform(keys[5], minval=LOUDEST[0], maxval=LOUDEST[1]) / LOUDEST[1])
    return jnp.maximum(jnp.log(power) + level, SILENT)


def followed(log: Any) -> tuple[Any, Any]:
    """Return the loud level (n,) and the mean spectrum (n, BANDS) after each frame, as `MelStream` does."""
    fall = FALL * jnp.arange(1, len(log) + 1)
    level = jnp.maximum(jax.lax.cummax(log.max(axis=1) + fall), FIRST_LEVEL) - fall
    active = log.max(axis=1) > level - ACTIVE
    count = PRIOR + jnp.cumsum(active)
    # In sentences of more than a few seconds older frames count a little more than there.
    total = PRIOR * jnp.array(viseme_facts()["mean"]) + jnp.cumsum(
        jnp.where(active[:, None], log - level[:, None], 0), axis=0
    )
    return level, total / count[:, None]


def inputs(key: Any, log: Any, rows: Any, vary: bool) -> Any:
    """Return the inputs (rows, frames x BANDS) of a sentence (n, BANDS), at `rows` below n - FUTURE."""
    keys = jax.random.split(key, 4)
    log = changed(keys[0], log) if vary else log
    level, mean = followed(log)
    padded = jnp.concatenate([jnp.full((PAST, BANDS), SILENT), log])
    near = padded[rows[:, None] + PAST + OFFSETS]
    loud = jnp.maximum(near - level[rows + FUTURE, None, None], -FLOOR) - mean[rows + FUTURE, None]
    if vary:
        first, width = jax.random.uniform(keys[1]) * BANDS, jax.random.uniform(keys[2]) * HIDDEN_BANDS
        at = np.arange(BANDS)
        loud = jnp.where((at >= first) & (at < first + width) & jax.random.bernoulli(keys[3]), 0, loud)
    return (loud / SCALE).reshape(len(rows), -1)


def logits(layers: Layers, x: Any, key: Any) -> Any:
    """Return the logarithms (..., classes) of the probabilities, but for a constant."""
    for i, (w, b) in enumerate(layers):
        x = x @ w + b
        if i + 1 < len(layers):
            x = jnp.maximum(x, 0)
            if key is not None:
                kept = jax.random.bernoulli(jax.random.fold_in(key, i), 1 - DROPPED, x.shape)
                x = x * kept / (1 - DROPPED)
    return x


class Frames:
    """The stored sentences, in pieces of at most `LENGTH` frames."""

    def __init__(self, files: list[Path], left_out: list[str]) -> None:
        parts = [dict(np.load(file)) for file in files]
        counts = np.cumsum([0, *(part["ends"][-1] for part in parts)])
        data = {
            "log": np.concatenate([np.cumsum(part["log"], axis=1, dtype=np.uint8) for part in parts], axis=1),
            "ends": np.concatenate([part["ends"] + n for part, n in zip(parts, counts[:-1], strict=True)]),
            **{name: np.concatenate([part[name] for part in parts]) for name in ("labels", "speakers")},
        }
        self.step = float(parts[0]["step"])  # of the stored logarithms
        self.log = jnp.asarray(data["log"].T)
        self.labels = jnp.asarray(data["labels"].astype(np.int32))
        starts = np.append(0, data["ends"][:-1])
        pieces = [
            (at, min(LENGTH, end - at), speaker)
            for start, end, speaker in zip(starts, data["ends"], data["speakers"], strict=True)
            for at in range(start, max(start + 1, end - LENGTH // 4), LENGTH)
        ]
        self.starts, self.lengths = (np.array([piece[k] for piece in pieces]) for k in (0, 1))
        speakers = np.array([piece[2] for piece in pieces])
        self.tests = {name: np.flatnonzero(speakers == name) for name in left_out}
        self.training = np.flatnonzero(~np.isin(speakers, left_out))
        seen = data["labels"][data["labels"] != NOT_SEEN]
        self.share = np.bincount(seen, minlength=len(viseme_facts()["class"])) / len(seen)


def batch(
    log: Any, labels: Any, step: Any, starts: Any, lengths: Any, key: Any, vary: bool
) -> tuple[Any, Any]:
    """Return inputs (k, n, m) and labels (k, n) of sentences; `NOT_SEEN` after their ends."""
    places = jnp.minimum(starts[:, None] + np.arange(LENGTH), len(labels) - 1)
    inside = np.arange(LENGTH) < lengths[:, None]
    frames = jnp.where(inside[..., None], log[places] * step + SILENT, SILENT)
    each = LENGTH - FUTURE
    if vary:  # neighbours are alike: a part of them teaches nearly as much
        each //= STRIDE
        first = jax.random.randint(jax.random.fold_in(key, 2), (len(starts), 1), 0, STRIDE)
        rows = first + STRIDE * np.arange(each)
    else:
        rows = jnp.broadcast_to(jnp.arange(each), (len(starts), each))
    found = jax.vmap(lambda *one: inputs(*one, vary))(jax.random.split(key, len(starts)), frames, rows)
    at = rows + FUTURE
    seen = jnp.where(
        jnp.take_along_axis(inside, at, axis=1), labels[jnp.take_along_axis(places, rows, axis=1)], NOT_SEEN
    )
    return found, seen


@jax.jit
def improved(
    state: tuple[Layers, Layers, Layers, Layers], data: tuple[Any, ...], weight: Any, rate: Any, count: Any
) -> Any:
    """Return the layers, both moments and the averaged layers after a step of Adam, and the loss."""
    layers, first, second, average = state
    x, labels = batch(*data, True)
    key = jax.random.fold_in(data[-1], 1)

    def loss(layers: Layers) -> Any:
        logs = jax.nn.log_softmax(logits(layers, x, key))
        own = jnp.take_along_axis(logs, jnp.maximum(labels, 0)[..., None], axis=-1)[..., 0]
        entropy = -(1 - SMOOTH) * own - SMOOTH * logs.mean(axis=-1)
        part = jnp.where(labels == NOT_SEEN, 0, weight[labels])
        return (entropy * part).sum() / jnp.maximum(part.sum(), 1)

    value, slopes = jax.value_and_grad(loss)(layers)
    each = jax.tree.map
    first = each(lambda m, g: 0.9 * m + 0.1 * g, first, slopes)
    second = each(lambda v, g: 0.999 * v + 0.001 * g * g, second, slopes)
    scale = jnp.sqrt(1 - 0.999**count) / (1 - 0.9**count)
    layers = each(
        lambda w, m, v: w - rate * (scale * m / (jnp.sqrt(v) + 1e-8) + DECAY * w), layers, first, second
    )
    kept = jnp.minimum(KEPT, count / (count + 10))
    average = each(lambda a, w: kept * a + (1 - kept) * w, average, layers)
    return (layers, first, second, average), value


@jax.jit
def counted(layers: Layers, data: tuple[Any, ...]) -> Any:
    """Return (classes, classes) how many frames of each class are taken for each."""
    x, labels = batch(*data, False)
    found = logits(layers, x, None)
    size = found.shape[-1]
    pairs = jnp.where(labels == NOT_SEEN, size * size, labels * size + found.argmax(axis=-1))
    return jnp.bincount(pairs.ravel(), length=size * size + 1)[:-1].reshape(size, size)


def tested(layers: Layers, frames: Frames) -> str:
    """Return the balanced share of right frames, without silence, of the speakers that are left out."""
    found = []
    for name, pieces in frames.tests.items():
        parts = pieces[: len(pieces) // TESTED * TESTED].reshape(-1, TESTED)
        key = jax.random.key(0)
        data = (
            (frames.log, frames.labels, frames.step, frames.starts[p], frames.lengths[p], key) for p in parts
        )
        counts = sum(np.asarray(counted(layers, one)) for one in data)[:-1]
        right = [row[k] / row.sum() for k, row in enumerate(counts) if row.sum()]
        heard = counts[0, 0] / max(counts[:, 0].sum(), 1)
        found.append(f"{name} {np.mean(right):.3f} (p b m {right[0]:.2f}, of found {heard:.2f} real)")
    return ", ".join(found)


def train(frames: Frames, out: Path, epochs: int, seed: int) -> None:
    """Train the network and write it."""
    random, key = np.random.default_rng(seed), jax.random.key(seed)
    weight = frames.share**-RARITY
    weight /= (weight * frames.share).sum()
    sizes = (len(OFFSETS) * BANDS, *HIDDEN, len(frames.share))
    layers: Layers = [
        [jnp.asarray(random.normal(0, np.sqrt(2 / a), (a, b)), jnp.float32), jnp.zeros(b)]
        for a, b in pairwise(sizes)
    ]
    state: Any = (layers, *(jax.tree.map(jnp.zeros_like, layers) for _ in range(2)), layers)
    each = len(frames.training) // TOGETHER
    begin, total = time.perf_counter(), epochs * each
    for epoch in range(epochs):
        order, losses = random.permutation(frames.training), []
        for k in range(each):
            count = epoch * each + k + 1
            rate = STEP * min(1, count / 500) * 0.5 * (1 + np.cos(np.pi * count / total))
            some = order[k * TOGETHER : (k + 1) * TOGETHER]
            data = frames.log, frames.labels, frames.step, frames.starts[some], frames.lengths[some]
            key, now = jax.random.split(key)
            state, loss = improved(state, (*data, now), jnp.asarray(weight), rate, float(count))
            losses.append(loss)
        if epoch % 5 == 4 or epoch + 1 == epochs:
            print(
                f"epoch {epoch + 1}, {time.perf_counter() - begin:.0f} s: loss {np.mean(losses):.3f}; "
                f"{tested(state[3], frames)}",
                flush=True,
            )
            written(out, state[3], weight * frames.share)


def written(out: Path, layers: Layers, shares: np.ndarray) -> None:
    arrays = {
        f"{'wb'[j]}{i}": np.asarray(part, np.float16)
        for i, layer in enumerate(layers)
        for j, part in enumerate(layer)
    }
    np.savez_compressed(out, **arrays, shares=shares.astype(np.float16))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", type=Path, nargs="+", help="from viseme_frames.py")
    parser.add_argument("--out", type=Path, default=WEIGHTS, help="the network")
    parser.add_argument("--epochs", type=int, default=EPOCHS)
    parser.add_argument("--seed", type=int, default=2, help="of the network and the noise")
    parser.add_argument("--leave-out", default="", help="speakers to measure instead, separated by commas")
    options = parser.parse_args()
    frames = Frames(options.files, [name for name in options.leave_out.split(",") if name])
    print(f"{len(frames.labels) / 6000:.0f} min, shares of the classes {np.round(100 * frames.share, 1)} %")
    train(frames, options.out, options.epochs, options.seed)


if __name__ == "__main__":
    main()
