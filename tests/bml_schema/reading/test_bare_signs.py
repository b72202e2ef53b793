"""Tests of documents with bare signs in their text."""

import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import BMLError, Speech, parse
from bml_schema.reading.bare_signs import mend
from tests.rows import each_row

PLAIN = '<bml id="b"><speech id="s"><text>{}</text></speech></bml>'


@each_row(
    "text, words",
    [
        ("Tom & Jerry", "Tom & Jerry"),
        ("5 < 6", "5 < 6"),
        ("I <3 you", "I <3 you"),
        ("a&nbsp;b &eacute;", "a\u00a0b é"),
        ("a <b and c> d", "a <b and c> d"),
        ("fish&chips & &amp; more", "fish&chips & & more"),
        ("AT&T; ok", "AT&T; ok"),
        ('is <sync id="m"/>& <', "is & <"),
    ],
)
def test_bare_signs_are_spoken_with_a_warning_that_shows_them(text: str, words: str) -> None:
    block = parse(PLAIN.format(text))
    (speech,) = block.behaviours
    assert isinstance(speech, Speech)
    assert str(speech.text) == words
    (problem,) = block.problems
    assert "signs that begin no markup are read as text" in problem.text


def test_note_quotes_the_words_around_a_sign() -> None:
    note = mend(PLAIN.format("Tom & Jerry say a&eacute;b"))[1]
    assert note.endswith('"Tom & Jerry say a", "Jerry say a&eacute;b" as "é"')


@each_row(
    "document",
    [
        '<bml id="b"><head id="h" lexeme=NOD/></bml>',
        '<bml id="b"><head id="h" < lexeme="NOD"/></bml>',
    ],
)
def test_other_faults_are_refused_as_before(document: str) -> None:
    with pytest.raises(BMLError):
        parse(document)


def test_strict_bml_refuses_bare_signs() -> None:
    with pytest.raises(BMLError):
        parse(PLAIN.format("Tom & Jerry"), strict_bml=True)


@given(st.text(alphabet="<>&;ab /=\"'!-[]?x"))
def test_any_text_has_an_answer(text: str) -> None:
    mended, note = mend(PLAIN.format(text))
    assert bool(note) == (mended != PLAIN.format(text))


@each_row("unit", ["<", "&", "<a ", "<!--", "<![CDATA[", "<a x='", "&a;"])
def test_mend_takes_linear_time(unit: str) -> None:
    begin = time.process_time()
    mend("<text>" + unit * 20_000)
    assert time.process_time() - begin < 10
