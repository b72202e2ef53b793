"""The message formats on a broker: bare BML, and Asap's BML in JSON.

A new one is a class as in `format` and a row of DIALECTS.
"""

from __future__ import annotations

import json
from urllib.parse import quote, unquote_plus

from bml_schema import WarningFeedback
from realizer.core.settings import Settings
from realizer.server.transports.message_format import Action, Inbound, Message, MessageFormat
from realizer.server.transports.vhmsg import Vhmsg


class AsapXml:
    """Documents and feedback as they are, one a message: Asap over ActiveMQ."""

    def __init__(self, topic: str, out: str) -> None:
        self.topic = topic
        self._out = out

    def hello(self) -> list[Message]:
        return []

    def incoming(self, body: bytes) -> list[Action]:
        try:
            return [_document(body.decode())]
        except ValueError as wrong:  # a UnicodeDecodeError is one
            return list(self.outgoing(_refusal(str(wrong))))

    def outgoing(self, feedback: str) -> list[Message]:
        return [Message(self._out, feedback)]

    def farewell(self) -> list[Message]:
        return []


class AsapJson:
    """URL-encoded XML in JSON: `{"bml": {"content": ...}}` in, `{"feedback": {"content": ...}}` out."""

    def __init__(self, topic: str, out: str) -> None:
        self.topic = topic
        self._out = out

    def hello(self) -> list[Message]:
        return []

    def incoming(self, body: bytes) -> list[Action]:
        try:
            return [_document(_decoded(self._content(body)))]
        except ValueError as wrong:
            return list(self.outgoing(_refusal(str(wrong))))

    @staticmethod
    def _content(body: bytes) -> str:
        wanted = 'wanted {"bml": {"content": "URL-encoded BML"}}, got '
        try:
            message = json.loads(body)
        except (ValueError, RecursionError) as wrong:
            raise ValueError(f"{wanted}no JSON: {wrong}"[:200]) from None
        bml = message.get("bml") if isinstance(message, dict) else None
        content = bml.get("content") if isinstance(bml, dict) else None
        if not isinstance(content, str):
            raise ValueError(wanted + json.dumps(message)[:80])
        return content

    def outgoing(self, feedback: str) -> list[Message]:
        # Blanks as %20: decoders of forms and of addresses agree on it.
        body = json.dumps({"feedback": {"content": quote(feedback, safe="")}})
        return [Message(self._out, body, {"content-type": "application/json"})]

    def farewell(self) -> list[Message]:
        return []


def _json(settings: Settings) -> MessageFormat | None:
    topic = settings.stomp_json_in
    return AsapJson(topic, settings.stomp_json_out) if topic is not None else None


def _xml(settings: Settings) -> MessageFormat | None:
    topic = settings.stomp_xml_in
    return AsapXml(topic, settings.stomp_xml_out) if topic is not None else None


def _vhmsg(settings: Settings) -> MessageFormat | None:
    topic = settings.stomp_vhmsg
    return Vhmsg(topic, settings.max_document) if topic is not None else None


# Name of the session -> how the dialect is made; None where the settings switch it off.
MESSAGE_FORMATS = {"stomp-json": _json, "stomp-xml": _xml, "stomp-vhmsg": _vhmsg}


def _refusal(text: str) -> str:
    return WarningFeedback(id="<no id>", type="PARSING_FAILURE", text=text).to_xml()


def _decoded(content: str) -> str:
    """URL-encoded text, a blank as %20 or +; what already is XML stays as it is."""
    return content if content.lstrip().startswith("<") else unquote_plus(content, errors="strict")


def _document(text: str) -> Inbound:
    """Text for the session, which would take what starts with a brace for a control message."""
    if not text.lstrip("\ufeff \t\r\n").startswith("<"):
        raise ValueError(f"wanted <bml>, got {text[:60]!r}")
    return Inbound(text)
