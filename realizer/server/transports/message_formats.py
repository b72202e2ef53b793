"""The message formats on a broker: plain BML, Asap's BML in JSON, and the registry with VHMSG.

A new format is a `MessageFormat` and a row of MESSAGE_FORMATS.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from urllib.parse import quote, unquote_plus

from bml_schema import WarningFeedback
from realizer.core.settings import Settings
from realizer.server.transports.message_format import Action, Inbound, Message, MessageFormat
from realizer.server.transports.vhmsg import Vhmsg


class AsapXml:
    """Plain documents and feedback, one a message: Asap over ActiveMQ."""

    def __init__(self, topic: str, out: str) -> None:
        self.topic = topic
        self._out = out

    def hello(self) -> list[Message]:
        return []

    def incoming(self, body: bytes) -> list[Action]:
        try:
            text = self._decode(body)
            # The session would take a text that begins with a brace for a control message.
            if not text.lstrip("\ufeff \t\r\n").startswith("<"):
                raise ValueError(f"wanted <bml>, got {text[:60]!r}")
            return [Inbound(text)]
        except ValueError as error:  # also UnicodeDecodeError
            refusal = WarningFeedback(id="<no id>", type="PARSING_FAILURE", text=str(error))
            return list(self.outgoing(refusal.to_xml()))

    def _decode(self, body: bytes) -> str:
        return body.decode()

    def outgoing(self, feedback: str) -> list[Message]:
        return [Message(self._out, feedback)]

    def farewell(self) -> list[Message]:
        return []


class AsapJson(AsapXml):
    """URL-encoded XML in JSON: `{"bml": {"content": ...}}` in, `{"feedback": {"content": ...}}` out."""

    def _decode(self, body: bytes) -> str:
        wanted = 'wanted {"bml": {"content": "URL-encoded BML"}}, got '
        try:
            message = json.loads(body)
        except (ValueError, RecursionError) as error:
            raise ValueError(f"{wanted}no JSON: {error}"[:200]) from None
        bml = message.get("bml") if isinstance(message, dict) else None
        content = bml.get("content") if isinstance(bml, dict) else None
        if not isinstance(content, str):
            raise ValueError(wanted + json.dumps(message)[:80])
        # Some clients do not encode it.
        return content if content.lstrip().startswith("<") else unquote_plus(content, errors="strict")

    def outgoing(self, feedback: str) -> list[Message]:
        # Blanks as %20, which all decoders understand, not as +.
        body = json.dumps({"feedback": {"content": quote(feedback, safe="")}})
        return [Message(self._out, body, {"content-type": "application/json"})]


# Name of the session -> its topic to read in the settings, None to switch it off, and the format's factory.
MESSAGE_FORMATS: dict[str, tuple[str, Callable[[str, Settings], MessageFormat]]] = {
    "stomp-json": ("stomp_json_in", lambda topic, settings: AsapJson(topic, settings.stomp_json_out)),
    "stomp-xml": ("stomp_xml_in", lambda topic, settings: AsapXml(topic, settings.stomp_xml_out)),
    "stomp-vhmsg": ("stomp_vhmsg", lambda topic, settings: Vhmsg(topic, settings.max_document)),
}
