"""How true a face's FAPs are: the 127 displacements by rules and by eye, beside what Paul 2010 gave others.

python tests/benchmarks/face.py [--face NAME ...] [--all] [--worst 10]
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from realizer.face.load import folder_of, list_faces, load_face
from realizer.facebuild.mpeg4.build import copy_with_zones
from realizer.tables import read_csv
from tests.fap_scores import PEERS, FapScore, mean_score, score_faps

BY_EYE = Path(__file__).with_name("fap_scores_by_eye.csv")


@dataclass(frozen=True, slots=True)
class Seen:
    """What one FAP in one direction (1 or -1) looked like, and its score of 3, 2, 1 or 0."""

    face: str
    fap: int
    direction: int
    score: int
    seen: str


def by_eye(name: str, truths: tuple[FapScore, ...]) -> str:
    """The mean of what was looked at, weighted as the rules' is; what nobody looked at does not count."""
    rows = read_csv(BY_EYE.read_text("utf-8"), Seen, BY_EYE.name)
    scores = {(row.fap, row.direction): row.score for row in rows if row.face == name}
    seen = [(truth.weight, scores[key]) for truth in truths if (key := (truth.fap, truth.sign)) in scores]
    if not seen:
        return f"{name + ', weighted mean':30}     -   (by eye: not looked at)"
    mean = sum(weight * score for weight, score in seen) / sum(weight for weight, _ in seen)
    return (
        f"{name + ', weighted mean':30}{mean:6.2f}   (by eye at 512, {len(seen)} of {len(truths)} looked at)"
    )


def zones_line(name: str) -> str:
    """The same mesh moved by zones of influence alone, as a head without shapes would be."""
    with TemporaryDirectory() as folder:
        copy_with_zones(folder_of(name), Path(folder) / name)
        truths = score_faps(load_face(name, Path(folder)))
    perfect = sum(truth.score == 3 for truth in truths)
    return f"{name + ', by zones':30}{mean_score(truths):6.2f}   (rules; {perfect} of {len(truths)} at 3)"


def line(truth: FapScore) -> str:
    shares = "".join(f"{100 * value:9.2f}" for value in truth.faults)
    sign = "+" if truth.sign > 0 else "-"
    return f"{truth.fap:3} {sign} {truth.name:22}{truth.usual:8.0f}{shares}{truth.weight:4}{truth.score:7}"


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--face", nargs="*", default=[info.name for info in list_faces()])
    options.add_argument("--all", action="store_true", help="all 127 displacements, not the worst alone")
    options.add_argument("--worst", type=int, default=10)
    chosen = options.parse_args()
    for name in chosen.face:
        face = load_face(name)
        began = time.perf_counter()
        truths = score_faps(face)
        spent = time.perf_counter() - began
        print(f"{name}: {len(truths)} displacements of {len(face.vertices)} vertices in {spent:.1f} s")
        print(
            f"{'FAP':28}{'usual':>8}{'error %':>9}{'mirror %':>9}{'others %':>9}{'flips %':>9}{'rough %':>9}"
            f"{'w':>4}{'score':>7}"
        )
        order = sorted(truths, key=lambda t: (t.score, -t.weight, -max(t.error, t.others, t.rough)))
        for truth in truths if chosen.all else order[: chosen.worst]:
            print(line(truth))
        each = ", ".join(f"{k}: {sum(t.score == k for t in truths)}" for k in (3, 2, 1, 0))
        print(f"scores {each}")
        print(f"{name + ', weighted mean':30}{mean_score(truths):6.2f}   (rules)")
        print(by_eye(name, truths))
        print(zones_line(name))
        for peer, score in PEERS.items():
            print(f"{peer:30}{score:6.2f}   (by eye, Paul 2010; FAPs that it lacks count 0)")


if __name__ == "__main__":
    main()
