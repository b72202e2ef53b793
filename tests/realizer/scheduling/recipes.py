"""Random problems as plain numbers, which can be built in any order and shrink well."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from hypothesis import strategies as st

from bml_schema import Block, parse
from realizer.core.array_types import Float64
from realizer.scheduling import Member, Schedule, Timing, schedule_together
from realizer.scheduling.problem import ORIGIN, Part, Problem, Relation

# (behaviour, point), modulo their numbers.
Spot = tuple[int, int]


def schedule_block(
    block: Block, timings: Mapping[str, Timing], *, outside: Any = lambda ref: None, **fields: Any
) -> Schedule:
    """Return the schedule of a block on its own."""
    return schedule_together([Member(block, timings, **fields)], outside=outside)[0]


class Body(NamedTuple):
    """A behaviour; the stiffness of its gaps increases from the first to the last."""

    gaps: list[float]
    least: float
    stiffness: float
    rigid: bool
    most: float | None


class Recipe(NamedTuple):
    """`equalities`: first = second + seconds. `orders`: second >= first + seconds. `pins`: spot = seconds."""

    bodies: list[Body]
    equalities: list[tuple[Spot, Spot, float]]
    orders: list[tuple[Spot, Spot, float]]
    pins: list[tuple[Spot, float]]


MOST_BODIES = 6
spots = st.tuples(st.integers(0, MOST_BODIES - 1), st.integers(0, 3))
tenths = st.integers(0, 20).map(lambda k: k / 10)
lengths = st.lists(st.integers(1, 20).map(lambda k: k / 10), min_size=1, max_size=3)
bodies = st.builds(
    Body,
    lengths,
    st.sampled_from([0.0, 0.05, 0.1]),
    st.sampled_from([0.5, 1.0, 4.0]),
    st.booleans(),
    st.sampled_from([None, None, 0.5, 1.5]),
)
ties = st.tuples(spots, spots, st.integers(-10, 10).map(lambda k: k / 10))
# Most of these have no solution.
wild = st.builds(
    Recipe,
    st.lists(bodies, min_size=1, max_size=MOST_BODIES),
    st.lists(ties, max_size=5),
    st.lists(ties, max_size=5),
    st.lists(st.tuples(spots, tenths), max_size=2),
)


@st.composite
def possible(draw: st.DrawFn, stiffness: tuple[float, ...] = (0.5, 1.0, 4.0)) -> Recipe:
    """Problems that have a solution, because all relations are true of times that are drawn first."""
    number = st.integers(0, 20)
    count = draw(st.integers(1, MOST_BODIES))
    made, when = [], []
    for _ in range(count):
        true = draw(st.lists(number, min_size=1, max_size=3))
        # Tenths are made from integers, so that sums do not depend on their order.
        rigid, free = draw(st.booleans()), draw(st.booleans())
        wished = true if rigid else draw(st.lists(number, min_size=len(true), max_size=len(true)))
        least = draw(st.integers(0, min(true)))
        most = None if free else max(true) + draw(st.integers(0, 3))
        made.append(
            Body(
                [k / 10 for k in wished],
                least / 10,
                draw(st.sampled_from(stiffness)),
                rigid,
                None if most is None else most / 10,
            )
        )
        when.append(np.cumsum([draw(number), *true]).tolist())

    def true_at(spot: Spot) -> int:
        times = when[spot[0] % count]
        return int(times[spot[1] % len(times)])

    pairs = st.lists(st.tuples(spots, spots), max_size=5)
    slack = st.sampled_from([0, 0, 1, 5, 20])
    return Recipe(
        made,
        [(u, v, (true_at(u) - true_at(v)) / 10) for u, v in draw(pairs)],
        [(u, v, (true_at(v) - true_at(u) - draw(slack)) / 10) for u, v in draw(pairs)],
        [(u, true_at(u) / 10) for u in draw(st.lists(spots, max_size=2))],
    )


def point(problem: Problem, spot: Spot) -> int:
    b = spot[0] % len(problem.first)
    return problem.first[b] + spot[1] % len(problem.timings[b].points)


def built(
    recipe: Recipe, order: list[int] | None = None, *, earliest: float = 0.0, late: float = 0.0
) -> Problem:
    """Return the problem of a recipe; with `order` its behaviours in that order and its relations reversed.

    `late`: all fixed times are later by this.
    """
    places = list(range(len(recipe.bodies))) if order is None else order
    problem = Problem()
    for b in places:
        gaps, least, stiffness, rigid, most = recipe.bodies[b]
        k = len(gaps)
        timing = Timing(
            tuple(f"p{i}" for i in range(k + 1)),
            np.array(gaps),
            np.full(k, least),
            stiffness * np.arange(1.0, k + 1.0),
            rigid,
            None if most is None else np.full(k, max(most, least)),
        )
        problem.add(Part(f"block:{b}", f"b{b}", order=b), timing, earliest + late)
    number = {b: k for k, b in enumerate(places)}

    def at(spot: Spot) -> int:
        return point(problem, (number[spot[0] % len(places)], spot[1]))

    part = Part("block", "", is_constraint=True, required=True)
    for u, v, seconds in recipe.equalities:
        problem.equalities.append(Relation(at(u), at(v), seconds, part, (f"{u}", "=", f"{v} + {seconds}")))
    for u, v, seconds in recipe.orders:
        says = (f"{v}", "not before", f"{u} + {seconds}")
        problem.orders.append(Relation(at(u), at(v), seconds, part, says))
    for u, seconds in recipe.pins:
        problem.equalities.append(Relation(at(u), ORIGIN, seconds + late, part, (f"{u}", "=", f"{seconds}")))
    if order is not None:
        problem.equalities.reverse()
        problem.orders.reverse()
    return problem


class Span(NamedTuple):
    """One gap of a behaviour that is not rigid, from `point` to the next."""

    point: int
    wanted: float
    least: float
    most: float
    stiffness: float


def spans(problem: Problem) -> Iterator[Span]:
    for first, t in zip(problem.first, problem.timings, strict=True):
        for i in range(0 if t.rigid else len(t.preferred)):
            most = np.inf if t.most is None else t.most[i]
            yield Span(first + i, t.preferred[i], t.least[i], most, t.stiffness[i])


def cost_of(problem: Problem, time: Float64) -> float:
    return float(
        sum(s.stiffness * (time[s.point + 1] - time[s.point] - s.wanted) ** 2 for s in spans(problem))
    )


def slope_of(problem: Problem, time: Float64) -> Float64:
    """Return the derivative of the cost by each point's time."""
    slope = np.zeros(len(problem.owner))
    for s in spans(problem):
        force = 2 * s.stiffness * (time[s.point + 1] - time[s.point] - s.wanted)
        slope[s.point + 1] += force
        slope[s.point] -= force
    return slope


