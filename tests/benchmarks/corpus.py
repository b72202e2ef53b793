"""Measures how well expressions are found in synthetic recordings, and the time of it.

python tests/benchmarks/corpus.py [--frames 15000]

Four recordings show the twelve templates as often as those of Wojdel 2005 (table 6.3), at random times,
lengths and strengths, with a mouth that speaks and with noise. A map learns two of them, with their labels
and without, and finds expressions in all. The shares of frames and segments are those of her section 7.4:
86.3 % and 77.7 %, of the recordings that she learned from.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace

import numpy as np

from realizer.corpus.find import agreement, find
from realizer.corpus.learn import learn, template_faps
from realizer.corpus.recording import Annotation, Recording

SEGMENTS = {
    "astonishment": 9, "surprise": 106, "sadness": 6, "disbelief": 5, "regret": 8, "grief": 40, "anger": 66,
    "disgust": 22, "happiness": 20, "understanding": 2, "satisfaction": 2, "ironic smile": 1,
}  # fmt: skip
RAMP = 6  # frames of onsets and offsets
MOUTH = {3: 170, 5: -190, 10: -160, 11: -160, 52: -190, 57: -160, 58: -160}  # FAPs of a wide open mouth


def recording(seed: int, frames: int) -> Recording:
    """Return a labelled recording."""
    chance = np.random.default_rng(seed)
    names, counts = list(SEGMENTS), np.array(list(SEGMENTS.values()), float)
    values, labels, at = np.zeros((frames, 68)), [], 30
    while at < frames - 200:
        name = names[chance.choice(len(names), p=counts / counts.sum())]
        length = int(np.clip(chance.lognormal(np.log(24), 0.6), 8, 120))
        shown = np.zeros(frames)
        shown[at : at + length] = chance.uniform(0.6, 1.1)
        values += np.convolve(shown, np.ones(RAMP) / RAMP, "same")[:, None] * template_faps()[name]
        labels.append(Annotation(at / 25, (at + length) / 25, name, "actor"))
        at += length + int(chance.exponential(45)) + 8
    speaks = np.sin(np.arange(frames) / 48 + seed) > -0.2
    opens = np.convolve(chance.uniform(0, 1, frames), np.ones(3) / 3, "same") * speaks
    for fap, value in MOUTH.items():
        values[:, fap - 1] += value * opens
    return Recording(f"r{seed}", {}, tuple(labels), faps=values + chance.normal(0, 8, values.shape))


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--frames", type=int, default=15_000)
    frames = options.parse_args().frames
    seen, unseen = ([recording(seed, frames) for seed in seeds] for seeds in ((1, 2), (3, 4)))
    for title, known in (("with labels", seen), ("without", [replace(one, labels=()) for one in seen])):
        begin = time.perf_counter()
        learnt = learn(known)
        print(f"{title}: {2 * frames} frames learnt in {time.perf_counter() - begin:.1f} s")
        for kind, some in (("learnt", seen), ("new", unseen)):
            shares = [agreement(one.segments(), find(one, learnt), one.frames) for one in some]
            same, met = np.mean(shares, axis=0)
            print(f"  {kind:6} recordings: {same:.1%} of frames, {met:.1%} of segments")


if __name__ == "__main__":
    main()
