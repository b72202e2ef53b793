"""Tests of the reader of the content of <text>."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import Block, Speech, Sync, SyncRef, parse, write
from tests.rows import each_row


def only(inside: str, *, strict_bml: bool = False) -> Block:
    space = "http://www.bml-initiative.org/bml/bml-1.0"
    return parse(f'<bml xmlns="{space}" id="b">{inside}</bml>', strict_bml=strict_bml)


def parts(text: str) -> list[str]:
    speech = only(f'<speech id="s"><text>{text}</text></speech>')["s"]
    assert isinstance(speech, Speech)
    assert speech.text is not None
    return [f"<{p.id}>" if isinstance(p, Sync) else p for p in speech.text.parts]


@each_row(
    "text, wanted",
    [
        ("a <emphasis>b <sync id='m'/>c</emphasis> d", ["a b ", "<m>", "c d"]),
        ("<p><s>a</s><s>b.</s></p><p>c</p>", ["a b. c"]),
        ("a<break/>b <break time='1s'/> c", ["a b  c"]),
        ("a <mark name='m'/>b <bookmark mark='n'/>c", ["a ", "<m>", "b ", "<n>", "c"]),
        ("a<audio src='x'><desc>bell</desc>ding</audio>", ["a ding"]),
        ("a <metadata>x</metadata><what>b<w>c</w></what>", ["a bc"]),
        ("a <sync id='m'>b</sync> c", ["a ", "<m>", "b c"]),
        ("a <head id='h'/>b", ["a b"]),
    ],
)
def test_read_mixed_keeps_the_words_and_syncs_of_ssml(text: str, wanted: list[str]) -> None:
    assert parts(text) == wanted


@each_row(
    "text, wanted, says",
    [
        ("a <sync/>b", ["a b"], "id: wanted a name"),
        ("a <mark name='x y'/>b", ["a b"], 'got "x y"'),
        ("a <sync id='m'/><sync id='m'/>b", ["a ", "<m>", "b"], 'got "m" again'),
        ("a <sync id='end'/>b", ["a b"], 'got "end" again'),
        ("a <sync id='m' ref='soon'/>b", ["a ", "<m>", "b"], '"soon"'),
    ],
)
def test_read_mixed_leaves_out_a_sync_with_a_fault(text: str, wanted: list[str], says: str) -> None:
    assert parts(text) == wanted
    (problem,) = only(f'<speech id="s"><text>{text}</text></speech>').problems
    assert says in problem.text
    assert not problem.dropped
    (problem,) = only(f'<speech id="s"><text>{text}</text></speech>', strict_bml=True).problems
    assert problem.dropped == ("mark" not in text) or "wanted text and <sync>, got <mark>" in problem.text


def test_read_mixed_of_strict_bml_reads_words_and_syncs_only() -> None:
    block = only('<speech id="s"><text>a <b>c</b></text></speech>', strict_bml=True)
    assert not block.behaviours
    assert block.problems[0].text.startswith("wanted text and <sync>, got <b>")


def test_marks_of_ssml_can_be_referred_to() -> None:
    speech = '<speech id="s"><text><p>a <mark name="m"/>b</p></text></speech>'
    block = only(f'{speech}<head id="h" lexeme="NOD" start="s:m"/>')
    assert not block.problems
    assert block["h"].syncs == {"start": SyncRef(behaviour="s", sync="m")}


NAMES = st.sampled_from(["emphasis", "p", "say-as", "audio", "x", "sync", "mark", "break", "head", "text"])
CONTENT = st.recursive(
    st.sampled_from(["one", " two ", "", "&lt;3 "]),
    lambda inner: (
        st.builds("<{0} {1}>{2}</{0}>".format, NAMES, st.sampled_from(["", "id='a'", "name='b'"]), inner)
        | st.builds("{}{}".format, inner, inner)
    ),
    max_leaves=12,
)


@given(CONTENT)
def test_read_mixed_loses_no_word(content: str) -> None:
    block = only(f'<speech id="s"><text>{content}</text></speech>')
    speech = block["s"]
    assert isinstance(speech, Speech)
    assert str(speech.text).count("one") == content.count("one")
    assert str(speech.text).count("<3") == content.count("&lt;3")
    assert parse(write(block)).behaviours == block.behaviours


@pytest.mark.parametrize("space", ["", ' xmlns="http://www.w3.org/2001/10/synthesis"', ' xmlns="urn:x"'])
def test_description_of_a_text_has_its_ssml(space: str) -> None:
    block = only(f'<speech id="s"><text xml:lang="nl">a <p{space}>b<sync id="m"/></p></text></speech>')
    (description,) = block["s"].descriptions
    assert description.content.startswith(
        '<speak xmlns="http://www.w3.org/2001/10/synthesis" xml:lang="nl">a <p'
    )
