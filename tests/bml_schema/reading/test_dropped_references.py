"""Tests of the removal of behaviours and of the references to them."""

from hypothesis import given
from hypothesis import strategies as st

from bml_schema import (
    Block,
    Constraint,
    Problem,
    Required,
    Speech,
    SpeechText,
    Sync,
    SyncRef,
    Wait,
    parse,
    without,
    write,
)
from bml_schema.reading.dropped_references import ReferenceRemover, without_references
from tests.strategies import blocks


def only(inside: str) -> Block:
    return parse(f"<bml id='b'>{inside}</bml>")


BAD = "<wait id='bad' duration='x'/>"


def test_dropped_references_vanish_and_are_listed() -> None:
    block = only(f"<wait id='a' start='bad:end+1' end='9'/>{BAD}<wait id='c' end='bad:start'/>")
    assert block["a"] == Wait(id="a", syncs={"end": SyncRef(offset=9.0)})
    assert block["c"] == Wait(id="c")
    (problem,) = block.problems
    assert problem.id == "b:bad"
    assert problem.lost_references == ("a:start", "c:end")
    assert problem.text.endswith("; with it went a:start, c:end")
    assert not problem.fatal


def test_dropped_references_of_syncs_in_speech_leave_the_sync() -> None:
    block = only(
        f"{BAD}<speech id='s'><text>a<sync id='m' ref='bad:end'/>b<sync id='n' ref='1'/></text></speech>"
    )
    speech = block["s"]
    assert isinstance(speech, Speech)
    assert speech.text is not None
    assert speech.text.parts == ("a", Sync(id="m"), "b", Sync(id="n", ref=SyncRef(offset=1.0)))
    assert block.problems[0].lost_references == ("s:m",)


def test_dropped_references_drop_whole_constraints() -> None:
    block = only(
        f"{BAD}<wait id='a'/><constraint id='c'><synchronize><sync ref='a:end'/><sync ref='2'/></synchronize>"
        "<before ref='bad:end'><sync ref='a:end'/></before></constraint>"
        "<constraint><after ref='a:end'><sync ref='bad:start'/></after></constraint>"
        "<constraint id='kept'><after ref='1'><sync ref='a:start'/></after></constraint>"
    )
    assert [c.id for c in block.constraints] == ["kept"]
    assert [p.lost_references for p in block.problems] == [("c", "/bml/constraint[2]")]


def test_dropped_references_of_a_required_constraint_are_fatal() -> None:
    synchronize = "<synchronize><sync ref='bad:end'/><sync ref='2'/></synchronize>"
    block = only(f"{BAD}<required><constraint>{synchronize}</constraint></required>")
    assert [p.fatal for p in block.problems] == [True]


def test_dropped_references_in_a_chain_have_a_problem_each() -> None:
    block = only("<wait id='a' start='nobody:end'/><wait id='c' start='a:end'/><wait id='d' start='c:end'/>")
    assert [p.id for p in block.problems] == ["b:a"]
    assert block.problems[0].lost_references == ("c:start",)
    assert [x.id for x in block.behaviours] == ["c", "d"]


def test_dropped_references_to_an_unsupported_element_vanish() -> None:
    block = only("<blink id='x'/><wait id='a' start='x:middle'/>")
    assert [(p.id, p.type, p.lost_references) for p in block.problems] == [
        ("b:x", "BEHAVIOR_TYPE_NOT_SUPPORTED", ("a:start",))
    ]


def test_dropped_references_are_counted_in_the_text_and_all_listed() -> None:
    waits = "".join(f"<wait id='w{i}' start='bad:end'/>" for i in range(30))
    problem: Problem = only(BAD + waits).problems[0]
    assert len(problem.lost_references) == 30
    assert problem.text.endswith("w9:start and 20 more")


def test_without_returns_unaffected_nodes_unchanged() -> None:
    losses = ReferenceRemover({"gone"})
    node = Wait(id="a", syncs={"start": SyncRef(behaviour="here", sync="end")})
    other = Wait(id="a", syncs={"start": SyncRef(block="x", behaviour="gone", sync="end")})
    assert losses.without(node) is node
    assert losses.without(other) is other
    assert not losses.lost_references


def test_without_returns_the_rest_of_a_block_and_the_lost_references() -> None:
    synchronize = "<synchronize><sync ref='a:end'/><sync ref='2'/></synchronize>"
    block = only(
        f"<wait id='a'/><wait id='c' start='a:end+1' end='9'/><constraint id='k'>{synchronize}</constraint>"
        "<required><wait id='d' start='c:end' end='a:end'/></required>"
    )
    left, lost, fatal = without(block, ["a"])
    assert left.children == (
        Wait(id="c", syncs={"end": SyncRef(offset=9.0)}),
        Required(children=(Wait(id="d", syncs={"start": SyncRef(behaviour="c", sync="end")}),)),
    )
    assert [b.id for b in left.behaviours] == ["c", "d"]
    assert lost == {"a": ("c:start", "k", "d:end")}
    assert not fatal
    assert left.places == block.places


def test_without_reports_ids_that_a_required_constraint_names() -> None:
    before = "<before ref='a:end'><sync ref='c:end'/></before>"
    block = only(f"<wait id='a'/><wait id='c'/><required><constraint>{before}</constraint></required>")
    left, lost, fatal = without(block, {"a"})
    assert left.children == (Wait(id="c"), Required())
    assert lost == {"a": ("/bml/required[1]/constraint[1]",)}
    assert fatal == {"a"}
    # In a block made by code, a constraint is required by its position.
    made = Block(
        id="b", children=(Wait(id="a"), Required(children=(Constraint(parts=block.constraints[0].parts),)))
    )
    assert without(made, {"a"}).fatal == {"a"}


@given(blocks(), st.data())
def test_without_leaves_a_sound_document(block: Block, data: st.DataObject) -> None:
    ids = [b.id for b in block.behaviours]
    gone = data.draw(st.sets(st.sampled_from(ids)) if ids else st.just(set()))
    left = without(block, gone).block
    assert [b.id for b in left.behaviours] == [id for id in ids if id not in gone]
    back = parse(write(left))
    assert not back.problems
    assert back == left
    assert without(block, ()) == (block, {}, frozenset())


def test_dropped_references_leave_the_language_of_a_text() -> None:
    block = only(f"{BAD}<speech id='s'><text xml:lang='nl'>a<sync id='m' ref='bad:end'/></text></speech>")
    speech = block["s"]
    assert isinstance(speech, Speech)
    assert speech.text == SpeechText(parts=("a", Sync(id="m")), language="nl")


def test_without_references_removes_those_of_some_points() -> None:
    block = only(
        "<wait id='w' start='1' end='3'/>"
        "<constraint><before ref='w:end'><sync ref='w:start'/></before></constraint>"
        "<speech id='s' start='w:end'><text>a <sync id='m' ref='4'/>b</text></speech>"
    )
    assert without_references(block, ()) is block
    rest = without_references(block, {"w:end", "s:m"})
    assert list(rest["w"].syncs) == ["start"]
    assert [point for point, _ in rest["s"].references] == ["start"]
    assert len(rest.constraints) == 1
