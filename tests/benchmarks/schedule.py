"""How long schedules take: `python tests/benchmarks/schedule.py` prints medians, and how they grow.

Parsing and behaviours' timings are not in it: a block and its timings in, a schedule out.
"""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable

import numpy as np

from bml_schema import MOST_BEHAVIOURS, Block, parse
from realizer.scheduling import Timing, schedule_block

Work = tuple[Block, dict[str, Timing]]

FACE = ("start", "attackPeak", "relax", "end")
NOD = ("start", "ready", "strokeStart", "stroke", "strokeEnd", "relax", "end")


def timing(points: tuple[str, ...], total: float, *, rigid: bool = False) -> Timing:
    k = len(points) - 1
    return Timing(points, np.full(k, total / k), np.full(k, 0.02), np.ones(k), rigid)


def block(body: str) -> Block:
    return parse(f'<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="b1">{body}</bml>')


def face(name: str, syncs: str = "") -> str:
    return f'<faceLexeme id="{name}" lexeme="SMILE" {syncs}/>'


def lengths(n: int) -> list[float]:
    return (1.0 + np.random.default_rng(1).random(n)).tolist()


def typical() -> Work:
    """A speech with two marks, a nod on one, a face from one to the other, a gaze before, a blink after."""
    body = (
        '<speech id="s"><text>Well <sync id="m1"/> yes <sync id="m2"/> indeed</text></speech>'
        '<head id="n" lexeme="NOD" stroke="s:m1"/><gaze id="g" target="x" end="s:start"/>'
        + face("f", 'start="s:m1" end="s:m2"')
        + face("e", 'start="s:end + 0.2"')
    )
    gaze = ("start", "ready", "relax", "end")
    return block(body), {
        "s": timing(("start", "m1", "m2", "end"), 2.0, rigid=True),
        "n": timing(NOD, 0.8),
        "g": timing(gaze, 1.0),
        "f": timing(FACE, 1.0),
        "e": timing(FACE, 0.4),
    }


def linked(n: int) -> Work:
    """Faces, each tied at its start to the one before, at its end to the one three before: one component."""
    body = "".join(
        face(
            f"f{k}",
            (f'start="f{k - 1}:attackPeak" ' if k else "") + (f'end="f{k - 3}:end + 1"' if k > 2 else ""),
        )
        for k in range(n)
    )
    return block(body), {f"f{k}": timing(FACE, d) for k, d in enumerate(lengths(n))}


def groups(n: int) -> Work:
    """Groups of five that are tied to each other in two points, no inequality active."""
    body = "".join(
        face(f"f{k}", "" if k % 5 == 0 else f'start="f{k - 1}:attackPeak" end="f{k - k % 5}:end"')
        for k in range(n)
    )
    return block(body), {f"f{k}": timing(FACE, d / (1 + k % 5)) for k, d in enumerate(lengths(n))}


def squeezed(n: int) -> Work:
    """As `linked`, pinned and in so little time that least gaps are reached all along."""
    body = "".join(
        face(
            f"f{k}",
            (f'start="f{k - 1}:attackPeak" ' if k else 'start="0" ')
            + (f'end="f{k - 3}:end + 0.2"' if k > 2 else ""),
        )
        for k in range(n)
    )
    return block(body), {f"f{k}": timing(FACE, d) for k, d in enumerate(lengths(n))}


def tight(n: int) -> Work:
    """Groups as in `groups`, each with no more time than brings some of its gaps to their least."""
    body = "".join(
        face(
            f"f{k}",
            'start="1" end="1.5"' if k % 5 == 0 else f'start="f{k - 1}:attackPeak" end="f{k - k % 5}:end"',
        )
        for k in range(n)
    )
    return block(body), {f"f{k}": timing(FACE, d / (1 + k % 5)) for k, d in enumerate(lengths(n))}


