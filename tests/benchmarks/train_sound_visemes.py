"""Trains the network that hears visemes: python tests/benchmarks/train_sound_visemes.py [--data DIR]

Speech of `spoken_corpus` is varied in rate, pitch, noise, room, bandwidth and level. The network is a
perceptron with two hidden layers; Adam minimises its cross-entropy, in which rare classes weigh more.
Speakers that `lips_from_sound.py` measures as unknown are left out.
"""

from __future__ import annotations

import argparse
import time
import zlib
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.signal import fftconvolve, resample_poly
from spoken_corpus import (
    FESTIVAL,
    NOT_SEEN,
    Spoken,
    by_festival,
    by_flite,
    by_voice,
    classes,
    russian,
    sentences,
)

from realizer.speech.sound_visemes.mel_stream import BANDS, HOP, RATE, MelStream, viseme_facts
from realizer.speech.sound_visemes.recogniser import FUTURE, OFFSETS, WEIGHTS, context

# espeak-ng's language, dictionary.
ESPEAK = {
    "en-us": "american-english",
    "en-gb": "american-english",
    "de": "ngerman",
    "fr": "french",
    "es": "spanish",
    "pl": "polish",
    "nl": "dutch",
    "it": "italian",
    "cs": "czech",
    "pt": "portuguese",
    "ca": "catalan",
}
VARIANTS = ("", "f1", "f2", "f3", "f4", "m1", "m2", "m3", "m4", "m5", "m7", "klatt2", "Andrea", "Alex")
HELD_OUT = ("lp_diphone",)  # beside hibari, flite's rms, espeak's Swedish, and librivox
RECORDINGS = slice(250)  # of the Russian ones; others are measured
FLITE = ("slt", "awb", "kal")
RATES = (1.0, 0.85, 1.2, 1.45, 0.95, 1.1)
COPIES = 2  # of each sentence, varied
HIDDEN = (384, 192)
BATCH, EPOCHS, STEP = 512, 8, 1e-3
DROPPED = 0.15  # of the hidden units in training
RARITY = 0.6  # exponent of the weight of a rare class


