"""Measures markers in films of our faces, and how well expressions are found in synthetic recordings.

python benchmarks/corpus.py [--minutes 3] [--frames 15000] [--keep DIR]

Films of three faces with 31 painted dots, 720 x 576, show random timelines of the twelve templates while
the mouth speaks and the head moves; 2 % of the dots are hidden, in spells. The face below the dots is drawn
once a second, as drawing is slow; the dots move in every frame, and the film is compressed. Asked are a
median error of the markers under 2 pixels, and the right order in 99.5 % of the frames. A map learns what
was tracked.

Then four recordings show the templates as often as those of Wojdel 2005 (table 6.3), at random times,
lengths and strengths, with a mouth that speaks and with noise. A map learns two of them, with their labels
and without, and finds expressions in all. The shares of frames and segments are those of her section 7.4:
86.3 % and 77.7 %, of the recordings that she learned from.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from realizer_studio.corpus.face_map import learn, template_faps
from realizer_studio.corpus.films import with_markers
from realizer_studio.corpus.finder import agreement, find
from realizer_studio.corpus.recording import Annotation, Recording
from realizer_studio.tracking.markers.colours import named
from realizer_studio.tracking.markers.film import MarkerSettings, track_markers
from realizer_studio.tracking.pictures import read_pictures
from tests.painted import hidden, truth, write_film

SEGMENTS = {
    "astonishment": 9, "surprise": 106, "sadness": 6, "disbelief": 5, "regret": 8, "grief": 40, "anger": 66,
    "disgust": 22, "happiness": 20, "understanding": 2, "satisfaction": 2, "ironic smile": 1,
}  # fmt: skip
RAMP = 6  # frames of onsets and offsets
MOUTH = {3: 170, 5: -190, 10: -160, 11: -160, 52: -190, 57: -160, 58: -160}  # FAPs of a wide open mouth


FACES = ("ada", "ben", "ida")
HIDDEN = 0.02
NOD = 3000  # units of the head's rotation, 1e-5 radians


def recording(seed: int, frames: int, noise: float = 8.0, head: float = 0.0) -> Recording:
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
    for fap, period in ((48, 130), (49, 210), (50, 170)):
        values[:, fap - 1] = head * np.sin(np.arange(frames) * 2 * np.pi / period + seed + fap)
    noises = chance.normal(0, noise, values.shape)
    return Recording(f"r{seed}", {}, tuple(labels), faps=values + noises)


def film(face: str, seed: int, frames: int, folder: Path) -> Recording:
    """Track a film of a face with markers, print how well, and return what a corpus has of it."""
    acted = recording(seed, frames, 2.0, NOD)
    assert acted.faps is not None
    gone, true = hidden(frames, HIDDEN, seed), truth(face, acted.faps)
    path = folder / f"{face}-{seed}-{frames}.mp4"
    if not path.is_file():
        write_film(path, face, acted.faps, gone)
    begin = time.process_time()
    markers = track_markers(
        read_pictures(path)[1], MarkerSettings((named("green"), named("blue"))), str(path)
    )
    spent = 1000 * (time.process_time() - begin) / frames
    off = np.linalg.norm(markers.pixels - true, axis=2)
    # A marker is in order if none of the others is nearer to it than its own.
    apart = np.linalg.norm(markers.pixels[:, :, None] - true[:, None], axis=-1)
    right = apart.argmin(axis=2) == np.arange(true.shape[1])
    lost = off[gone & ~markers.seen]
    print(
        f"{face}: {frames} frames, {spent:.0f} ms each; median error {np.median(off):.2f} pixels, 95 % under "
        f"{np.quantile(off, 0.95):.2f}, of hidden ones {np.median(lost):.2f}; in order in "
        f"{right.all(axis=1).mean():.2%} of frames",
        flush=True,
    )
    return with_markers(replace(acted, faps=None), markers, face)


def films(minutes: float, folder: Path) -> None:
    """Track films, and find expressions in their markers by a map of the same films."""
    frames = int(minutes * 60 * 25 / len(FACES))
    tracked = [film(face, seed, frames, folder) for seed, face in enumerate(FACES, 11)]
    for title, known in (
        ("points of markers, with labels", [replace(one, faps=None) for one in tracked]),
        ("FAPs of markers, with labels", tracked),
        ("FAPs of markers, without labels", [replace(one, labels=()) for one in tracked]),
    ):
        report(title, known, {"the same": (tracked, known)})


def report(
    title: str, known: list[Recording], tried: dict[str, tuple[list[Recording], list[Recording]]]
) -> None:
    """Print how far what a map finds agrees with the labels of recordings.

    Args:
        known: what the map learns; tried: title -> recordings with labels, and the same as they are searched.
    """
    begin = time.perf_counter()
    learnt = learn(known)
    frames = sum(one.frames for one in known)
    print(f"{title}: {frames} frames learnt in {time.perf_counter() - begin:.1f} s")
    for kind, (labelled, searched) in tried.items():
        pairs = zip(labelled, searched, strict=True)
        shares = [agreement(one.segments(), find(other, learnt), one.frames) for one, other in pairs]
        same, met = np.mean(shares, axis=0)
        print(f"  {kind:6} recordings: {same:.1%} of frames, {met:.1%} of segments", flush=True)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--minutes", type=float, default=3.0, help="of all films together; 20 take hours")
    options.add_argument("--frames", type=int, default=15_000, help="of each recording without a film")
    options.add_argument("--keep", type=Path, help="folder where films are kept, and looked for")
    chosen = options.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        films(chosen.minutes, chosen.keep or Path(temporary))
    seen, unseen = ([recording(seed, chosen.frames) for seed in seeds] for seeds in ((1, 2), (3, 4)))
    for title, known in (("with labels", seen), ("without", [replace(one, labels=()) for one in seen])):
        report(title, known, {"learnt": (seen, seen), "new": (unseen, unseen)})


if __name__ == "__main__":
    main()
