"""Tests of the reader of one element."""

from __future__ import annotations

import pytest

from bml_schema import (
    After,
    Before,
    Block,
    Constraint,
    Description,
    Place,
    Synchronize,
    SyncRef,
    parse,
    write,
)

SSML = "http://www.w3.org/2001/10/synthesis"


def only(inside: str) -> Block:
    return parse(f"<bml id='b'>{inside}</bml>")


def described(description: str) -> Block:
    return only(f"<head id='h' lexeme='NOD'>{description}</head>")


def test_description_of_any_type_is_kept_as_text() -> None:
    block = described(
        '<description priority="1" type="x/y"> a &lt; <q xmlns="urn:q" k="1"><r/></q> b </description>'
    )
    content = ' a &lt; <q xmlns="urn:q" k="1"><r/></q> b '
    assert block["h"].descriptions == (Description(priority=1, type="x/y", content=content),)
    assert parse(write(block)) == block


def test_description_of_ssml_is_exactly_the_speak_element() -> None:
    inside = f'\n <speak xmlns="{SSML}">Hi <mark name="m"/></speak>\n'
    block = described(f'<description priority="1" type="application/ssml+xml">{inside}</description>')
    assert block["h"].descriptions[0].content == f'<speak xmlns="{SSML}">Hi <mark name="m"/></speak>'


@pytest.mark.parametrize(
    ("description", "said"),
    [
        ("<description type='x'/>", "priority: wanted a whole number"),
        ("<description priority='1'/>", "type: wanted a word, got none"),
        ("<description priority='high' type='x'/>", 'got "high"'),
        ("<description priority='1' type='application/ssml+xml'>Hi</description>", "wanted one <speak>"),
    ],
)
def test_description_with_a_fault_drops_the_behaviour(description: str, said: str) -> None:
    block = described(description)
    assert not block.behaviours
    assert [p.id for p in block.problems] == ["b:h"]
    assert said in block.problems[0].text
    assert block.problems[0].path == "/bml/head[1]/description[1]"


def test_description_without_namespace_stays_without() -> None:
    block = described("<description priority='1' type='x'><q/></description>")
    assert parse(write(block)) == block
    assert block["h"].descriptions[0].content == "<q/>"


def test_unknown_children_of_other_languages_are_no_fault() -> None:
    block = only("<head id='h' lexeme='NOD'><q:parameter xmlns:q='urn:q'/></head>")
    assert not block.problems
    assert [b.id for b in block.behaviours] == ["h"]


def test_children_of_ours_in_the_wrong_place_are_a_fault() -> None:
    block = only("<head id='h' lexeme='NOD'><stance type='LYING'/></head>")
    assert block.problems[0].text == "wanted <description>, got <stance>"


CONSTRAINT = """<wait id='a'/><wait id='b'/>
<constraint id='c'>
  <synchronize><sync ref='a:end'/><sync ref='b:start + 1'/><sync ref='2'/></synchronize>
  <before ref='a:end'><sync ref='b:end-1'/></before>
  <after ref='1'><sync ref='b:end'/></after>
</constraint>"""


def test_constraint_has_its_parts_in_order() -> None:
    block = only(CONSTRAINT)
    a, b, end = (SyncRef(behaviour="a", sync="end"), SyncRef(behaviour="b", sync="start", offset=1.0), "end")
    assert block.constraints == (
        Constraint(
            id="c",
            parts=(
                Synchronize(refs=(a, b, SyncRef(offset=2.0))),
                Before(ref=a, refs=(SyncRef(behaviour="b", sync=end, offset=-1.0),)),
                After(ref=SyncRef(offset=1.0), refs=(SyncRef(behaviour="b", sync=end),)),
            ),
        ),
    )
    assert block.places["c"] == Place(2, "/bml/constraint[1]")
    assert not block.constraints[0].required
    assert parse(write(block)) == block


def test_constraint_of_a_draft_has_the_ref_of_synchronize_as_a_point() -> None:
    block = only(
        "<wait id='a'/><constraint><synchronize ref='a:start'><sync ref='1'/></synchronize></constraint>"
    )
    part = block.constraints[0].parts[0]
    assert part.refs == (SyncRef(behaviour="a", sync="start"), SyncRef(offset=1.0))


@pytest.mark.parametrize(
    ("inside", "said", "path"),
    [
        ("", "wanted <synchronize>, <before> or <after>, got none", ""),
        ("<during/>", "wanted <synchronize>, <before> or <after>, got <during>", "/during[1]"),
        ("<synchronize/>", "wanted at least one <sync>, got none", "/synchronize[1]"),
        ("<before ref='1'/>", "wanted at least one <sync>, got none", "/before[1]"),
        ("<before><sync ref='1'/></before>", "ref: wanted a sync reference, got none", "/before[1]"),
        ("<after ref='1'><sync/></after>", "ref: wanted a sync reference, got none", "/after[1]/sync[1]"),
        ("<after ref='1'><wait id='w'/></after>", "wanted <sync>, got <wait>", "/after[1]/wait[1]"),
        ("<after ref='q:end'><sync ref='1'/></after>", 'ref: no behaviour "q" in this block', "/after[1]"),
        ("text", 'wanted elements, got the text "text"', ""),
    ],
)
def test_constraint_with_a_fault_goes_alone(inside: str, said: str, path: str) -> None:
    block = only(f"<wait id='a'/><constraint id='c'>{inside}</constraint>")
    assert [b.id for b in block.behaviours] == ["a"]
    assert not block.constraints
    (problem,) = block.problems
    assert (problem.id, problem.type, problem.text) == ("c", "PARSING_FAILURE", said)
    assert problem.path == f"/bml/constraint[1]{path}"
    assert not problem.fatal


def test_constraint_without_id_is_reported_under_the_block() -> None:
    assert [p.id for p in only("<constraint/>").problems] == ["b"]


def test_unknown_children_are_kept_in_their_namespaces() -> None:
    block = described(
        "<q:parameter xmlns:q='urn:q' xmlns:z='urn:z' z:a='&lt;'> x <q:b/></q:parameter>\n<r xmlns='urn:r'/>"
    )
    assert block["h"].unknown_children == (
        '<parameter xmlns="urn:q" xmlns:p1="urn:z" p1:a="&lt;"> x <b/></parameter>',
        '<r xmlns="urn:r"/>',
    )
    assert not block.problems
    assert parse(write(block)) == block


def test_attributes_may_have_blanks_around_numbers() -> None:
    block = only("<head id='h' lexeme='NOD' repetition=' 3 '/><wait id='w' start='h:stroke:3'/>")
    assert not block.problems
    # A gesture has one stroke.
    block = only("<gesture id='g' lexeme='BEAT' repetition='3'/><wait id='w' start='g:stroke:3'/>")
    slip, problem = block.problems
    assert slip.text.startswith("repetition: no attribute of <gesture>")
    assert problem.text == 'start: wanted stroke:1..1 of "g", got stroke:3'