def corpus(amount: int, random: np.random.Generator) -> Iterator[Spoken]:
    """Yield sentences of all speakers: `amount` of each voice of Festival and flite."""
    for name, (dictionary, *_) in FESTIVAL.items():
        if name not in HELD_OUT:
            yield from by_festival(name, sentences(dictionary, amount, random), RATES)
    yield from russian(RECORDINGS)
    for name in FLITE:
        yield from by_flite(name, sentences("american-english", amount, random), RATES)
    each = max(1, amount // 2 // len(VARIANTS) * 2)
    for language, dictionary in ESPEAK.items():
        for variant in VARIANTS:
            name = f"espeak:{language}+{variant}".rstrip("+")
            yield from by_voice(name, language, sentences(dictionary, each, random), RATES)


def varied(spoken: Spoken, random: np.random.Generator) -> Spoken:
    """Return speech at 16 kHz in another pitch, bandwidth, room, noise and level."""
    pitch = random.uniform(0.85, 1.2)  # higher and faster, with shorter resonances
    sound = resample_poly(spoken.pcm.astype(np.float32), 160, round(160 * spoken.rate * pitch / RATE))
    scale = len(spoken.pcm) / spoken.rate / (len(sound) / RATE)
    if random.random() < 0.2:  # a telephone
        sound = resample_poly(resample_poly(sound, 1, 2), 2, 1)
    if random.random() < 0.5:
        decay = random.uniform(0.03, 0.15)  # s to a fall of 9 dB
        tail = np.arange(round(4 * decay * RATE)) / RATE
        room = random.normal(size=len(tail)) * np.exp(-tail / decay) * random.uniform(0.01, 0.08)
        room[0] = 1.0
        sound = fftconvolve(sound, room)[: len(sound)]
    tilt = random.uniform(-0.6, 0.6)
    sound = sound - tilt * np.append(0.0, sound[:-1])
    power = np.sqrt(np.mean(sound**2)) + 1.0
    noise = (
        np.cumsum(random.normal(size=len(sound))) if random.random() < 0.4 else random.normal(size=len(sound))
    )
    noise -= np.convolve(noise, np.full(401, 1 / 401), "same")
    sound = sound + noise / noise.std() * power * 10 ** (-random.uniform(10, 50) / 20)
    sound *= random.uniform(0.02, 0.6) * 32767 / np.abs(sound).max()
    phonemes = tuple(type(p)(p.start / scale, p.end / scale, p.ipa) for p in spoken.phonemes)
    return Spoken(spoken.speaker, RATE, sound.astype(np.int16), phonemes)


def prepare(folder: Path, amount: int) -> None:
    """Write frames and classes of the varied corpus."""
    random = np.random.default_rng(1)
    kept: list[tuple[np.ndarray, ...]] = []
    begin, seconds = time.perf_counter(), 0.0
    speaker = ""
    for spoken in corpus(amount, random):
        if spoken.speaker != speaker:
            speaker = spoken.speaker
            print(f"{time.perf_counter() - begin:5.0f} s: {seconds / 60:.0f} min, {speaker}", flush=True)
        for _ in range(COPIES):
            one = varied(spoken, random)
            # Silence follows, in which the last windows end.
            frames = MelStream(RATE).feed(np.append(one.pcm, np.zeros(RATE // 20, np.int16)))
            labels = classes(one.phonemes, np.arange(len(frames.log)) * HOP / RATE)
            is_test = zlib.crc32(f"{speaker}{len(kept) // 2}".encode()) % 25 == 0
            kept.append((frames.log, frames.level, frames.mean, labels, np.full(len(labels), is_test)))
            seconds += len(one.pcm) / RATE
    names = ("log", "level", "mean", "labels", "is_test")
    columns = {name: np.concatenate(part) for name, part in zip(names, zip(*kept, strict=True), strict=True)}
    ends = np.cumsum([len(part[0]) for part in kept])
    np.savez(folder / "frames.npz", **columns, ends=ends)


def train(folder: Path, epochs: int, resume: bool) -> None:
    """Train the network and write it."""
    data = dict(np.load(folder / "frames.npz"))
    known = dict(np.load(WEIGHTS)) if resume else {}
    random = np.random.default_rng(2)
    labels, count = data["labels"], len(data["labels"])
    # Contexts do not cross from one sentence to another.
    first = np.repeat(np.append(0, data["ends"][:-1]), np.diff(data["ends"], prepend=0))
    last = np.repeat(data["ends"], np.diff(data["ends"], prepend=0))
    at = np.arange(count)
    usable = (labels != NOT_SEEN) & (at + FUTURE < last)
    chosen, test = np.flatnonzero(usable & ~data["is_test"]), np.flatnonzero(usable & data["is_test"])
    size = len(viseme_facts()["class"])
    share = np.bincount(labels[chosen], minlength=size) / len(chosen)
    weight = share**-RARITY
    weight /= (weight * share).sum()
    print(f"{count / 6000:.0f} min, shares {np.round(100 * share, 1)}")

    def inputs(rows: np.ndarray) -> np.ndarray:
        near = rows[:, None] + OFFSETS
        # Before a sentence is digital silence.
        log = np.where((near >= first[rows, None])[..., None], data["log"][near], np.float32(-23.0))
        now = rows + FUTURE
        return context(log, data["level"][now], data["mean"][now])

    sizes = (len(OFFSETS) * BANDS, *HIDDEN, size)
    layers = (
        [
            [known[f"w{k}"].astype(np.float32), known[f"b{k}"].astype(np.float32)]
            for k in range(len(sizes) - 1)
        ]
        if resume
        else [
            [random.normal(0, np.sqrt(2 / a), (a, b)).astype(np.float32), np.zeros(b, np.float32)]
            for a, b in pairwise(sizes)
        ]
    )
    moments = [[np.zeros_like(v) for v in layer] + [np.zeros_like(v) for v in layer] for layer in layers]
    steps, total = 0, epochs * (len(chosen) // BATCH)
    begin = time.perf_counter()
    for epoch in range(epochs):
        order, loss = random.permutation(chosen), 0.0
        for k in range(0, len(order) - BATCH + 1, BATCH):
            rows = order[k : k + BATCH]
            outs = [inputs(rows)]
            for i, (w, b) in enumerate(layers):
                x = outs[-1] @ w + b
                if i < len(HIDDEN):
                    keep = random.random(x.shape, np.float32) >= DROPPED
                    x = np.maximum(x, 0) * keep * np.float32(1 / (1 - DROPPED))
                outs.append(x)
            p = np.exp(outs[-1] - outs[-1].max(axis=1, keepdims=True))
            p /= p.sum(axis=1, keepdims=True)
            own = weight[labels[rows]].astype(np.float32)
            loss -= float((own * np.log(p[np.arange(BATCH), labels[rows]] + 1e-9)).sum())
            p[np.arange(BATCH), labels[rows]] -= 1
            error = p * (own[:, None] / BATCH)
            steps += 1
            speed = STEP * min(1, steps / 500) * 0.5 * (1 + np.cos(np.pi * steps / total))
            for i in reversed(range(len(layers))):
                w, b = layers[i]
                slopes = (outs[i].T @ error + np.float32(1e-5) * w, error.sum(axis=0))
                if i:
                    error = (error @ w.T) * (outs[i] > 0)
                for j, slope in enumerate(slopes):
                    m, v = moments[i][j], moments[i][j + 2]
                    m += np.float32(0.1) * (slope - m)
                    v += np.float32(0.001) * (slope * slope - v)
                    rise = np.float32(speed * np.sqrt(1 - 0.999**steps) / (1 - 0.9**steps))
                    layers[i][j] -= rise * m / (np.sqrt(v) + np.float32(1e-8))
        x = inputs(test[:: max(1, len(test) // 20000)])
        truth = labels[test[:: max(1, len(test) // 20000)]]
        for i, (w, b) in enumerate(layers):
            x = x @ w + b if i == len(HIDDEN) else np.maximum(x @ w + b, 0)
        right = [float((x[truth == c].argmax(axis=1) == c).mean()) for c in range(size)]
        print(
            f"epoch {epoch + 1}, {time.perf_counter() - begin:.0f} s: loss {loss / len(order):.3f}, "
            f"balanced {np.mean(right[:-1]):.3f}, {np.round(right, 2)}",
            flush=True,
        )
        arrays = {
            f"{'wb'[j]}{i}": layer[j].astype(np.float16) for i, layer in enumerate(layers) for j in range(2)
        }
        np.savez_compressed(WEIGHTS, **arrays, shares=(weight * share).astype(np.float16))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=Path("/tmp"), help="where frames.npz is kept")
    parser.add_argument("--amount", type=int, default=84, help="sentences of each voice")
    parser.add_argument("--epochs", type=int, default=EPOCHS)
    parser.add_argument("--resume", action="store_true", help="start with the weights that there are")
    options = parser.parse_args()
    if not (options.data / "frames.npz").exists():
        prepare(options.data, options.amount)
    train(options.data, options.epochs, options.resume)


if __name__ == "__main__":
    main()
