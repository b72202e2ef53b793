"""How true a face's FAPs are: the 127 displacements by rules, beside what Paul 2010 gave other faces.

python tests/benchmarks/face.py [--face NAME ...] [--all] [--worst 10]
"""

from __future__ import annotations

import argparse
import time

from realizer.face import list_faces, load_face
from realizer.face.mpeg4 import PEERS, Truth, face_truth, mean_score


def line(truth: Truth) -> str:
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
        truths = face_truth(face)
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
        for peer, score in PEERS.items():
            print(f"{peer:30}{score:6.2f}   (by eye, Paul 2010; FAPs that it lacks count 0)")


if __name__ == "__main__":
    main()
