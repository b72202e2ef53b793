"""Tests of XML escapes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

from bml_schema.escape import escape, escape_value, sanitized, sanitized_value
from tests.strategies import xml_text


@given(xml_text())
def test_escape_reads_back(text: str) -> None:
    element = etree.fromstring(f'<a b="{escape_value(text)}">{escape(text)}</a>'.encode())
    assert element.get("b") == text
    assert (element.text or "") == text


@pytest.mark.parametrize("bad", ["\0", "\x0b", "\ud800", "\uffff"])
def test_escape_refuses_and_sanitized_replaces_illegal_characters(bad: str) -> None:
    with pytest.raises(ValueError, match=r"characters XML can hold, got U\+.* at 1"):
        escape("a" + bad)
    assert sanitized("a" + bad) == "a\ufffd"


@given(st.text())
def test_sanitized_text_can_be_escaped(text: str) -> None:
    assert etree.fromstring(f"<a>{escape(sanitized(text))}</a>".encode()) is not None


@given(st.text() | st.text("ab \"&<>'\t\n\r~\x7f", max_size=3))
def test_sanitized_value_reads_back_as_sanitized_text(text: str) -> None:
    assert etree.fromstring(f'<a b="{sanitized_value(text)}"/>'.encode()).get("b") == sanitized(text)
