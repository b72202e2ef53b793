"""Measures how often synthesised emotions are recognised on each face, and the time of a word.

python benchmarks/emotion.py [--face NAME ...] [--draws 40]

Random FAPs of each profile move the face's mesh. The emotion is recognised from the feature points of the
mesh, with noise of a tenth of each FAP's range (for a FAP without a range: of the class "absent"). High rates
show that nothing is lost between synthesis and recognition, not that people would agree, because both use the
same ranges. The last table uses the 15 distances of Raouzaiou et al. 2002, table 3, which describe only the
outer lips, and one sum for both eyelids.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections import Counter
from collections.abc import Sequence

import numpy as np

from realizer.emotions.archetypes import archetypes
from realizer.emotions.profile import Profile
from realizer.emotions.wheel import wheel
from realizer.emotions.words import emotion, known_words
from realizer.face.deform import deform
from realizer.face.load import list_faces, load_face
from realizer.face.model import Face
from realizer.tables.emotions import emotion_model
from realizer_studio.analysis.recognise import Recogniser, recogniser
from tests.mesh_features import faps_from_mesh, features_from_mesh, measurable_profile

Counts = dict[str, Counter[str]]


def lengths(profile: Profile) -> np.ndarray:
    """Return (68,), the length of each FAP's range."""
    found = np.full(68, 2 * emotion_model().absent)
    for fap, (low, high) in profile.ranges.items():
        found[fap - 1] = high - low
    return found


def recognise_from_mesh(
    face: Face, known: Recogniser, profiles: Sequence[Profile], draws: int, numbered: bool
) -> Counts:
    """Return emotion -> recognised emotions of random draws of its profiles.

    Args:
        numbered: whether the names of profiles end in a number.
    """
    chance = np.random.default_rng(0)
    found: Counts = {}
    for profile in profiles:
        frames = np.stack([profile.draw(chance) for _ in range(draws)])
        read, seen = faps_from_mesh(face, deform(face, frames))
        read = read + chance.normal(0, 0.1 * lengths(profile), read.shape)
        name = profile.name.rpartition(" ")[0] if numbered else profile.name
        found.setdefault(name, Counter()).update(str(got) for got in known.names(read, seen))
    return found


def recognise_from_distances(
    face: Face, known: Recogniser, profiles: Sequence[Profile], draws: int
) -> Counts:
    """Return emotion -> recognised emotions by the 15 distances alone, without noise; ranges are from ada."""
    chance = np.random.default_rng(0)
    known = Recogniser([measurable_profile(profile, load_face("ada")) for profile in known.profiles])
    found: Counts = {}
    for profile in profiles:
        vertices = deform(face, np.stack([profile.draw(chance) for _ in range(draws)]))
        read, seen = features_from_mesh(face, vertices)
        name = profile.name.rpartition(" ")[0]
        found.setdefault(name, Counter()).update(str(got) for got in known.names(read, seen))
    return found


def show(title: str, counts: Counts) -> None:
    """Print per cent of recognised emotions (columns) for each synthesised emotion (row)."""
    columns = [*counts, *sorted({got for row in counts.values() for got in row} - set(counts))]
    right = [row[name] / row.total() for name, row in counts.items()]
    print(f"\n{title}: {100 * statistics.mean(right):.1f} % right, the worst {100 * min(right):.0f} %")
    print(" " * 14 + "".join(f"{name[:10]:>11}" for name in columns))
    for name, row in counts.items():
        cells = (
            f"{100 * row[column] / row.total():11.0f}" if row[column] else " " * 10 + "."
            for column in columns
        )
        print(f"{name:14}" + "".join(cells))


def speed() -> None:
    """Print the time of a word and of a point on the wheel of emotions."""
    spent = []
    for _ in range(20):
        for word in known_words():
            for profiles in ("own", "published"):
                begin = time.perf_counter()
                emotion(word, profiles)
                spent.append(time.perf_counter() - begin)
    begin = time.perf_counter()
    for angle in range(1000):
        wheel(angle * 0.36, 5)
    places = (time.perf_counter() - begin) / 1000
    print(
        f"\na word to its profile: {1e6 * statistics.median(spent):.0f} us (99 of 100 within "
        f"{1e6 * statistics.quantiles(spent, n=100)[-1]:.0f}), a place on the wheel {1e6 * places:.0f} us"
    )


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--face", nargs="*", default=[info.name for info in list_faces()])
    options.add_argument("--draws", type=int, default=40)
    chosen = options.parse_args()
    rated = [word for word, source in known_words().items() if source == "whissell"]
    for name in chosen.face:
        face = load_face(name)
        for profiles in ("own", "published"):
            every = [p for numbered in archetypes(profiles).values() for p in numbered.values()]
            known = recogniser(profiles)
            show(f"{name}, {profiles}, mesh", recognise_from_mesh(face, known, every, chosen.draws, True))
            words = [emotion(word, profiles) for word in rated]
            show(
                f"{name}, {profiles}, words",
                recognise_from_mesh(face, Recogniser(words), words, chosen.draws, False),
            )
            show(
                f"{name}, {profiles}, 15 features", recognise_from_distances(face, known, every, chosen.draws)
            )
    speed()


if __name__ == "__main__":
    main()
