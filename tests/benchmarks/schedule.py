"""How long schedules take: `python tests/benchmarks/schedule.py` prints medians, and how they grow.

Parsing and behaviours' timings are not in it: a block and its timings in, a schedule out; the rows of
sessions are `Player.submit`, which also makes the channels and the feedback. Medians are of time on the
clock and of the processor's, which other work on the machine disturbs less.

Solvers of the problems with inequalities, compared once, 2026-11 (processor's milliseconds, and how many
seconds the worst sync point is off; Clarabel 0.11 and PIQP 0.6 to 1e-11, OSQP 1.1 to 1e-7 with polishing,
DAQP 0.11, which is dense; on a busy machine of 2 cores):

    unknowns              43              203             4,003           310 (31 components)
    guess, exactly        0.44            1.8             40              0.9
    Clarabel              0.96  5e-10     3.3   1e-6      98    2e-4      3.3   1e-6
    OSQP                  1.3   3e-15     10.7  5e-5      1351  3e-2      1.7   1e-15
    PIQP                  0.32  1e-8      1.3   1e-6      28    4e-5      1.2   1e-5
    DAQP                  0.13  2e-14     9.9   9e-13     -               31    7e-16

"Guess" is ours (realizer/scheduling/convex.py): a sparse factorisation of the least squares with what binds
held as equalities, again until nothing is broken and nothing pulls. It is exact, takes one to three rounds
here, and needs no library. Some problems without any room make it go round in circles; those go to Clarabel,
whose answer is made exact in the same way.
"""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable

import numpy as np
from plot import exponent
from stopwatch import helped, noise

from bml_schema import MAX_BEHAVIOURS, Block, parse
from realizer.core.options import PlayOptions
from realizer.playback.player import Player
from realizer.scheduling import Timing, schedule_block

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


def median(work: Work, least: float = 0.5) -> Spent:
    """For one schedule; the median of runs that take half a second together, at least five."""
    schedule_block(*work)
    runs: list[Spent] = []
    gc.collect()
    while len(runs) < 5 or (sum(clock for clock, _ in runs) < least and len(runs) < 2000):
        runs.append(spent(lambda: schedule_block(*work)))
    return middle(runs)


# Seconds on the clock, and of the processor.
Spent = tuple[float, float]


def spent(work: Callable[[], object]) -> Spent:
    clock, processor = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - clock, time.process_time() - processor


def middle(runs: list[Spent]) -> Spent:
    clocks, processors = zip(*runs, strict=True)
    return statistics.median(clocks), statistics.median(processors)


def faces(id: str, tied: str = "") -> Block:
    """Five faces that hold each other, as one block of a session."""
    names = ("SMILE", "OPEN_MOUTH", "WIDEN_EYES", "LOWER_BROWS")
    body = f'<faceLexeme id="f0" lexeme="RAISE_BROWS" {tied}/>'
    for k, name in enumerate(names, 1):
        ends = f'start="f{k - 1}:attackPeak" end="f0:end + {k / 10}"'
        body += f'<faceLexeme id="f{k}" lexeme="{name}" {ends}/>'
    return block(body, id)


def session() -> tuple[Spent, Spent]:
    """To submit one block: around the 20th of a session and around the 2,000th."""
    player = Player(PlayOptions(idle=False))
    runs: list[Spent] = []
    for k in range(2041):
        one, now = faces(f"b{k}"), 4.0 * k
        runs.append(spent(lambda one=one, now=now: player.submit(one, now)))  # type: ignore[misc]
        player.due(now)
    return middle(runs[10:51]), middle(runs[1990:2041])


def added(chained: bool) -> Spent:
    """To submit a block that is tied to one of 50 that play, which are tied to each other or not."""
    runs: list[Spent] = []
    for _ in range(15):
        player = Player(PlayOptions(idle=False))
        for k in range(50):
            player.submit(faces(f"b{k}", f'start="b{k - 1}:f0:start + 0.05"' if chained and k else ""), 0.0)
        player.due(0.1)
        new = faces("new", 'start="b25:f0:end"')
        runs.append(spent(lambda player=player, new=new: player.submit(new, 0.1)))  # type: ignore[misc]
    return middle(runs)


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
    helped(__doc__)
    print(noise())
    print(f"{'work':40} {'median ms':>10} {'processor':>10} {'wanted ms':>10} {'dropped':>8}")

    def row(name: str, found: Spent, wanted: float | None, dropped: int = 0) -> None:
        under = "" if wanted is None else f"< {wanted:g}"
        print(f"{name:40} {found[0] * 1e3:10.3f} {found[1] * 1e3:10.3f} {under:>10} {dropped:8}")

    for name, make, wanted in TABLE:
        work = make()
        row(name, median(work), wanted, len(schedule_block(*work).warnings))
    early, late = session()
    row("20th block of a session", early, None)
    row("2,000th block of a session", late, None)
    print(f"{'2,000th over 20th':40} {late[0] / early[0]:10.2f} {late[1] / early[1]:10.2f} {'< 1.2':>10}")
    row("one added and tied to one of 50 blocks", added(chained=False), 5.0)
    row("one added to 50 that are tied in a chain", added(chained=True), None)
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
