"""Message formats on a broker: their protocol, plain BML, and Asap's BML in JSON."""

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from urllib.parse import quote, unquote_plus

from bml_schema import WarningFeedback
from realizer.core.json_reader import parse_json


@dataclass(frozen=True, slots=True)
class Message:
    """A message to the broker."""

    topic: str
    body: str
    headers: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Inbound:
    """A message to the session: a document, or a control message."""

    text: str


@dataclass(frozen=True, slots=True)
class Disconnect:
    """A request to disconnect."""


Action = Inbound | Message | Disconnect


class MessageFormat(ABC):
    """A message format of one session, which may keep state; `topic` is the topic it reads."""

    topic: str

    def hello(self) -> list[Message]:
        """Return the messages to send when the broker is connected."""
        return []

    @abstractmethod
    def incoming(self, body: bytes) -> list[Action]:
        """Return the actions that a message of the topic asks for; [] if it is for other clients."""

    @abstractmethod
    def outgoing(self, feedback: str) -> list[Message]:
        """Return the messages to send for feedback of the session."""

    def farewell(self) -> list[Message]:
        """Return the messages to send before the session ends."""
        return []


class AsapXml(MessageFormat):
    """Plain documents and feedback, one a message: Asap over ActiveMQ."""

    def __init__(self, topic: str, out: str) -> None:
        self.topic = topic
        self._out = out

    def incoming(self, body: bytes) -> list[Action]:
        try:
            text = self._decode(body)
            # The session would take a text that begins with a brace for a control message.
            if not text.lstrip("\ufeff \t\r\n").startswith("<"):
                raise ValueError(f"wanted <bml>, got {text[:60]!r}")
            return [Inbound(text)]
        except ValueError as error:
            text = str(error)
            if isinstance(error, UnicodeDecodeError):
                text = f"wanted UTF-8, got the byte 0x{error.object[error.start]:02X}"
            refusal = WarningFeedback(id="<no id>", type="PARSING_FAILURE", text=text)
            return list(self.outgoing(refusal.to_xml()))

    def _decode(self, body: bytes) -> str:
        return body.decode()

    def outgoing(self, feedback: str) -> list[Message]:
        return [Message(self._out, feedback)]


class AsapJson(AsapXml):
    """JSON of URL-encoded XML: reads `{"bml": {"content": ...}}`, writes `{"feedback": {"content": ...}}`."""

    def _decode(self, body: bytes) -> str:
        wanted = 'wanted {"bml": {"content": "URL-encoded BML"}}, got '
        try:
            message = parse_json(body)
        except ValueError as error:
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
