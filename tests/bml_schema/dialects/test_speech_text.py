"""Tests of speech in dialects."""

import pytest

from bml_schema import Block, Speech, Sync, parse, read


def only(inside: str) -> Block:
    return parse(f'<bml id="b">{inside}</bml>')


def parts(block: Block) -> list[str]:
    speech = block.behaviours[0]
    assert isinstance(speech, Speech)
    assert speech.text is not None
    return [f"<{p.id}>" if isinstance(p, Sync) else p for p in speech.text.parts]


@pytest.mark.parametrize(
    ("inside", "wanted"),
    [
        ("a <tm id='t1'/>b<tm id='t2'/>", ["a ", "<t1>", "b", "<t2>"]),
        ("<mark name='T1'/>a <mark name='T2'/><mark name='T2'/>b", ["<T1>", "a ", "<T2>", "b"]),
        ("<mark name='sp1:T1'/>a", ["<T1>", "a"]),
        ("a <emphasis>b <mark name='m'/>c</emphasis><break/> d", ["a b ", "<m>", "c d"]),
        ("<tm id='t'/>a<pitchaccent id='p' start='s:t'/> b<boundary id='q'/>", ["<t>", "a b"]),
        ("a <sync id='m' ref='2'/>b", ["a ", "<m>", "b"]),
    ],
)
def test_speech_has_its_words_in_a_text(inside: str, wanted: list[str]) -> None:
    block = only(f"<speech id='s'>{inside}</speech>")
    assert parts(block) == wanted
    (problem,) = block.problems
    assert problem.type == "NOT_BML_1_0"


def test_speech_has_the_words_of_its_attribute_and_its_language() -> None:
    block = only("<speech id='s' text='Good morning' language='en-GB' voice='x'/>")
    assert parts(block) == ["Good morning"]
    speech = block["s"]
    assert isinstance(speech, Speech)
    assert speech.text is not None
    assert speech.text.language == "en-GB"


def test_speech_of_words_alone_is_spoken_in_any_dialect() -> None:
    (problem,) = only("<speech id='s'>Hello</speech>").problems
    assert problem.text == 'wanted elements, got the text "Hello", put it into <text>; it is spoken'
    (block,) = read("<act><bml><speech>Hello</speech></bml></act>")
    assert isinstance(block, Block)
    assert parts(block) == ["Hello"]


def test_speech_keeps_its_descriptions() -> None:
    block = only("<speech id='s'><description type='x'>y</description>Hello<tm id='t'/></speech>")
    assert parts(block) == ["Hello", "<t>"]
    assert [d.type for d in block["s"].descriptions] == ["x"]


def test_speech_of_bml_1_0_stays_as_it_is() -> None:
    block = only("<speech id='s'><text>a <sync id='m'/>b</text></speech>")
    assert not block.problems
    assert parts(block) == ["a ", "<m>", "b"]


def test_speech_keeps_its_ssml() -> None:
    for inside in (
        "a <emphasis>b <mark name='m'/>c</emphasis><break/>",
        "<text>a <emphasis>b <tm id='m'/>c</emphasis><break/></text>",
    ):
        (description,) = only(f"<speech id='s'>{inside}</speech>")["s"].descriptions
        assert description.content.endswith('>a <emphasis>b <mark name="m"/>c</emphasis><break/></speak>')