def ordered(n: int) -> Work:
    """A chain of <after>s, all active, that nothing holds: sliding only."""
    body = "".join(face(f"f{k}") for k in range(n))
    body += "".join(
        f'<constraint><after ref="f{k - 1}:end"><sync ref="f{k}:start"/></after></constraint>'
        for k in range(1, n)
    )
    return block(body), {f"f{k}": timing(FACE, d) for k, d in enumerate(lengths(n))}


def loose(n: int) -> Work:
    """Behaviours that nothing ties."""
    body = "".join(face(f"f{k}") for k in range(n))
    return block(body), {f"f{k}": timing(FACE, d) for k, d in enumerate(lengths(n))}


def phrases(n: int) -> Work:
    """One speech of n phrases, two faces a phrase from mark to mark."""
    text = "".join(f'<sync id="m{k}"/> word ' for k in range(n + 1))
    body = f'<speech id="s"><text>{text}</text></speech>'
    body += "".join(face(f"{c}{k}", f'start="s:m{k}" end="s:m{k + 1}"') for k in range(n) for c in "fg")
    marks = ("start", *(f"m{k}" for k in range(n + 1)), "end")
    return block(body), {
        "s": timing(marks, float(n), rigid=True),
        **{f"{c}{k}": timing(FACE, 1.0) for k in range(n) for c in "fg"},
    }


def clashing(n: int) -> Work:
    """Pairs that wait for each other: half of the behaviours are dropped."""
    body = "".join(face(f"f{k}", f'start="f{k ^ 1}:end"') for k in range(n))
    return block(body), {f"f{k}": timing(FACE, d) for k, d in enumerate(lengths(n))}


def median(work: Work, least: float = 0.5) -> float:
    """Seconds for one schedule; the median of runs that take half a second together, at least five."""
    schedule_block(*work)
    runs: list[float] = []
    gc.collect()
    while len(runs) < 5 or (sum(runs) < least and len(runs) < 2000):
        begin = time.perf_counter()
        schedule_block(*work)
        runs.append(time.perf_counter() - begin)
    return statistics.median(runs)


TABLE: list[tuple[str, Callable[[], Work], float | None]] = [
    ("typical block of 5", typical, 0.4),
    ("20 cross-linked", lambda: linked(20), 1.5),
    ("100 cross-linked", lambda: linked(100), 5.0),
    ("2,000 cross-linked", lambda: linked(2000), None),
    ("2,000 in groups, no inequality active", lambda: groups(2000), 40.0),
    ("20 squeezed", lambda: squeezed(20), None),
    ("100 squeezed", lambda: squeezed(100), None),
    ("2,000 squeezed, inequalities active", lambda: squeezed(2000), 150.0),
    ("2,000 in small groups, each squeezed", lambda: tight(2000), 150.0),
    ("2,000 in a chain of <after>s", lambda: ordered(2000), 150.0),
    ("2,000 that nothing ties", lambda: loose(2000), 40.0),
    ("speech of 40 phrases, 2 faces each", lambda: phrases(40), 8.0),
    ("200 in clashing pairs", lambda: clashing(200), None),
]


def main() -> None:
    print(f"{'work':40} {'median ms':>10} {'wanted ms':>10} {'dropped':>8}")
    for name, make, wanted in TABLE:
        work = make()
        found = schedule_block(*work)
        under = "" if wanted is None else f"< {wanted:g}"
        print(f"{name:40} {median(work) * 1e3:10.3f} {under:>10} {len(found.warnings):8}")
    print(f"\n{'growth (slope of log time over log n)':40}")
    sizes = [n for n in (50, 200, 1000, 5000) if n <= MOST_BEHAVIOURS]
    for name, make_n in (
        ("groups", groups),
        ("cross-linked", linked),
        ("squeezed", squeezed),
        ("chain of <after>s", ordered),
    ):
        medians = [median(make_n(n), 0.2) for n in sizes]
        slope = np.polyfit(np.log(sizes), np.log(medians), 1)[0]
        times = ", ".join(f"{n}: {t * 1e3:.2f} ms" for n, t in zip(sizes, medians, strict=True))
        print(f"{name:40} {slope:10.2f}   {times}")


if __name__ == "__main__":
    main()
