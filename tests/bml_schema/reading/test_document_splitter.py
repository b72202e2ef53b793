"""Tests of the splitter that finds documents in a text."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import BMLError
from bml_schema.reading.document_splitter import document_spans


def cut(text: str) -> list[str]:
    """Return each span of a text, with "!" before those that are no documents."""
    return [("!" if s.fault else "") + text[s.start : s.end] for s in document_spans(text)]


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("", []),
        ("<!-- <bml> --> <?x <bml> ?>", []),
        (" <bml/>\n<q:bml a='>'></q:bml> ", ["<bml/>", "<q:bml a='>'></q:bml>"]),
        ("<bml><bml/></bml>", ["<bml><bml/></bml>"]),
        ("a <bml/> b", ["!a ", "<bml/>", "!b"]),
        ("<bml><bml></bml>", ["<bml>", "<bml></bml>"]),
        ("</bml><bml/>", ["!</bml>", "<bml/>"]),
        ("<bmlx/><bml/>", ["!<bmlx/>", "<bml/>"]),
        ("<bml><![CDATA[</bml>]]></bml>", ["<bml><![CDATA[</bml>]]></bml>"]),
        ("<!DOCTYPE x><bml/><bml/>", ["!<!DOCTYPE x><bml/>", "<bml/>"]),
        ("<act a='b'><participant/><bml/></act>", ["<bml/>"]),
        ("<actor><bml/></actor>", ["!<actor>", "<bml/>", "!</actor>"]),
    ],
)
def test_document_spans_begin_and_end_with_documents(text: str, wanted: list[str]) -> None:
    assert cut(text) == wanted


def test_document_spans_have_their_start_tag_or_a_fault() -> None:
    junk, document = document_spans("oops<bml id='a'></bml>")
    assert (junk.tag, junk.fault) == ("", 'wanted <bml>, got "oops"')
    assert (document.tag, document.fault) == ("<bml id='a'>", "")


def test_document_spans_of_a_part_of_a_text() -> None:
    text = "<bml/><bml id='x'/><bml/>"
    assert [(s.start, s.end) for s in document_spans(text, 6, 19)] == [(6, 19)]


def test_document_spans_refuse_too_many_marks() -> None:
    with pytest.raises(BMLError, match="wanted at most 100000 tags"):
        list(document_spans("<!---->" * 100_001))


@given(st.lists(st.sampled_from(["<bml>", "</bml>", "<bml/>", "<!--", "-->", "<act>", "</act>", "x", " "])))
def test_document_spans_are_in_order_and_do_not_overlap(words: list[str]) -> None:
    text = "".join(words)
    ends = [0, *(end for s in document_spans(text) for end in (s.start, s.end))]
    assert ends == sorted(ends)
    assert not ends or ends[-1] <= len(text)
