"""Tests of blocks that are scheduled together."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import Block, parse
from realizer.scheduling import Member, Schedule, Timing, schedule_together
from tests.example_counts import examples
from tests.realizer.scheduling.recipes import schedule_block

FACE = ("start", "attackPeak", "relax", "end")

# Behaviour, sync point, tenths of a second after it.
Reference = tuple[int, str, int]
Faces = list[tuple[list[float], Reference | None, Reference | None]]


def block(id: str, body: str) -> Block:
    return parse(
        f'<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="{id}">{body}</bml>', strict=True
    )


def lasting(*preferred: float, least: float = 0.05, most: float | None = None) -> Timing:
    k = len(preferred)
    points = FACE if k == 3 else ("start", "end")
    bounds = None if most is None else np.full(k, most)
    return Timing(points, np.array(preferred), np.full(k, least), np.ones(k), most=bounds)


def member(block: Block, timings: dict[str, Timing], **more: object) -> Member:
    return Member(block, timings, **more)  # type: ignore[arg-type]


def running(plays: Schedule, block: Block, timings: dict[str, Timing], origin: float, now: float) -> Member:
    """Return a playing block as a new block that starts at `origin` sees it; both on one session clock."""
    passed = {
        name: {
            point: plays.start + float(time) - origin
            for point, time in zip(plays.points[name], times, strict=True)
            if plays.start + time <= now
        }
        for name, times in plays.times.items()
    }
    return Member(
        block,
        timings,
        start=plays.start - origin,
        earliest=max(plays.start, now) - origin,
        passed_times={name: when for name, when in passed.items() if when},
        is_fixed=True,
    )


# Faces that are tied to others before them, at one or both ends.
tied = st.lists(
    st.tuples(
        st.lists(st.integers(1, 12).map(lambda k: k / 10), min_size=3, max_size=3),
        st.none() | st.tuples(st.integers(0, 5), st.sampled_from(FACE), st.integers(-5, 5)),
        st.none() | st.tuples(st.integers(0, 5), st.sampled_from(FACE), st.integers(0, 20)),
    ),
    min_size=1,
    max_size=5,
)


def drawn(id: str, faces: Faces) -> tuple[Block, dict[str, Timing]]:
    body, timings = "", {}
    for k, (gaps, *ends) in enumerate(faces):
        refs = ""
        for point, ref in zip(("start", "end"), ends, strict=True):
            if ref is not None and k:
                number, sync, offset = ref
                refs += f' {point}="f{number % k}:{sync}{offset / 10:+g}"'
        body += f'<faceLexeme id="f{k}" lexeme="SMILE"{refs}/>'
        timings[f"f{k}"] = lasting(*gaps)
    return block(id, body), timings


def same(one: Schedule, other: Schedule) -> None:
    assert one.times.keys() == other.times.keys()
    for name in one.times:
        np.testing.assert_allclose(one.times[name], other.times[name], atol=1e-6, rtol=0)


@examples(1.5)
@given(tied, st.integers(0, 30).map(lambda k: k / 10), st.integers(1, 30).map(lambda k: k / 10))
def test_schedule_together_keeps_the_past_and_moves_the_future_after_now(
    faces: Faces, late: float, length: float
) -> None:
    """A wait of a new block is tied to the last face of a playing one."""
    first, timings = drawn("a", faces)
    plays = schedule_block(first, timings)
    if not plays.times:
        return
    last = list(plays.times)[-1]
    new = block("b", f'<wait id="w" start="0" end="a:{last}:end"/>')
    kept = {name: timings[name] for name in plays.times}
    others = [running(plays, first, kept, late, late)]
    found = schedule_together([member(new, {"w": lasting(length, least=0.0)}), *others])
    if found[0].failed or "w" not in found[0].times:
        assert plays.times[last][-1] <= late, "only what is over can be too early"
        return
    assert not found[1].warnings
    assert found[1].start == -late
    assert found[1].times.keys() == plays.times.keys()
    for name, before in plays.times.items():
        after, over = found[1].times[name], before <= late
        np.testing.assert_allclose(after[over], before[over], atol=1e-9)
        assert (after[~over] >= late - 1e-9).all()
        assert (np.diff(after) >= 0).all()
    if plays.times[last][-1] > late:
        assert found[1].at(last, "end") - late == pytest.approx(found[0].at("w", "end"), abs=1e-6)


@given(tied, tied, st.integers(0, 20).map(lambda k: k / 10))
def test_schedule_together_of_unrelated_blocks_is_as_alone(one: Faces, other: Faces, late: float) -> None:
    a, b = drawn("a", one), drawn("b", other)
    first, second = schedule_block(*a), schedule_block(*b)
    both = schedule_together(
        [member(*b), running(first, a[0], {n: a[1][n] for n in first.times}, late, late)]
    )
    same(both[0], second)
    same(both[1], first)
    assert both[0].warnings == second.warnings
    assert both[1].start == -late


@given(tied, st.integers(-50, 5000).map(lambda k: k / 10))
def test_schedule_together_does_not_depend_on_the_origin_of_the_clock(faces: Faces, origin: float) -> None:
    first, timings = drawn("a", faces)
    new = block("b", '<wait id="w" start="a:f0:end + 0.5"/>')
    here = schedule_together([member(new, {"w": lasting(1.0)}), member(first, timings)])
    there = schedule_together(
        [
            member(new, {"w": lasting(1.0)}, start=origin, earliest=origin),
            member(first, timings, start=origin, earliest=origin),
        ]
    )
    for one, other in zip(here, there, strict=True):
        same(one, other)


def test_schedule_together_stretches_both_blocks_equally() -> None:
    """Paul's figure 3.6 over two blocks: 3 s that play and 2 s that are new, tied at both ends."""
    first = block("a", '<wait id="w"/>')
    new = block("b", '<wait id="v" start="a:w:start" end="a:w:end"/>')
    found = schedule_together([member(new, {"v": lasting(2.0)}), member(first, {"w": lasting(3.0)})])
    assert found[0]["v"] == found[1]["w"] == pytest.approx({"start": 0.0, "end": 2.5})


