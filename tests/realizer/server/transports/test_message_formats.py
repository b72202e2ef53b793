"""Messages of a broker become BML, and feedback becomes messages: each dialect alone, without a broker."""

from __future__ import annotations

import json
from urllib.parse import quote, quote_plus, unquote

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema.feedback import WarningFeedback, parse_feedback
from realizer.core.settings import Settings
from realizer.server.transports.message_format import Inbound, Message
from realizer.server.transports.message_formats import MESSAGE_FORMATS, AsapJson, AsapXml

NOD = '<bml id="b"><head id="n" lexeme="NOD"/></bml>'
TRICKY = '<bml id="b"><speech id="s"><text>50 % + é &amp; more</text></speech></bml>'


@pytest.mark.parametrize("encode", [lambda text: quote(text, safe=""), quote, quote_plus, lambda text: text])
@pytest.mark.parametrize("text", [NOD, TRICKY, "\n" + NOD])
def test_json_is_decoded_whichever_way_its_blanks_are_written(encode, text: str) -> None:
    body = json.dumps({"bml": {"content": encode(text)}}).encode()
    assert AsapJson("in", "out").incoming(body) == [Inbound(text)]


def test_feedback_in_json_is_text_that_every_decoder_reads() -> None:
    (message,) = AsapJson("in", "/topic/out").outgoing("<a>1 + é</a>")
    assert message.topic == "/topic/out"
    content = json.loads(message.body)["feedback"]["content"]
    assert set(content).isdisjoint(" +<é")
    assert unquote(content) == "<a>1 + é</a>"


BAD_JSON = [
    b"",
    b"nonsense",
    b"[1]",
    b"{}",
    b'{"bml": "x"}',
    b'{"bml": {"content": 1}}',
    b'{"bml": {"content": "%7B%22type%22%3A%22stop%22%7D"}}',
    b'{"bml": {"content": "%FF"}}',
    b"[" * 100_000,
    b"\xff",
]


@pytest.mark.parametrize("body", BAD_JSON)
def test_a_message_that_is_no_bml_gets_one_warning_in_the_same_form(body: bytes) -> None:
    (message,) = AsapJson("in", "out").incoming(body)
    assert isinstance(message, Message)
    warning = parse_feedback(unquote(json.loads(message.body)["feedback"]["content"]))
    assert isinstance(warning, WarningFeedback)
    assert (warning.id, warning.type) == ("<no id>", "PARSING_FAILURE")
    assert "wanted" in warning.text or "decode" in warning.text


def test_bare_xml_goes_as_it_is() -> None:
    dialect = AsapXml("in", "out")
    assert dialect.incoming(TRICKY.encode()) == [Inbound(TRICKY)]
    assert dialect.outgoing("<a/>") == [Message("out", "<a/>")]


@pytest.mark.parametrize("body", [b"", b"hello", b'{"type":"stop"}', b" \xef\xbb\xbf{}", b"\xff<bml/>"])
def test_bare_text_that_is_no_xml_gets_one_warning(body: bytes) -> None:
    (message,) = AsapXml("in", "out").incoming(body)
    assert isinstance(message, Message)
    assert isinstance(parse_feedback(message.body), WarningFeedback)


WORDS = [
    "vrSpeak",
    "vrSpoke",
    "vrAllCall",
    "vrKillComponent",
    "a",
    "<bml>",
    "</bml>",
    "<bml id='x'/>",
    "%",
    "+",
]


@given(st.lists(st.sampled_from(WORDS), max_size=8), st.binary(max_size=20))
def test_whatever_comes_is_taken_apart_without_a_fault(words: list[str], noise: bytes) -> None:
    made = [make(Settings()) for make in MESSAGE_FORMATS.values()]
    for dialect in [dialect for dialect in made if dialect is not None]:
        for body in (" ".join(words).encode(), quote(" ".join(words)).encode(), noise):
            for action in dialect.incoming(body):
                if isinstance(action, Inbound):
                    assert action.text.lstrip("\ufeff \t\r\n")[0] in "<{"


def test_settings_switch_dialects_off() -> None:
    made = {name: make(Settings()) for name, make in MESSAGE_FORMATS.items()}
    assert all(dialect is not None for dialect in made.values())
    off = Settings(stomp_json_in="", stomp_xml_in="", stomp_vhmsg="")
    assert {make(off) for make in MESSAGE_FORMATS.values()} == {None}
