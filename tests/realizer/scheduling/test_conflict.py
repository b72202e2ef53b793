"""Tests of conflicts and of the graph of equalities."""

import numpy as np
import pytest

from realizer.scheduling.conflict import (
    Conflict,
    ConstraintGraph,
    LengthBound,
    Link,
    choose,
    conflict_of,
    fault_warning,
    in_words,
    refusal,
    warning_of,
)
from realizer.scheduling.problem import ORIGIN, Part, Problem, Relation
from realizer.scheduling.timing import Timing
from tests.realizer.scheduling.recipes import lasting, schedule

CONSTRAINT = Part("c", "c", is_constraint=True)


def problem(*lengths: int) -> Problem:
    """Behaviours a, b, ... with so many gaps each."""
    made = Problem()
    for order, (name, gaps) in enumerate(zip("abcd", lengths, strict=False)):
        points = tuple(f"p{k}" for k in range(gaps + 1))
        timing = lasting(1.0) if gaps == 1 else Timing(points, np.ones(gaps), np.zeros(gaps), np.ones(gaps))
        made.add(Part(f"b1:{name}", name, order=order), timing, earliest=0.5)
    return made


def tie(problem: Problem, u: int, v: int) -> Relation:
    relation = Relation(u, v, 0.0, CONSTRAINT, (problem.name_of(u), "=", problem.name_of(v)))
    problem.equalities.append(relation)
    return relation


def test_loop_is_the_shortest_chain_and_the_equality_that_does_not_fit() -> None:
    made = problem(1, 1, 1)
    short = tie(made, 1, 3)
    for u, v in ((1, 5), (5, 3)):
        tie(made, u, v)
    last = tie(made, 3, 1)
    assert ConstraintGraph(made, contradicting=[3]).loop(3).relations == (short, last)


def test_cycle_connects_its_links_by_equalities() -> None:
    made = problem(1, 1)
    relations = [tie(made, 2, 3), tie(made, 4, 1)]
    found = ConstraintGraph(made).cycle([Link(1, 2, 1.0), Link(3, 4, 0.5)])
    assert found.relations == tuple(relations)
    assert [(gap.part.name, gap.seconds, gap.most) for gap in found.gaps] == [
        ("a", 1.0, False),
        ("b", 0.5, False),
    ]
    assert [part.name for part in found.parts] == ["c", "a", "b"]
    assert found.statements == 4


def test_cycle_joins_lengths_that_follow_each_other() -> None:
    made = problem(3)
    links = [Link(2, 3, 0.2), Link(3, 4, 0.3), Link(1, 2, 0.1)]
    (gap,) = ConstraintGraph(made).cycle(links).gaps
    assert (gap.begin, gap.end, round(gap.seconds, 9)) == ("p0", "p3", 0.6)


def test_cycle_joins_greatest_lengths_backwards() -> None:
    made = problem(3)
    (gap,) = ConstraintGraph(made).cycle([Link(4, 3, -0.3), Link(3, 2, -0.2)]).gaps
    assert (gap.begin, gap.end, gap.most) == ("p1", "p3", True)
    assert round(gap.seconds, 9) == 0.5


def test_conflict_of_has_the_bound_of_a_behaviour_that_starts_too_early() -> None:
    made = problem(1)
    pin = Relation(1, ORIGIN, 0.0, made.behaviours[0], ("a:start", "=", 0))
    found = conflict_of(made, [Link(ORIGIN, 1, 0.5), pin])
    assert found.relations == (pin,)
    assert found.earliest == (made.behaviours[0], "a:start", 0.5)
    assert (found.statements, [part.name for part in found.named]) == (2, ["a"])


def test_conflict_of_names_each_order_once() -> None:
    made = problem(1, 1)
    order = Relation(2, 3, 0.0, CONSTRAINT, ("b:start", "not before", "a:end"))
    link = Link(2, 3, 0.0, order)
    found = conflict_of(made, [link, link])
    assert found.relations == (order,)
    assert not found.gaps


def behaviour(name: str, **more: object) -> Part:
    return Part(f"b1:{name}", name, **more)  # type: ignore[arg-type]


def conflict(*parts: Part, gaps: tuple[LengthBound, ...] = (), named: tuple[Part, ...] = ()) -> Conflict:
    """A conflict of one equality of each part."""
    relations = [Relation(1, 2, 0.0, part, (f"{part.name}:start", "=", 1)) for part in parts]
    return Conflict(tuple(relations), gaps, None, named or parts)


def test_choose_takes_an_optional_constraint_before_any_behaviour() -> None:
    constraint = Part("c", "c", priority=9.0, is_constraint=True)
    assert choose(conflict(behaviour("a"), constraint, behaviour("b", order=1))) is constraint


def test_choose_takes_the_lowest_priority_then_the_later_behaviour() -> None:
    a, b, c = behaviour("a", priority=-1.0), behaviour("b", order=1), behaviour("c", order=2)
    assert choose(conflict(a, b, c)) is a
    assert choose(conflict(b, c)) is c


def test_choose_spares_what_is_required_or_only_referred_to() -> None:
    a, b, c = behaviour("a"), behaviour("b", order=1, required=True), behaviour("c", order=2)
    assert choose(conflict(a, b, named=(a, b, c))) is a
    assert choose(conflict(b, named=(b, c))) is c
    assert choose(conflict(b)) is None


