"""Laws of the scheduling of random documents."""

from collections.abc import Collection, Iterable
from random import Random
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from bml_schema import parse
from realizer.scheduling import Schedule, Timing
from tests.realizer.scheduling.recipes import schedule_block

WAITS = 6


class Document(NamedTuple):
    """`waits`: name -> element. `orders`: id -> constraint. `timings`: of the waits."""

    waits: dict[str, str]
    orders: dict[str, str]
    timings: dict[str, Timing]

    def schedule(
        self, names: Iterable[str] | None = None, without: Collection[str] = (), **more: float
    ) -> Schedule:
        """Return the schedule of all elements or the named ones, in that order, as if some were absent."""
        nodes = self.waits | self.orders
        chosen = [name for name in (names or nodes) if name in self.waits or name not in without]
        body = "\n".join(nodes[name] for name in chosen)
        text = f'<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="b1">\n{body}\n</bml>'
        present = {name: t for name, t in self.timings.items() if name not in without}
        return schedule_block(parse(text, strict=True), present, **more)  # type: ignore[arg-type]


syncs = st.sampled_from(["start", "end"])
numbers = st.integers(-2, 30).map(lambda k: f"{k / 10:g}")
points = st.builds(
    lambda b, p, k: f"w{b}:{p}{k / 10:+g}", st.integers(0, WAITS - 1), syncs, st.integers(-9, 9).filter(bool)
)


def written(point: str, tenths: int) -> str:
    return f"{point}{tenths / 10:+g}" if tenths else point


@st.composite
def documents(draw: st.DrawFn, fixed: bool = True) -> Document:
    """`fixed`: with numbers as references too."""
    anything = numbers | points if fixed else points
    waits, timings = {}, {}
    for k in range(WAITS):
        ends = {sync: draw(st.none() | anything) for sync in ("start", "end")}
        tied = "".join(f' {sync}="{ref}"' for sync, ref in ends.items() if ref is not None)
        waits[f"w{k}"] = f'<wait id="w{k}"{tied}/>'
        length = np.array([draw(st.integers(1, 20)) / 10])
        timings[f"w{k}"] = Timing(("start", "end"), length, np.array([0.02]), np.ones(1))
    orders = {}
    for k in range(draw(st.integers(0, 3))):
        tag, ref, sync = draw(st.sampled_from(["before", "after"])), draw(anything), draw(anything)
        orders[f"c{k}"] = (
            f'<constraint id="c{k}"><{tag} ref="{ref}"><sync ref="{sync}"/></{tag}></constraint>'
        )
    return Document(waits, orders, timings)


@st.composite
def possible(draw: st.DrawFn) -> Document:
    """Draw a document without conflicts: all relations are true of times that are drawn first."""
    when = {}
    for k in range(WAITS):
        start = draw(st.integers(0, 20))
        when[f"w{k}:start"], when[f"w{k}:end"] = start, start + draw(st.integers(1, 20))
    anywhere, slacks = st.sampled_from(sorted(when)), st.sampled_from([0, 0, 2, 9])

    def beside(time: int) -> str:
        """Return a reference to a point in time, which may be a number."""
        point = draw(st.none() | anywhere)
        return f"{time / 10:g}" if point is None else written(point, time - when[point])

    waits, timings = {}, {}
    for k in range(WAITS):
        ends = {sync: beside(when[f"w{k}:{sync}"]) for sync in ("start", "end") if draw(st.booleans())}
        tied = "".join(f' {sync}="{ref}"' for sync, ref in ends.items())
        waits[f"w{k}"] = f'<wait id="w{k}"{tied}/>'
        length = np.array([draw(st.integers(1, 20)) / 10])
        timings[f"w{k}"] = Timing(("start", "end"), length, np.array([0.02]), np.ones(1))
    orders = {}
    for k in range(draw(st.integers(0, 4))):
        tag, point, slack = draw(st.sampled_from(["before", "after"])), draw(anywhere), draw(slacks)
        late = slack if tag == "after" else -slack
        if draw(st.booleans()):
            ref, sync = f"{(when[point] - late) / 10:g}", point
        else:
            ref = draw(anywhere)
            sync = written(point, when[ref] - when[point] + late)
        orders[f"c{k}"] = (
            f'<constraint id="c{k}"><{tag} ref="{ref}"><sync ref="{sync}"/></{tag}></constraint>'
        )
    return Document(waits, orders, timings)


def check_same(one: Schedule, other: Schedule) -> None:
    assert one.times.keys() == other.times.keys()
    for name in one.times:
        np.testing.assert_allclose(one.times[name], other.times[name], atol=1e-6, rtol=0)


@given(documents())
def test_schedule_block_leaves_no_trace_of_dropped_parts(document: Document) -> None:
    """The rest has the same times as in a document without the dropped parts."""
    found = document.schedule()
    assume(found.warnings and not found.released)
    gone = {w.id.removeprefix("b1:") for w in found.warnings}
    again = document.schedule(without=gone)
    assert not again.warnings
    assert found.times.keys() == document.waits.keys() - gone
    check_same(again, found)
    assert again.cost == pytest.approx(found.cost, abs=1e-6)


@given(possible(), st.randoms(use_true_random=False))
def test_schedule_block_does_not_depend_on_the_order_of_elements(document: Document, chance: Random) -> None:
    found = document.schedule()
    names = [*document.waits, *document.orders]
    chance.shuffle(names)
    again = document.schedule(names)
    assert not found.warnings
    assert not again.warnings
    check_same(again, found)


@given(documents(fixed=False), st.integers(0, 500).map(lambda k: k / 10))
def test_schedule_block_moves_with_the_earliest_start(document: Document, earliest: float) -> None:
    found = document.schedule()
    later = document.schedule(earliest=earliest)
    assert [w.id for w in later.warnings] == [w.id for w in found.warnings]
    for name in found.times:
        np.testing.assert_allclose(later.times[name], found.times[name] + earliest, atol=1e-6, rtol=0)
