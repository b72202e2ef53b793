"""Scores the 127 FAP displacements of faces by rules and by eye, beside the scores of Paul 2010.

python benchmarks/face.py [--face NAME ...] [--all] [--worst 10]
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from realizer.face.load import folder_of, list_faces, load_face
from realizer.tables import read_csv
from realizer_studio.faces.mpeg4.fap_scores import FapScore, mean_score, score_faps
from realizer_studio.faces.mpeg4.zone_build import copy_with_zones

# The scores of other faces (Paul 2010, table 4.5), with FAPs that they lack counted as 0.
PEERS = {"FaceEditor": 2.60, "Greta": 2.32, "Miraface": 1.96, "Xface": 1.32}
BY_EYE = Path(__file__).with_name("fap_scores_by_eye.csv")


@dataclass(frozen=True, slots=True)
class EyeScore:
    """The score (0 to 3) of one FAP in one direction (1 or -1) by eye, and a note on what was seen."""

    face: str
    fap: int
    direction: int
    score: int
    seen: str


def by_eye(name: str, results: tuple[FapScore, ...]) -> str:
    """Return a line with the weighted mean of the scores by eye; FAPs without a score do not count."""
    rows = read_csv(BY_EYE.read_text("utf-8"), EyeScore, BY_EYE.name)
    scores = {(row.fap, row.direction): row.score for row in rows if row.face == name}
    seen = [
        (result.weight, scores[key]) for result in results if (key := (result.fap, result.sign)) in scores
    ]
    if not seen:
        return f"{name + ', weighted mean':30}     -   (by eye: no scores)"
    mean = sum(weight * score for weight, score in seen) / sum(weight for weight, _ in seen)
    return f"{name + ', weighted mean':30}{mean:6.2f}   (by eye at 512, {len(seen)} of {len(results)})"


def zones_line(name: str) -> str:
    """Return a line with the score of the same mesh moved by zones of influence, without its shapes."""
    with TemporaryDirectory() as folder:
        copy_with_zones(folder_of(name), Path(folder) / name)
        results = score_faps(load_face(name, Path(folder)))
    perfect = sum(result.score == 3 for result in results)
    return f"{name + ', by zones':30}{mean_score(results):6.2f}   (rules; {perfect} of {len(results)} at 3)"


def line(result: FapScore) -> str:
    shares = "".join(f"{100 * value:9.2f}" for value in result.faults)
    sign = "+" if result.sign > 0 else "-"
    return (
        f"{result.fap:3} {sign} {result.name:22}{result.usual:8.0f}{shares}{result.weight:4}{result.score:7}"
    )


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--face", nargs="*", default=[info.name for info in list_faces()])
    options.add_argument("--all", action="store_true", help="all 127 displacements, not the worst alone")
    options.add_argument("--worst", type=int, default=10)
    chosen = options.parse_args()
    for name in chosen.face:
        face = load_face(name)
        begin = time.perf_counter()
        results = score_faps(face)
        spent = time.perf_counter() - begin
        print(f"{name}: {len(results)} displacements of {len(face.vertices)} vertices in {spent:.1f} s")
        print(
            f"{'FAP':28}{'usual':>8}{'error %':>9}{'mirror %':>9}{'others %':>9}{'flips %':>9}{'rough %':>9}"
            f"{'w':>4}{'score':>7}"
        )
        order = sorted(results, key=lambda t: (t.score, -t.weight, -max(t.error, t.side_effect, t.roughness)))
        for result in results if chosen.all else order[: chosen.worst]:
            print(line(result))
        each = ", ".join(f"{k}: {sum(t.score == k for t in results)}" for k in (3, 2, 1, 0))
        print(f"scores {each}")
        print(f"{name + ', weighted mean':30}{mean_score(results):6.2f}   (rules)")
        print(by_eye(name, results))
        print(zones_line(name))
        for peer, score in PEERS.items():
            print(f"{peer:30}{score:6.2f}   (by eye, Paul 2010; FAPs that it lacks count 0)")


if __name__ == "__main__":
    main()
