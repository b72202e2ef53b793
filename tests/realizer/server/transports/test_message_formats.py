"""Messages of a broker become BML, and feedback becomes messages: each dialect alone, without a broker."""

from __future__ import annotations

import json
from urllib.parse import quote, quote_plus, unquote

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema.feedback import WarningFeedback, parse_feedback
from realizer.core.settings import Settings
from realizer.server.transports.message_formats import AsapJson, AsapXml, Inbound, Message
from realizer.server.transports.stomp import MESSAGE_FORMATS

NOD = '<bml id="b"><head id="n" lexeme="NOD"/></bml>'
TRICKY = '<bml id="b"><speech id="s"><text>50 % + é &amp; more</text></speech></bml>'


@pytest.mark.parametrize("encode", [lambda text: quote(text, safe=""), quote, quote_plus, lambda text: text])
@pytest.mark.parametrize("text", [NOD, TRICKY, "\n" + NOD])
def test_asap_json_decodes_blanks_written_either_way(encode, text: str) -> None:
    body = json.dumps({"bml": {"content": encode(text)}}).encode()
    assert AsapJson("in", "out").incoming(body) == [Inbound(text)]


def test_asap_json_encodes_feedback_for_every_decoder() -> None:
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
def test_asap_json_warns_once_of_a_message_that_is_no_bml(body: bytes) -> None:
    (message,) = AsapJson("in", "out").incoming(body)
    assert isinstance(message, Message)
    warning = parse_feedback(unquote(json.loads(message.body)["feedback"]["content"]))
    assert isinstance(warning, WarningFeedback)
    assert (warning.id, warning.type) == ("<no id>", "PARSING_FAILURE")
    assert "wanted" in warning.text


def test_asap_xml_passes_documents_and_feedback_unchanged() -> None:
    dialect = AsapXml("in", "out")
    assert dialect.incoming(TRICKY.encode()) == [Inbound(TRICKY)]
    assert dialect.outgoing("<a/>") == [Message("out", "<a/>")]


@pytest.mark.parametrize("body", [b"", b"hello", b'{"type":"stop"}', b" \xef\xbb\xbf{}", b"\xff<bml/>"])
def test_asap_xml_warns_once_of_a_text_that_is_no_xml(body: bytes) -> None:
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
def test_message_formats_parse_anything_without_an_error(words: list[str], noise: bytes) -> None:
    for _, make in MESSAGE_FORMATS.values():
        format_ = make("/topic/in", Settings())
        for body in (" ".join(words).encode(), quote(" ".join(words)).encode(), noise):
            for action in format_.incoming(body):
                if isinstance(action, Inbound):
                    assert action.text.lstrip("\ufeff \t\r\n")[0] in "<{"


def test_message_formats_are_switched_off_by_empty_settings() -> None:
    off = Settings(stomp_json_in="", stomp_xml_in="", stomp_vhmsg="")
    for setting, _ in MESSAGE_FORMATS.values():
        assert getattr(Settings(), setting) is not None
        assert getattr(off, setting) is None
