"""The journal's entries and protocols."""

from __future__ import annotations

import base64
import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Literal, Protocol, get_args

from realizer.core.errors import RealizerError

# Sessions whose process died and that nobody came back to are forgotten after so long.
RETENTION = 7 * 24 * 3600  # s

# join, leave: of a connection. text, sound: a message of one. spoken: a voice answered. tick: something that
# waited was read or planned.
Kind = Literal["join", "leave", "text", "sound", "spoken", "tick"]


class JournalError(RealizerError):
    """A journal that cannot be written or read; the text says why."""


class TakenOver(JournalError):
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


@dataclass(frozen=True, slots=True)
class SavedSession:
    """What there is of a session.

    Attributes:
        epoch: POSIX seconds at 0 of its clock.
        entries: what was done to it, all of it or what followed the checkpoint.
        parts: name -> text: what it was at its last checkpoint; {} where there was none.
    """

    epoch: float
    entries: list[Entry]
    parts: Mapping[str, str] = field(default_factory=dict)


class Log(Protocol):
    """Where what is done to sessions is written. Called in the event loop: a call takes well under 1 ms."""

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

    def end(self, session: str) -> None:
        """The session is over. A fault is left to those who clean up."""
        ...

    def close(self) -> None:
        """Write what is not written."""
        ...


class Journal(Log, Protocol):
    """Where sessions are kept until they end, so that another process can go on with them."""

    def claim(self, session: str) -> SavedSession | None:
        """Take a session over, to be gone on with; None where it is not there.

        Raises:
            JournalError: it cannot be read.
        """
        ...

    def taken_over(self, sessions: Collection[str]) -> set[str]:
        """Those of them that another process has taken over. May be called in another thread, and wait.

        Raises:
            JournalError: it cannot be read.
        """
        ...

    def compact(self, session: str, parts: Mapping[str, str | None]) -> None:
        """A checkpoint: put what the session is in the place of what was done to it, all or nothing of it.

        Args:
            parts: name -> text of each that is new or another one; None: it is gone. The others stay.

        Raises:
            Lost: another process has taken the session over.
            JournalError: it cannot be written, and all is as it was.
        """
        ...


class Recorder(Log, Protocol):
    """Where sessions are written to be played again."""

    def resume(self, session: str, saved: SavedSession) -> None:
        """Go on with the record of a session that was taken over. May read a long file.

        Raises:
            JournalError: it cannot be written.
        """
        ...
