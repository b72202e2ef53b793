"""Measures the scheduler: `python benchmarks/schedule.py` prints medians, and their growth.

Most rows measure the schedule of a parsed block with known timings. The rows of sessions measure
`Player.submit`, which also makes channels and feedback. Medians are of elapsed time and of processor time,
which other work on the machine disturbs less.

Solvers of the problems with inequalities were compared in 2026-11 (processor time in milliseconds, and the
largest error of a sync point in seconds; Clarabel 0.11 and PIQP 0.6 to 1e-11, OSQP 1.1 to 1e-7 with
polishing, DAQP 0.11, which is dense; on a busy machine with 2 cores):

    unknowns              43              203             4,003           310 (31 components)
    guess, exactly        0.44            1.8             40              0.9
    Clarabel              0.96  5e-10     3.3   1e-6      98    2e-4      3.3   1e-6
    OSQP                  1.3   3e-15     10.7  5e-5      1351  3e-2      1.7   1e-15
    PIQP                  0.32  1e-8      1.3   1e-6      28    4e-5      1.2   1e-5
    DAQP                  0.13  2e-14     9.9   9e-13     -               31    7e-16

"Guess" is realizer/scheduling/convex.py: it solves sparse least squares with the active inequalities as
equalities, and updates the active set until all inequalities hold and no multiplier has the wrong sign. It is
exact, takes one to three rounds here, and needs no library. Some problems without any slack make it cycle;
those are solved by Clarabel, whose solution is made exact in the same way.
"""

from __future__ import annotations

import gc
import random
import statistics
import time
from collections.abc import Callable

import numpy as np
from plot import exponent
from stopwatch import handle_help, noise

from bml_schema import MAX_BEHAVIOURS, Block, parse
from realizer.core.options import PlayOptions
from realizer.playback.player import Player
from realizer.scheduling import Timing
from tests.realizer.scheduling.recipes import schedule_block

Work = tuple[Block, dict[str, Timing]]

FACE = ("start", "attackPeak", "relax", "end")
NOD = ("start", "ready", "strokeStart", "stroke", "strokeEnd", "relax", "end")


def timing(points: tuple[str, ...], total: float, *, rigid: bool = False) -> Timing:
    k = len(points) - 1
    return Timing(points, np.full(k, total / k), np.full(k, 0.02), np.ones(k), rigid)


def block(body: str, id: str = "b1") -> Block:
    return parse(f'<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="{id}">{body}</bml>')


def face(name: str, syncs: str = "") -> str:
    return f'<faceLexeme id="{name}" lexeme="SMILE" {syncs}/>'


def lengths(n: int) -> list[float]:
    return (1.0 + np.random.default_rng(1).random(n)).tolist()


def typical() -> Work:
    """Return a speech with two marks, with a nod, faces and a gaze that refer to it."""
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
    """Faces, each links at its start to the one before, at its end to the one three before: one component."""
    body = "".join(
        face(
            f"f{k}",
            (f'start="f{k - 1}:attackPeak" ' if k else "") + (f'end="f{k - 3}:end + 1"' if k > 2 else ""),
        )
        for k in range(n)
    )
    return block(body), {f"f{k}": timing(FACE, d) for k, d in enumerate(lengths(n))}


def groups(n: int) -> Work:
    """Return groups of five behaviours with two links each; no inequality is active."""
    body = "".join(
        face(f"f{k}", "" if k % 5 == 0 else f'start="f{k - 1}:attackPeak" end="f{k - k % 5}:end"')
        for k in range(n)
    )
    return block(body), {f"f{k}": timing(FACE, d / (1 + k % 5)) for k, d in enumerate(lengths(n))}


def squeezed(n: int) -> Work:
    """Return the blocks of `linked` with a fixed start and so little time that all gaps are minimal."""
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
    """Return the blocks of `groups` with so little time that some gaps are minimal."""
    body = "".join(
        face(
            f"f{k}",
            'start="1" end="1.5"' if k % 5 == 0 else f'start="f{k - 1}:attackPeak" end="f{k - k % 5}:end"',
        )
        for k in range(n)
    )
    return block(body), {f"f{k}": timing(FACE, d / (1 + k % 5)) for k, d in enumerate(lengths(n))}


def ordered(n: int) -> Work:
    """Return a chain of active <after> constraints without a fixed time."""
    body = "".join(face(f"f{k}") for k in range(n))
    body += "".join(
        f'<constraint><after ref="f{k - 1}:end"><sync ref="f{k}:start"/></after></constraint>'
        for k in range(1, n)
    )
    return block(body), {f"f{k}": timing(FACE, d) for k, d in enumerate(lengths(n))}


def loose(n: int) -> Work:
    """Return behaviours without links."""
    body = "".join(face(f"f{k}") for k in range(n))
    return block(body), {f"f{k}": timing(FACE, d) for k, d in enumerate(lengths(n))}


def phrases(n: int) -> Work:
    """Return a speech of n phrases, with two faces for each phrase, from mark to mark."""
    text = "".join(f'<sync id="m{k}"/> word ' for k in range(n + 1))
    body = f'<speech id="s"><text>{text}</text></speech>'
    body += "".join(face(f"{c}{k}", f'start="s:m{k}" end="s:m{k + 1}"') for k in range(n) for c in "fg")
    marks = ("start", *(f"m{k}" for k in range(n + 1)), "end")
    return block(body), {
        "s": timing(marks, float(n), rigid=True),
        **{f"{c}{k}": timing(FACE, 1.0) for k in range(n) for c in "fg"},
    }


