"""Tests of the reader of one element."""

import pytest

from bml_schema import (
    BMLA,
    CORE,
    EXTENSIONS,
    OWN,
    After,
    Before,
    Block,
    Constraint,
    Description,
    Head,
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


def test_description_needs_a_priority_in_strict_bml() -> None:
    text = "<bml id='b'><head id='h' lexeme='NOD'><description type='x'/></head></bml>"
    assert [d.priority for d in parse(text)["h"].descriptions] == [1]
    (problem,) = parse(text, strict_bml=True).problems
    assert problem.text == "priority: wanted a whole number -2147483648..2147483647, got none"


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
        ("<description priority='one' type='x'/>", "priority: wanted a whole number"),
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
    assert (problem.id, problem.type, problem.text) == ("b:c", "PARSING_FAILURE", said)
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
    assert slip.text.endswith("without <gesture repetition>")
    assert problem.text == 'start: wanted stroke:1..1 of "g", got stroke:3'


TYPE = "CUSTOM_ATTRIBUTE_NOT_SUPPORTED"


def document(inside: str, more: str = "") -> Block:
    return parse(f"<bml id='b' xmlns='{CORE}' xmlns:e='{EXTENSIONS}' xmlns:r='{OWN}' {more}>{inside}</bml>")


def test_unknown_attribute_is_reported_with_place_and_suggestion() -> None:
    block = document("\n<head id='h' lexeme='NOD'\n amout='1'/>")
    (problem,) = block.problems
    assert (problem.id, problem.type, problem.line, problem.path) == ("b:h", TYPE, 2, "/bml/head[1]")
    assert problem.text == (
        "amout: no attribute of <head>, so it does nothing; known are id, lexeme, repetition, amount, start, "
        'ready, strokeStart, stroke, strokeEnd, relax, end, did you mean "amount"?'
    )
    assert (problem.fatal, problem.dropped) == (False, False)
    assert block["h"] == Head(id="h", lexeme="NOD", unknown_attributes={"amout": "1"})


def test_unknown_attributes_of_one_element_are_one_problem() -> None:
    (problem,) = document("<wait id='w' durration='1' style='x'/>").problems
    assert problem.text == (
        'durration: no attribute of <wait>, so it does nothing, did you mean "duration"?; '
        "style: no attribute of <wait>, so it does nothing; known are id, duration, start, end"
    )


@pytest.mark.parametrize(
    "attribute",
    [
        "xmlns:q='urn:q' q:amout='1'",
        f"xmlns:a='{BMLA}' a:amout='1'",
        "xml:lang='de'",
        "xmlns:x='http://www.w3.org/2001/XMLSchema-instance' x:schemaLocation='a b'",
    ],
)
def test_unknown_attributes_of_other_namespaces_are_not_reported(attribute: str) -> None:
    block = document(f"<head id='h' lexeme='NOD' {attribute}/>", attribute)
    assert block.problems == ()
    assert len(block.unknown_attributes) == len(block["h"].unknown_attributes) == 1


def test_unknown_attribute_with_the_prefix_of_bml_is_reported() -> None:
    (problem,) = document("<head id='h' lexeme='NOD' e:amount='1'/>").problems
    assert problem.text.startswith(f"{{{EXTENSIONS}}}amount: no attribute of <head>")
    assert problem.text.endswith('did you mean "amount"?')


@pytest.mark.parametrize(
    ("inside", "path", "said"),
    [
        (
            "<r:emotion id='x' name='joy' intensty='1'/>",
            "/bml/emotion[1]",
            "intensty: no attribute of <emotion>",
        ),
        (
            "<gazeShift id='x' target='a' ready='1'/>",
            "/bml/gazeShift[1]",
            "ready: no attribute of <gazeShift>",
        ),
        (
            "<face id='x'><faceLexeme lexeme='SMILE'/><e:faceFacs au='1' end='2'/></face>",
            "/bml/face[1]/faceFacs[1]",
            "end: no attribute of <faceFacs> inside <face>, so it does nothing; known are id, au,",
        ),
        ("<speech id='x'><text voice='a'>b</text></speech>", "/bml/speech[1]/text[1]", "there are none"),
        (
            "<posture id='x'><stance type='STANDING' legs='2'/></posture>",
            "/bml/posture[1]/stance[1]",
            "known are type",
        ),
    ],
)
def test_unknown_attribute_of_a_part_is_reported_with_its_place(inside: str, path: str, said: str) -> None:
    block = document(inside)
    (problem,) = block.problems
    assert (problem.id, problem.path) == ("b:x", path)
    assert said in problem.text
    assert block["x"]


def test_unknown_attributes_of_a_dropped_behaviour_are_in_its_problem() -> None:
    (problem,) = document("<faceLexeme id='f' lexem='SMILE'/>").problems
    assert problem.type == "PARSING_FAILURE"
    assert problem.dropped
    assert problem.text.startswith("lexeme: wanted a word, got none; lexem: no attribute of <faceLexeme>")
    assert problem.text.endswith('did you mean "lexeme"?')
    again = document("<head id='h' lexeme='NOD'/><head id='h' lexeme='NOD' amout='1'/><wait id='w'/>")
    assert [p.type for p in again.problems] == ["PARSING_FAILURE"]


def test_unknown_attributes_of_a_block_and_a_constraint_are_reported() -> None:
    block = document(
        "<constraint id='c' kind='x'><synchronize><sync ref='1'/></synchronize></constraint>", "by='me'"
    )
    assert [(p.id, p.path, p.type) for p in block.problems] == [
        ("b", "/bml", TYPE),
        ("b:c", "/bml/constraint[1]", TYPE),
    ]
    assert len(block.constraints) == 1


def test_unknown_attributes_with_names_of_drafts_are_not_reported() -> None:
    assert document("<wait id='w' max-wait='2' duration='1'/>").problems == ()


def test_unknown_attribute_of_a_required_behaviour_is_not_fatal() -> None:
    block = document("<required><head id='h' lexeme='NOD' amout='1'/></required>")
    assert [p.fatal for p in block.problems] == [False]
    assert block.required == {"h"}