@pytest.mark.parametrize(
    ("others", "reason"),
    [
        ([behaviour("b", priority=1.0)], "because its priority is the lowest"),
        ([behaviour("b")], "because it comes later"),
        ([behaviour("b", required=True)], "because everything else in this is required"),
        ([], "because nothing else has a part in this"),
    ],
)
def test_warning_of_gives_the_reason(others: list[Part], reason: str) -> None:
    dropped = behaviour("a", order=3)
    warning = warning_of(conflict(dropped, *others), dropped)
    assert (warning.id, warning.type) == ("b1:a", "IMPOSSIBLE_TO_SCHEDULE")
    assert warning.text.endswith(f"a was dropped {reason}")


def test_in_words_of_a_long_chain_counts_what_it_leaves_out() -> None:
    text = in_words(conflict(*(behaviour(f"n{k}") for k in range(40))).clauses)
    assert [k for k in range(40) if f"n{k}:start" in text] == list(range(29))
    assert text.endswith("n28:start = 1 and 11 more such things cannot all hold")
    assert "more" not in in_words(conflict(*(behaviour(f"n{k}") for k in range(30))).clauses)


def test_warning_of_names_a_constraint_with_its_id() -> None:
    constraint = Part("c", "c", line=4, is_constraint=True)
    text = warning_of(conflict(constraint), constraint).text
    assert text.startswith("constraint c cannot be kept: c:start = 1 (constraint c, line 4) cannot hold")


def test_in_words_counts_what_cannot_hold() -> None:
    a, b, c = (behaviour(name) for name in "abc")
    assert in_words(conflict(a).clauses) == "a:start = 1 cannot hold"
    assert in_words(conflict(a, b).clauses) == "a:start = 1 and b:start = 1 cannot both hold"
    assert in_words(conflict(a, b, c).clauses) == "a:start = 1, b:start = 1 and c:start = 1 cannot all hold"


@pytest.mark.parametrize(
    ("seconds", "most", "words"),
    [
        (0.15, False, "a takes at least 0.15 s from start to end"),
        (2.5, True, "a takes at most 2.5 s from start to end"),
        (0.0, False, "a:end is not before a:start"),
    ],
)
def test_in_words_of_a_gap(seconds: float, most: bool, words: str) -> None:
    gap = LengthBound(behaviour("a"), "start", "end", seconds, most)
    assert in_words(conflict(gaps=(gap,)).clauses) == f"{words} cannot hold"


def test_refusal_is_of_the_block() -> None:
    warning = refusal("b1", conflict(behaviour("a", required=True)))
    assert warning.id == "b1"
    assert warning.text == "a:start = 1 cannot hold, and all of this is required"


def test_fault_warning_has_the_line() -> None:
    assert fault_warning(behaviour("a", line=2), "s has no m1").text == "a was dropped (line 2): s has no m1"


def test_clauses_are_in_the_json_of_a_warning() -> None:
    body = (
        '<wait id="a" start="1"/>\n<wait id="b" start="2"/>\n'
        '<constraint id="same"><synchronize><sync ref="a:start"/><sync ref="b:start"/></synchronize>'
        "</constraint>"
    )
    found = schedule(body, {"a": lasting(1.0), "b": lasting(1.0)})
    (warning,) = found.to_json()["warnings"]
    assert warning["id"] == "b1:same"
    assert warning["type"] == "IMPOSSIBLE_TO_SCHEDULE"
    assert sorted(warning["clash"], key=lambda clause: clause["line"]) == [
        {"id": "b1:a", "line": 2, "text": "a:start = 1"},
        {"id": "b1:b", "line": 3, "text": "b:start = 2"},
        {"id": "b1:same", "line": 4, "text": "a:start = b:start"},
    ]
    for clause in warning["clash"]:
        assert clause["text"] in warning["text"]


def test_clauses_of_gaps_name_their_behaviours() -> None:
    body = '<faceLexeme id="a" lexeme="SMILE" end="0.5"/>\n<wait id="b" start="2" end="a:attackPeak"/>'
    found = schedule(body, {"a": lasting(1, 1, 1, least=0.3), "b": lasting(1.0)})
    (warning,) = found.warnings
    clauses = {(c.id, c.line, c.text) for c in warning.clash}
    assert ("b1:a", 2, "a:end = 0.5") in clauses
    assert all(id in ("b1:a", "b1:b") for id, _, _ in clauses)


def test_clauses_are_left_out_of_the_json_without_a_conflict() -> None:
    found = schedule('<wait id="a" start="b0:x:end"/>', {"a": lasting(1.0)})
    assert [set(w) for w in found.to_json()["warnings"]] == [{"id", "type", "text"}]


def test_refusal_has_the_clauses_of_the_conflict() -> None:
    body = '<required><wait id="a" start="b:end"/><wait id="b" start="a:end"/></required>'
    found = schedule(body, {"a": lasting(1.0), "b": lasting(1.0)})
    assert found.failed
    assert {clause.id for clause in found.warnings[0].clash} == {"b1:a", "b1:b"}
