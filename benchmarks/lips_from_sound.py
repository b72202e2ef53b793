"""Measures lips from sound alone: python benchmarks/lips_from_sound.py [--sentences N] [--confusion]

The classes of mouth shapes that are heard in speech are compared with those of its known phonemes, in frames
at 25 a second, for speakers that the network was not trained on, and for other recordings of one that it was
trained on. `spoken_corpus` lists what it needs.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Iterator, Sequence

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from lips import SENTENCES

from realizer.speech.recorded.recorded_speech import by_loudness
from realizer.speech.sound_visemes.mel_stream import viseme_facts
from realizer.speech.sound_visemes.recogniser import VisemeRecogniser, recognised
from realizer.speech.utterance import Phoneme
from training.spoken_corpus import (
    Spoken,
    aligned,
    by_festival,
    by_flite,
    by_voice,
    classes,
    librivox,
    russian,
    sentences,
)

FRAME = 0.04  # s
NEAR = 0.02  # s by which a closure may lie beside the known one
PIECE = 0.02  # s of a live stream


def speakers(count: int) -> Iterator[tuple[str, list[Spoken]]]:
    """Yield speakers that the network was not trained on, with their speech."""
    random = np.random.default_rng(3)
    english = [line.strip() for line in SENTENCES["en-US"].splitlines()][:count]
    swedish, italian = (sentences(name, count, random) for name in ("swedish", "italian"))
    # The times that hibari reports are 15 to 20 ms off.
    hibari = by_voice("hibari", "en-US", english, (1.0,))
    yield "voice: hibari, English", list(aligned(hibari, english))
    yield "voice: flite rms, English", list(by_flite("rms", english, (1.0, 1.2)))
    yield "voice: espeak sv+f5, Swedish", list(by_voice("espeak:sv+f5", "sv", swedish, (1.0, 1.2)))
    yield "person: Festival lp, Italian", list(by_festival("lp_diphone", italian, (1.0, 1.2)))
    yield "person: recordings, English", list(librivox())
    yield "known person, other recordings, Russian", list(russian(slice(400, 400 + count)))


class Score:
    """The measurements of one way to find mouth shapes."""

    def __init__(self) -> None:
        size = len(viseme_facts()["class"])
        self.counts = np.zeros((size, size), int)  # known, found
        self.shifts: list[float] = []
        self.closures = [0, 0, 0, 0]  # known, of these found; found, of these known

    def add(self, known: Sequence[Phoneme], found: Sequence[Phoneme], duration: float) -> None:
        """Add the speech of one sentence."""
        times = np.arange(0, duration, FRAME)
        right, heard = classes(known, times), classes(found, times)
        used = (right >= 0) & (heard >= 0)
        np.add.at(self.counts, (right[used], heard[used]), 1)
        fine = np.arange(0, duration, 0.005)
        a, b = _runs(classes(known, fine)), _runs(classes(found, fine))
        for number, start, end in a:
            same = [s for n, s, e in b if n == number and s < end and e > start]
            if same and number != len(self.counts) - 1:
                self.shifts.append((same[0] - start) * 0.005)
        for k, (one, other) in enumerate(((a, b), (b, a))):
            closed = [(s - NEAR / 0.005, e + NEAR / 0.005) for n, s, e in one if n == 0]
            meets = [any(n == 0 and s < end and e > start for n, s, e in other) for start, end in closed]
            self.closures[2 * k] += len(closed)
            self.closures[2 * k + 1] += sum(meets)

    @property
    def balanced(self) -> float:
        """The mean over the classes, without silence, of the share of frames that are right."""
        spoken = self.counts[:-1]
        return float(np.mean([row[k] / row.sum() for k, row in enumerate(spoken) if row.sum()]))

    def line(self) -> str:
        """Return all figures as text."""
        shift = 1000 * np.array(self.shifts or [np.nan])
        known, caught, closed, real = self.closures
        right = np.diag(self.counts)[:-1].sum() / self.counts[:-1].sum()
        return (
            f"balanced {self.balanced:.3f}  frames {right:.3f}  "
            f"shift {np.median(shift):+4.0f} ms, median of sizes {np.median(abs(shift)):3.0f}  "
            f"p b m {caught / max(known, 1):.2f} found, {real / max(closed, 1):.2f} of found real"
        )


def _runs(numbers: np.ndarray) -> list[tuple[int, int, int]]:
    edges = np.flatnonzero(np.diff(numbers)) + 1
    starts = np.append(0, edges)
    return [
        (int(numbers[s]), int(s), int(e)) for s, e in zip(starts, np.append(edges, len(numbers)), strict=True)
    ]


def live(spoken: Spoken) -> tuple[Phoneme, ...]:
    """Return the phonemes of a stream of short pieces."""
    stream, size = VisemeRecogniser(spoken.rate), round(PIECE * spoken.rate)
    pieces = [p for at in range(0, len(spoken.pcm), size) for p in stream.feed(spoken.pcm[at : at + size])]
    return (*pieces, *stream.close())


def whole(spoken: Spoken) -> tuple[Phoneme, ...]:
    return recognised(spoken.pcm, spoken.rate)


def loudness(spoken: Spoken) -> tuple[Phoneme, ...]:
    return by_loudness(spoken.pcm, spoken.rate)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sentences", type=int, default=40)
    parser.add_argument("--confusion", action="store_true", help="print which classes are found for which")
    options = parser.parse_args()
    ways: tuple[Callable[[Spoken], tuple[Phoneme, ...]], ...] = (whole, loudness)
    elapsed, seconds = dict.fromkeys((whole, live, loudness), 0.0), 0.0
    for name, speech in speakers(options.sentences):
        scores = [Score() for _ in ways]
        for spoken in speech:
            seconds += len(spoken.pcm) / spoken.rate
            found = {}
            for way in elapsed:
                begin = time.process_time()
                found[way] = way(spoken)
                elapsed[way] += time.process_time() - begin
            assert found[live] == found[whole], "live differs from offline"
            for way, score in zip(ways, scores, strict=True):
                score.add(spoken.phonemes, found[way], len(spoken.pcm) / spoken.rate)
        print(f"{name} ({sum(len(s.pcm) / s.rate for s in speech):.0f} s)")
        for way, score in zip(ways, scores, strict=True):
            print(f"    {way.__name__:9s} {score.line()}", flush=True)
        if options.confusion:
            share = 100 * scores[0].counts / np.maximum(scores[0].counts.sum(axis=1, keepdims=True), 1)
            for row, values in zip(viseme_facts()["class"], share, strict=True):
                print(f"    {row['ipa'] or '-':2s}", " ".join(f"{v:3.0f}" for v in values))
    factors = ", ".join(f"{way.__name__} {value / seconds:.4f}" for way, value in elapsed.items())
    print(f"processor time as part of the sound's: {factors}; live gets pieces of {1000 * PIECE:.0f} ms")


if __name__ == "__main__":
    main()
