"""The unit of a journal: one thing that was done to a session, at a time of its clock, as a line of JSON."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass
from typing import Literal, Protocol, get_args

from realizer.errors import RealizerError

__all__ = ["Entry", "Journal", "JournalError", "Kind", "Lost"]

# join, leave: of a connection. text, sound: a message of one. spoken: a voice answered. tick: something that
# waited was read or planned.
Kind = Literal["join", "leave", "text", "sound", "spoken", "tick"]


class JournalError(RealizerError):
    """A journal that cannot be written or read; the text says why."""


class Lost(JournalError):
    """Another process has taken the session over."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One thing that was done.

    Attributes:
        at: seconds on the session's clock.
        number: of the connection, or of what was to be spoken.
        body: a message; of "spoken" why there is nothing to hear, "" where there is.
    """

    at: float
    kind: Kind
    number: int = 0
    body: str | bytes = ""

    def line(self) -> str:
        """As JSON, without a line feed."""
        told: dict[str, object] = {"at": self.at, "kind": self.kind}
        if self.number:
            told["number"] = self.number
        if isinstance(self.body, bytes):
            told["sound"] = base64.b64encode(self.body).decode()
        elif self.body:
            told["body"] = self.body
        return json.dumps(told, ensure_ascii=False)

    @classmethod
    def read(cls, line: str) -> Entry:
        """What `line` wrote.

        Raises:
            JournalError: it is none.
        """
        try:
            told = json.loads(line)
            kind, body = told["kind"], told.get("body", "")
            if "sound" in told:
                body = base64.b64decode(told["sound"], validate=True)
            if kind not in get_args(Kind) or not isinstance(body, str | bytes):
                raise ValueError(f"kind: wanted one of {', '.join(get_args(Kind))}, got {kind!r}")
            return cls(float(told["at"]), kind, int(told.get("number", 0)), body)
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            raise JournalError(f"wanted an entry of a journal, got {line[:80]!r}: {error}") from None


class Journal(Protocol):
    """Where the entries of sessions are kept. Called inside the event loop: a call takes well under 1 ms."""

    def begin(self, session: str, epoch: float) -> None:
        """Keep a new session.

        Args:
            epoch: POSIX seconds at 0 of its clock.

        Raises:
            JournalError: it cannot be written.
        """
        ...

    def add(self, session: str, entry: Entry) -> None:
        """Keep one more entry; it is safe when this returns.

        Raises:
            Lost: another process has taken the session over.
            JournalError: it cannot be written.
        """
        ...

    def take(self, session: str) -> tuple[float, list[Entry]] | None:
        """Take a session over: its epoch and its entries so far, to be gone on with; None where it has none.

        Raises:
            JournalError: it cannot be read.
        """
        ...

    def end(self, session: str) -> None:
        """The session is over: nothing of it is kept. A fault is left to those who clean up."""
        ...

    def close(self) -> None:
        """Write what is not written."""
        ...
