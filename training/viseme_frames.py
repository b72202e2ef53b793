"""Writes what the network that hears visemes learns from: python training/viseme_frames.py FILE

Speech of `spoken_corpus`, varied in rate, pitch, room and bandwidth, as mel frames of a byte a band, about
6 MB an hour. Speakers that `lips_from_sound.py` measures as unknown are left out. It takes half an hour.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.signal import fftconvolve, resample_poly

from realizer.speech.sound_visemes.mel_stream import HOP, RATE, MelStream
from realizer.speech.sound_visemes.recogniser import SILENT
from training.spoken_corpus import (
    FESTIVAL,
    Spoken,
    by_festival,
    by_flite,
    by_voice,
    classes,
    russian,
    texts,
)

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
RECORDINGS = slice(350)  # of the Russian ones; others are measured
FLITE = ("slt", "awb", "kal")
RATES = (1.0, 0.85, 1.2, 1.45, 0.95, 1.1)
# Parts of `--amount`: English voices have more sentences, as weak forms differ most from written words.
ENGLISH, OTHERS, SYNTHETIC = 1.0, 0.4, 0.027
COPIES = 2  # of each sentence, varied
STEP = 0.2  # of the natural logarithms of power that are stored as bytes


def corpus(amount: int, random: np.random.Generator) -> Iterator[Spoken]:
    """Yield sentences of all speakers: at most `amount` of each, but all recordings."""
    for name, (dictionary, *_) in FESTIVAL.items():
        if name not in HELD_OUT:
            part = ENGLISH if dictionary == "american-english" else OTHERS
            yield from by_festival(name, texts(dictionary, round(part * amount), random), RATES)
    yield from russian(RECORDINGS)
    for name in FLITE:
        yield from by_flite(name, texts("american-english", round(ENGLISH * amount), random), RATES)
    for language, dictionary in ESPEAK.items():
        for variant in VARIANTS:
            name = f"espeak:{language}+{variant}".rstrip("+")
            some = texts(dictionary, max(1, round(SYNTHETIC * amount)), random)
            yield from by_voice(name, language, some, RATES)


def varied(spoken: Spoken, random: np.random.Generator) -> Spoken:
    """Return speech at 16 kHz in another pitch, bandwidth and room; its loudest sample is 0.6."""
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
    sound *= 0.6 * 32767 / np.abs(sound).max()
    phonemes = tuple(type(p)(p.start / scale, p.end / scale, p.ipa) for p in spoken.phonemes)
    return Spoken(spoken.speaker, RATE, sound.astype(np.int16), phonemes)


def prepare(file: Path, amount: int, seed: int) -> None:
    """Write frames, their classes, the ends of sentences and their speakers."""
    random = np.random.default_rng(seed)
    frames, labels, speakers = list[np.ndarray](), list[np.ndarray](), list[str]()
    begin, seconds = time.perf_counter(), 0.0
    for spoken in corpus(amount, random):
        if spoken.speaker not in speakers[-1:]:
            print(
                f"{time.perf_counter() - begin:5.0f} s: {seconds / 60:.0f} min, {spoken.speaker}", flush=True
            )
        for _ in range(COPIES):
            one = varied(spoken, random)
            # Silence follows, in which the last windows end.
            log = MelStream(RATE).feed(np.append(one.pcm, np.zeros(RATE // 20, np.int16))).log
            frames.append(np.clip(np.rint((log - SILENT) / STEP), 0, 255).astype(np.uint8))
            labels.append(classes(one.phonemes, np.arange(len(log)) * HOP / RATE).astype(np.int8))
            speakers.append(spoken.speaker)
            seconds += len(one.pcm) / RATE
    log = np.concatenate(frames).T.astype(np.int16)
    np.savez_compressed(
        file,
        step=STEP,
        log=np.diff(log, axis=1, prepend=0).astype(np.uint8),  # (bands, n), which compresses better
        labels=np.concatenate(labels),
        ends=np.cumsum([len(part) for part in frames]),
        speakers=np.array(speakers),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", type=Path, help="a name that ends with .npz")
    parser.add_argument("--amount", type=int, default=300, help="sentences of each voice")
    parser.add_argument("--seed", type=int, default=1, help="of texts, rates, pitches and rooms")
    options = parser.parse_args()
    prepare(options.file, options.amount, options.seed)


if __name__ == "__main__":
    main()