def check_kept(problem: Problem, time: Float64, within: float = 1e-6) -> None:
    """Check all equalities, orders and bounds."""
    for u, v, seconds, _, _ in problem.equalities:
        assert abs(time[u] - time[v] - seconds) <= within
    for u, v, seconds, _, _ in problem.orders:
        assert time[v] - time[u] >= seconds - within
    for s in spans(problem):
        assert time[s.point + 1] >= time[s.point]
        assert time[s.point + 1] <= time[s.point] + s.most + within
    for first, earliest in zip(problem.first, problem.earliest, strict=True):
        assert time[first] >= earliest


def linear(problem: Problem) -> tuple[Float64, Float64, Float64, Float64]:
    """Return (A, b, C, d): A t = b and C t >= d for the times of all points."""
    n = len(problem.owner)

    def row(plus: int, minus: int) -> Float64:
        line = np.zeros(n)
        line[plus] += 1
        line[minus] -= 1
        return line

    start = np.zeros(n)
    start[ORIGIN] = 1
    equal = [(start, 0.0), *((row(u, v), s) for u, v, s, _, _ in problem.equalities)]
    more = [(row(v, u), s) for u, v, s, _, _ in problem.orders]
    for s in spans(problem):
        more.append((row(s.point + 1, s.point), s.least))
        if s.most < np.inf:
            more.append((row(s.point, s.point + 1), -s.most))
    more += [(row(first, ORIGIN), e) for first, e in zip(problem.first, problem.earliest, strict=True)]
    rows: list[Any] = [*zip(*equal, strict=True), *zip(*more, strict=True)]
    matrix, right, lower, bound = (np.array(column) for column in rows)
    return matrix, right, lower, bound


FACE = ("start", "attackPeak", "relax", "end")


def schedule(body: str, timings: dict[str, Timing], **more: object) -> Schedule:
    """Return the schedule of a block; its first behaviour is on line 2."""
    text = f'<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="b1">\n{body}</bml>'
    return schedule_block(parse(text, strict=True), timings, **more)  # type: ignore[arg-type]


def lasting(*preferred: float, least: float = 0.02) -> Timing:
    points = FACE if len(preferred) == 3 else ("start", "end")
    return Timing(points, np.array(preferred), np.full(len(preferred), least), np.ones(len(preferred)))
