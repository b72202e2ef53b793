"""The protocol of message formats on a broker, and the actions that messages ask for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol


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


class MessageFormat(Protocol):
    """A message format of one session, which may keep state; `topic` is the topic it reads."""

    topic: str

    def hello(self) -> list[Message]:
        """Return the messages to send when the broker is connected."""
        ...

    def incoming(self, body: bytes) -> list[Action]:
        """Return the actions that a message of the topic asks for; [] if it is for other clients."""
        ...

    def outgoing(self, feedback: str) -> list[Message]:
        """Return the messages to send for feedback of the session."""
        ...

    def farewell(self) -> list[Message]:
        """Return the messages to send before the session ends."""
        ...
