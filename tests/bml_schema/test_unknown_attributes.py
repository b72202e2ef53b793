"""Tests of messages about unknown attributes."""

from __future__ import annotations

import pytest

from bml_schema import BMLA, CORE, EXTENSIONS, OWN, Block, Head, parse

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
        ("c", "/bml/constraint[1]", TYPE),
    ]
    assert len(block.constraints) == 1


def test_unknown_attributes_with_names_of_drafts_are_not_reported() -> None:
    assert document("<wait id='w' max-wait='2' duration='1'/>").problems == ()


def test_unknown_attribute_of_a_required_behaviour_is_not_fatal() -> None:
    block = document("<required><head id='h' lexeme='NOD' amout='1'/></required>")
    assert [p.fatal for p in block.problems] == [False]
    assert block.required == {"h"}
