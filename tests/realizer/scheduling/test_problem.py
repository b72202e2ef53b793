"""Tests of the scheduling problem of blocks."""

import numpy as np
import pytest

from bml_schema import Block, SyncRef, parse
from realizer.scheduling.problem import ORIGIN, Member, Part, Problem, problem_of
from realizer.scheduling.timing import Timing
from tests.realizer.scheduling.recipes import lasting

RIGID = Timing(("start", "m", "end"), np.array([0.5, 1.5]), np.zeros(2), np.ones(2), rigid=True)


def block(body: str, id: str = "b1") -> Block:
    return parse(
        f'<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="{id}">{body}</bml>', strict=True
    )


def waits(body: str, id: str = "b1", **more: object) -> Member:
    """A block of waits of a second."""
    own = block(body, id)
    return Member(own, {b.id: lasting(1.0) for b in own.behaviours}, **more)  # type: ignore[arg-type]


def said(problem: Problem) -> list[str]:
    return [f"{problem.name_of(r.u)} = {problem.name_of(r.v)} + {r.seconds:g}" for r in problem.equalities]


def test_problem_add_ties_the_points_of_a_rigid_behaviour() -> None:
    problem = Problem()
    assert problem.add(Part("b1:w", "w"), lasting(1.0)) == 1
    assert problem.add(Part("b1:s", "s"), RIGID) == 3
    assert said(problem) == ["s:m = s:start + 0.5", "s:end = s:start + 2"]
    assert problem.owner == [-1, 0, 0, 1, 1, 1]


def test_problem_name_of_the_origin_is_the_start_of_the_block() -> None:
    assert Problem().name_of(ORIGIN) == "bml:start"


def test_problem_without_a_behaviour_renumbers_the_rest() -> None:
    body = '<wait id="a" start="1"/><wait id="b" start="a:end"/><wait id="c" start="2"/>'
    body += '<constraint id="k"><before ref="c:end"><sync ref="a:start"/></before></constraint>'
    problem = problem_of([waits(body)])
    smaller = problem.without([problem.behaviours[0]])
    assert [part.name for part in smaller.behaviours] == ["b", "c"]
    assert said(smaller) == ["c:start = bml:start + 2"]
    assert not smaller.orders, "the constraint named it"
    assert smaller.first == [1, 3]


def test_problem_without_a_rigid_behaviour_ties_the_others_once() -> None:
    problem = Problem()
    for name in "ab":
        problem.add(Part(f"b1:{name}", name), RIGID)
    assert len(problem.without([problem.behaviours[0]]).equalities) == 2


@pytest.mark.parametrize(
    ("ref", "relation"),
    [
        ("2.5", "b:start = bml:start + 2.5"),
        ("bml:start + 1", "b:start = bml:start + 1"),
        ("a:end - 0.5", "b:start = a:end + -0.5"),
        ("other:x:end + 1", "b:start = bml:start + 8"),
    ],
)
def test_problem_of_reads_references(ref: str, relation: str) -> None:
    problem = problem_of([waits(f'<wait id="a"/><wait id="b" start="{ref}"/>')], lambda ref: 7.0 + ref.offset)
    assert said(problem) == [relation]


def test_problem_of_ignores_references_to_absent_behaviours() -> None:
    member = waits('<wait id="a" start="gone:end"/><wait id="gone"/>')
    problem = problem_of([Member(member.block, {"a": lasting(1.0)})])
    assert not problem.equalities
    assert not problem.faults


def test_problem_of_reports_unknown_points_as_faults() -> None:
    problem = problem_of(
        [waits('<wait id="a" start="other:x:end"/><head id="h" lexeme="NOD" stroke="a:end"/>')]
    )
    assert [(part.name, text) for part, text in problem.faults] == [
        ("a", "other:x:end is not known here, or its time is not known yet"),
        ("h", "h has no stroke, only start, end"),
    ]


def test_problem_of_constraints_has_orders_and_equalities() -> None:
    body = '<wait id="a"/><wait id="b"/><constraint id="k">'
    body += '<before ref="a:end + 2"><sync ref="b:start"/></before>'
    body += '<after ref="a:start"><sync ref="b:end"/></after>'
    body += '<synchronize><sync ref="a:end"/><sync ref="b:end + 1"/></synchronize></constraint>'
    problem = problem_of([waits(body)])
    orders = [(problem.name_of(r.u), problem.name_of(r.v), r.seconds) for r in problem.orders]
    assert orders == [("b:start", "a:end", -2.0), ("a:start", "b:end", 0.0)]
    assert said(problem) == ["b:end = a:end + -1"]
    assert all(r.part.is_constraint and r.part.names == {"b1:a", "b1:b"} for r in problem.orders)


def test_problem_of_several_blocks_is_on_the_clock_of_the_first() -> None:
    plays = waits(
        '<wait id="w"/>', "old", start=-3.0, earliest=0.5, passed_times={"w": {"start": -3.0}}, is_fixed=True
    )
    problem = problem_of([waits('<wait id="v" start="old:w:end"/>', "new"), plays])
    assert [part.name for part in problem.behaviours] == ["v", "old:w"]
    assert [part.required for part in problem.behaviours] == [False, True]
    assert said(problem) == ["v:start = old:w:end + 0", "old:w:start = bml:start + -3"]
    assert [(r.u, problem.name_of(r.v), r.seconds) for r in problem.orders] == [(ORIGIN, "old:w:end", 0.5)]
    assert problem.earliest == [0.0, -np.inf]


def test_problem_of_passes_references_into_other_blocks_on() -> None:
    asked: list[SyncRef] = []
    problem_of([waits('<wait id="a" start="x:y:end + 2"/>')], lambda ref: asked.append(ref) or 0.0)
    assert [str(ref) for ref in asked] == ["x:y:end + 2"]