def test_schedule_together_keeps_bounds_of_a_playing_block() -> None:
    first, timings = block("a", '<wait id="w"/>'), {"w": lasting(3.0, most=3.2)}
    plays = schedule_block(first, timings)
    new = block("b", '<wait id="v" start="0" end="a:w:end"/>')
    found = schedule_together(
        [member(new, {"v": lasting(9.0)}), running(plays, first, timings, origin=1.0, now=1.0)]
    )
    assert found[1]["w"] == pytest.approx({"start": 0.0, "end": 3.2}, abs=1e-9)
    assert found[0]["v"] == pytest.approx({"start": 0.0, "end": 2.2}, abs=1e-9)


def test_schedule_together_drops_the_new_behaviour_and_names_the_old_block() -> None:
    first, timings = block("a", '<wait id="w"/>'), {"w": lasting(3.0, most=3.2)}
    plays = schedule_block(first, timings)
    new = block("b", '<wait id="v" start="0" end="a:w:end"/><wait id="u"/>')
    voices = {"v": Timing(("start", "end"), np.array([9.0]), np.array([9.0]), np.ones(1), True)}
    found = schedule_together(
        [
            member(new, {**voices, "u": lasting(1.0)}),
            running(plays, first, timings, origin=1.0, now=1.0),
        ]
    )
    (warning,) = found[0].warnings
    assert warning.id == "b:v"
    assert "a:w takes at most 3.2 s from start to end" in warning.text
    assert "a:w:start = the time at which it passed" in warning.text
    assert {clause.id for clause in warning.clash} == {"a:w", "b:v"}
    same(found[1], plays)
    assert found[0]["u"] == {"start": 0.0, "end": 1.0}


def test_schedule_together_fails_the_new_block_alone() -> None:
    first, timings = block("a", '<wait id="w" start="0" end="3"/>'), {"w": lasting(3.0)}
    plays = schedule_block(first, timings)
    new = block(
        "b", '<required><wait id="v" start="0" end="a:w:end + 1"/></required><wait id="u" start="v:end"/>'
    )
    rigid = Timing(("start", "end"), np.array([9.0]), np.array([9.0]), np.ones(1), True)
    found = schedule_together(
        [member(new, {"v": rigid, "u": lasting(1.0)}), running(plays, first, timings, origin=1.0, now=1.0)]
    )
    assert [s.block for s in found] == ["b"]
    assert found[0].failed
    assert "all of this is required" in found[0].warnings[0].text


def late(seconds: float, body: str, timings: dict[str, Timing], grace: float = 0.5) -> Schedule:
    """Return the schedule of a block of which all references into other blocks passed some seconds ago."""
    new = member(block("new", body), timings)
    return schedule_together([new], outside=lambda ref: ref.offset - seconds, grace=grace)[0]


@given(st.floats(0.001, 0.5))
def test_schedule_together_keeps_the_lengths_of_what_is_late(seconds: float) -> None:
    body = '<wait id="a" start="old:w:end"/><wait id="b" start="a:end"/><wait id="c"/>'
    found = late(seconds, body, {name: lasting(1.0) for name in "abc"})
    assert found.at("a", "start") == pytest.approx(0.0, abs=1e-9)
    assert found.at("a", "end") == pytest.approx(1.0)
    assert found.at("b", "start") == pytest.approx(1.0)
    assert dict(found.late) == pytest.approx({"a": seconds, "b": seconds})
    assert not found.warnings


def test_schedule_together_drops_what_is_later_than_the_grace() -> None:
    found = late(0.62, '<wait id="a" start="old:w:end"/>', {"a": lasting(1.0)})
    assert not found.times
    assert not found.late
    assert "0.62 s too late, and the grace is 0.5 s" in found.warnings[0].text


