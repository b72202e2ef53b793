"""Tests of the encodings of documents: they are read as what they are."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import Block, BMLError, Speech, read
from bml_schema.reading.encodings import decode, is_declared, without_controls

TEXT = "café “naïve” – 5€"


def document(encoding: str, text: str = TEXT) -> str:
    declaration = f'<?xml version="1.0" encoding="{encoding}"?>' if encoding else ""
    return f'{declaration}<bml id="b"><speech id="s"><text>{text}</text></speech></bml>'


def spoken(data: str | bytes, *, strict_bml: bool = False) -> tuple[str, list[str]]:
    """Return the text of the speech of a document, and its warnings."""
    (block,) = read(data, strict_bml=strict_bml)
    assert isinstance(block, Block), block
    speech = block["s"]
    assert isinstance(speech, Speech)
    return str(speech.text), [problem.text for problem in block.problems]


@pytest.mark.parametrize(
    ("declared", "encoding", "text"),
    [
        ("ISO-8859-1", "latin-1", "café"),
        ("ISO-8859-1", "cp1252", TEXT),  # as browsers read it
        ("windows-1252", "cp1252", TEXT),
        ("windows-1251", "cp1251", "привет"),
        ("shift_jis", "shift_jis", "こんにちは"),
        ("gbk", "gbk", "你好"),
        ("utf-16", "utf-16", TEXT),
        ("utf-16", "utf-16-le", TEXT),
        ("utf-8", "utf-16-be", TEXT),  # .NET declares what it is not, but the bytes are plain
        ("utf-32", "utf-32", TEXT),
        ("", "utf-8-sig", TEXT),
        ("us-ascii", "utf-8", "plain"),
    ],
)
def test_decode_reads_true_encodings_without_a_word(declared: str, encoding: str, text: str) -> None:
    assert spoken(document(declared, text).encode(encoding)) == (text, [])


@pytest.mark.parametrize(
    ("declared", "encoding", "said"),
    [
        ("utf-16", "utf-8", 'the encoding "utf-16" is declared; read as UTF-8, which it is'),
        ("ISO-8859-1", "utf-8", 'the encoding "ISO-8859-1" is declared; read as UTF-8, which it is'),
        ("nonsense", "utf-8", 'the encoding "nonsense" is declared; read as UTF-8, which it is'),
        ("utf-8", "cp1252", 'the encoding "utf-8" is declared; read as Windows-1252, as it is not UTF-8'),
        ("", "cp1252", "no encoding is declared; read as Windows-1252, as it is not UTF-8"),
    ],
)
def test_decode_reads_falsely_declared_encodings_with_one_warning(
    declared: str, encoding: str, said: str
) -> None:
    assert spoken(document(declared).encode(encoding)) == (TEXT, [said])


def test_decode_believes_the_declaration_in_strict_bml() -> None:
    data = document("ISO-8859-1").encode()
    assert spoken(data, strict_bml=True) == (TEXT.encode().decode("latin-1"), [])
    (error,) = read(document("nonsense").encode(), strict_bml=True)
    assert isinstance(error, BMLError)


@given(st.binary(max_size=200))
def test_decode_of_any_bytes_is_a_text_or_an_error(data: bytes) -> None:
    try:
        text, _ = decode(data)
    except BMLError:
        return
    assert isinstance(text, str)


def test_is_declared_knows_declarations() -> None:
    assert is_declared(document("utf-8").encode("utf-8-sig"))
    assert not is_declared(document("").encode())


@pytest.mark.parametrize(
    "bad", ["\0", "\x02", "\x0b", "\f", "\ud800", "\uffff", "&#0;", "&#x0B;", "&#xD800;"]
)
def test_control_characters_inside_words_are_left_out_with_one_warning(bad: str) -> None:
    text, problems = spoken(document("", f"one {bad}two"))
    assert "".join(text.split()) == "onetwo"
    assert [problem.startswith("characters that XML cannot hold") for problem in problems] == [True]


def test_without_controls_makes_blanks_of_breaks() -> None:
    assert without_controls("a\fb\vc\x02d&#65;") == (
        "a b cd&#65;",
        "characters that XML cannot hold are left out: U+000C, U+000B, U+0002",
    )
    assert without_controls("plain") == ("plain", "")
