"""The protocol of message formats on a broker."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Message:
    """One message to the broker."""

    topic: str
    body: str
    headers: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Inbound:
    """One message to the session: a document, or a control message of our own making."""

    text: str


@dataclass(frozen=True, slots=True)
class Disconnect:
    """Somebody asks us to go."""


Action = Inbound | Message | Disconnect


class MessageFormat(Protocol):
    """One way to talk over a broker; `topic` is what it reads. It may keep state: one for each session."""

    topic: str

    def hello(self) -> list[Message]:
        """What is said when the broker is there."""
        ...

    def incoming(self, body: bytes) -> list[Action]:
        """What a message of `topic` asks for; nothing where it is not for us."""
        ...

    def outgoing(self, feedback: str) -> list[Message]:
        """What is said when the session tells `feedback`."""
        ...

    def farewell(self) -> list[Message]:
        """What is said before the session ends."""
        ...