def clashing(n: int) -> Work:
    """Return pairs that wait for each other, so that half of the behaviours are dropped."""
    body = "".join(face(f"f{k}", f'start="f{k ^ 1}:end"') for k in range(n))
    return block(body), {f"f{k}": timing(FACE, d) for k, d in enumerate(lengths(n))}


def impossible(n: int) -> Work:
    """Return nods that are each impossible by themselves."""
    body = "".join(f'<head id="n{k}" lexeme="NOD" start="0" end="0.1" stroke="5"/>' for k in range(n))
    return block(body), {f"n{k}": timing(NOD, 0.8) for k in range(n)}


def tangled(n: int) -> Work:
    """Return nods, each from a random point of an earlier one to 3 s after that of another; many clash."""
    chance = random.Random(1)
    body = '<head id="n0" lexeme="NOD"/>'
    for k in range(1, n):
        start, end = (f"n{chance.randrange(k)}:{chance.choice(NOD)}" for _ in range(2))
        body += f'<head id="n{k}" lexeme="NOD" start="{start}" end="{end} + 3"/>'
    return block(body), {f"n{k}": timing(NOD, 0.8) for k in range(n)}


def median(work: Work, least: float = 0.5) -> Times:
    """Return the median time of one schedule, over at least five runs and `least` seconds."""
    schedule_block(*work)
    runs: list[Times] = []
    gc.collect()
    while len(runs) < 5 or (sum(clock for clock, _ in runs) < least and len(runs) < 2000):
        runs.append(measure_once(lambda: schedule_block(*work)))
    return median_of(runs)


# Elapsed seconds, and processor seconds.
Times = tuple[float, float]


def measure_once(work: Callable[[], object]) -> Times:
    clock, processor = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - clock, time.process_time() - processor


def median_of(runs: list[Times]) -> Times:
    clocks, processors = zip(*runs, strict=True)
    return statistics.median(clocks), statistics.median(processors)


def faces(id: str, links: str = "") -> Block:
    """Return five linked faces, one block of a session."""
    names = ("SMILE", "OPEN_MOUTH", "WIDEN_EYES", "LOWER_BROWS")
    body = f'<faceLexeme id="f0" lexeme="RAISE_BROWS" {links}/>'
    for k, name in enumerate(names, 1):
        ends = f'start="f{k - 1}:attackPeak" end="f0:end + {k / 10}"'
        body += f'<faceLexeme id="f{k}" lexeme="{name}" {ends}/>'
    return block(body, id)


def session() -> tuple[Times, Times]:
    """Return the time of submitting a block, around the 20th and around the 2,000th of a session."""
    player = Player(PlayOptions(idle=False))
    runs: list[Times] = []
    for k in range(2041):
        one, now = faces(f"b{k}"), 4.0 * k
        runs.append(measure_once(lambda one=one, now=now: player.submit(one, now)))  # type: ignore[misc]
        player.due(now)
    return median_of(runs[10:51]), median_of(runs[1990:2041])


def measure_added_block(chained: bool) -> Times:
    """Return the time of submitting a block that is linked to one of 50 playing blocks."""
    runs: list[Times] = []
    for _ in range(15):
        player = Player(PlayOptions(idle=False))
        for k in range(50):
            player.submit(faces(f"b{k}", f'start="b{k - 1}:f0:start + 0.05"' if chained and k else ""), 0.0)
        player.due(0.1)
        new = faces("new", 'start="b25:f0:end"')
        runs.append(measure_once(lambda player=player, new=new: player.submit(new, 0.1)))  # type: ignore[misc]
    return median_of(runs)


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
    ("2,000 without links", lambda: loose(2000), 40.0),
    ("speech of 40 phrases, 2 faces each", lambda: phrases(40), 8.0),
    ("200 in clashing pairs", lambda: clashing(200), None),
    ("1,000 that are each impossible", lambda: impossible(1000), 80.0),
    ("400 cross-linked at random", lambda: tangled(400), 70.0),
]


def main() -> None:
    handle_help(__doc__)
    print(noise())
    print(f"{'work':40} {'median ms':>10} {'processor':>10} {'wanted ms':>10} {'dropped':>8}")

    def row(name: str, found: Times, wanted: float | None, dropped: int = 0) -> None:
        under = "" if wanted is None else f"< {wanted:g}"
        print(f"{name:40} {found[0] * 1e3:10.3f} {found[1] * 1e3:10.3f} {under:>10} {dropped:8}")

    for name, make, wanted in TABLE:
        work = make()
        row(name, median(work), wanted, len(schedule_block(*work).warnings))
    early, late = session()
    row("20th block of a session", early, None)
    row("2,000th block of a session", late, None)
    print(f"{'2,000th over 20th':40} {late[0] / early[0]:10.2f} {late[1] / early[1]:10.2f} {'< 1.2':>10}")
    row("one measure_added_block, linked to one of 50 blocks", measure_added_block(chained=False), 5.0)
    row("one measure_added_block to 50 that are linked in a chain", measure_added_block(chained=True), None)
    print(f"\n{'growth (slope of log time over log n)':40}")
    sizes = [n for n in (50, 200, 1000, 5000) if n <= MAX_BEHAVIOURS]
    for name, make_n in (
        ("groups", groups),
        ("cross-linked", linked),
        ("squeezed", squeezed),
        ("chain of <after>s", ordered),
    ):
        medians = [median(make_n(n), 0.2) for n in sizes]
        slope = exponent(sizes, [processor for _, processor in medians])
        times = ", ".join(f"{n}: {t * 1e3:.2f} ms" for n, (t, _) in zip(sizes, medians, strict=True))
        print(f"{name:40} {slope:10.2f}   {times}")


if __name__ == "__main__":
    main()