def test_schedule_together_shortens_what_the_grace_does_not_hold() -> None:
    body = '<wait id="a" start="old:w:end"/><wait id="b" end="a:end"/>'
    found = late(0.1, body, {"a": lasting(1.0, least=1.0), "b": lasting(3.0)})
    assert found.at("a", "start") == pytest.approx(0.4)
    assert found.at("a", "end") == pytest.approx(found.at("b", "end"))
    assert found.at("b", "start") == pytest.approx(0.0, abs=1e-9)
    assert dict(found.late) == {"a": 0.5, "b": 0.5}
    assert not found.warnings


def test_schedule_together_delays_nothing_for_what_it_drops_as_too_late() -> None:
    body = """<wait id="a" start="old:w:end"/><wait id="b" end="old:w:end+9"/>
    <constraint><synchronize><sync ref="a:end"/><sync ref="b:start"/></synchronize></constraint>"""
    found = late(6.0, body, {"a": lasting(1.0, least=1.0), "b": lasting(1.0)})
    assert found.at("b", "end") == pytest.approx(3.0)
    assert not found.late
    assert [w.id for w in found.warnings] == ["new:a"]


def test_schedule_together_delays_what_a_constraint_ties_together() -> None:
    body = """<wait id="a"/><wait id="b"/><constraint><synchronize>
    <sync ref="old:w:end"/><sync ref="a:start"/><sync ref="b:start+0.1"/></synchronize></constraint>"""
    found = late(0.1, body, {"a": lasting(1.0), "b": lasting(1.0)})
    assert [found.at(name, "start") for name in "ab"] == pytest.approx([0.1, 0.0], abs=1e-9)
    assert dict(found.late) == pytest.approx({"a": 0.2, "b": 0.2})


@given(st.floats(0.001, 0.2), st.sampled_from([("start", 0.0), ("end", 0.3)]))
def test_schedule_together_starts_what_had_to_be_before_at_once(
    seconds: float, point: tuple[str, float]
) -> None:
    body = f"""<wait id="a"/><wait id="b"/><wait id="c"/><constraint><before ref="old:w:end">
    <sync ref="a:{point[0]}"/></before><before ref="a:start"><sync ref="b:end"/></before></constraint>"""
    found = late(seconds, body, {"a": lasting(0.3), "b": lasting(0.2), "c": lasting(1.0)}, grace=1.0)
    assert [found.at(name, "start") for name in "bac"] == pytest.approx([0.0, 0.2, 0.0], abs=1e-9)
    by = seconds + point[1] + 0.2  # all that a constraint names is equally late
    assert dict(found.late) == pytest.approx({"a": by, "b": by})
    assert not found.warnings


def test_schedule_together_drops_what_is_late_without_grace() -> None:
    found = late(0.01, '<wait id="a" start="old:w:end"/>', {"a": lasting(1.0)}, grace=0.0)
    assert not found.times


def test_schedule_together_moves_late_constraints_too() -> None:
    body = """<wait id="a"/><wait id="b"/><constraint>
    <synchronize><sync ref="a:end"/><sync ref="old:w:end"/></synchronize>
    <synchronize><sync ref="a:start"/><sync ref="b:start"/></synchronize></constraint>"""
    found = late(-0.9, body, {"a": lasting(1.0, least=1.0), "b": lasting(1.0)})
    assert found.at("a", "start") == found.at("b", "start") == pytest.approx(0.0, abs=1e-9)
    assert dict(found.late) == pytest.approx({"a": 0.1, "b": 0.1})


def test_schedule_together_keeps_a_late_block_late_when_it_is_solved_again() -> None:
    own = block("old", '<wait id="a" start="x:y:end"/>')
    plays = member(own, {"a": lasting(1.0)}, start=0.0, is_fixed=True, late={"a": 0.2})
    new = member(block("new", '<wait id="w" start="old:a:end"/>'), {"w": lasting(1.0)})
    found = schedule_together([new, plays], outside=lambda ref: -0.2)
    assert [s.at(name, "start") for s, name in zip(found, "wa", strict=True)] == pytest.approx([1.0, 0.0])


@pytest.mark.parametrize(
    ("sequence", "times"),
    [
        (("a", "b"), {"a": 0.0, "b": 1.0}),
        ((0.7, "b"), {"a": 0.0, "b": 0.7}),
        (("a", 0.4), {"b": 0.0}),
        (("a", "nobody"), {"a": 0.0, "b": 0.0}),
    ],
)
def test_schedule_together_places_sequences_one_after_the_other(
    sequence: tuple[str | float, str | float], times: dict[str, float]
) -> None:
    timings = {name: lasting(1.0, least=1.0) for name in "ab"}
    new = member(block("new", '<wait id="a"/><wait id="b"/>'), timings, sequences=(sequence,))
    found = schedule_together([new])[0]
    assert {name: found.at(name, "start") for name in found.times} == pytest.approx(times)
