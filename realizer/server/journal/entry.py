"""Journal entries, saved sessions and the protocols of journals and recorders."""

from __future__ import annotations

import base64
import json
import logging
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Protocol, get_args

from realizer.core.errors import RealizerError

log = logging.getLogger(__name__)

# Sessions whose process died and that no client resumed are deleted after this time.
RETENTION = 7 * 24 * 3600  # s
NOTE = "replay"  # the part of a journal with the note about a replay
ROUNDING = 1e-6  # s; error of times converted from one clock to another

# join, leave: a connection joined or left. text, sound: a message of a connection. spoken: a voice finished.
# tick: a pending document was parsed or planned. aside: a text that is left out, as its replays did not end.
Kind = Literal["join", "leave", "text", "sound", "spoken", "tick", "aside"]


class JournalError(RealizerError):
    """A journal or recording cannot be written or read."""


class TakenOver(JournalError):
    """Another process has taken a session over."""

    def __init__(self, session: str) -> None:
        super().__init__(f"session {session} is another process's now")


@dataclass(frozen=True, slots=True)
class Entry:
    """One event that changed a session."""

    at: float  # seconds on the session clock
    kind: Kind
    number: int = 0  # of the connection, or of the speech request
    body: str | bytes = ""  # the message; for "spoken" the voice's error, or ""

    def line(self) -> str:
        """Return the entry as one line of JSON, without a line feed."""
        data: dict[str, object] = {"at": self.at, "kind": self.kind}
        if self.number:
            data["number"] = self.number
        if isinstance(self.body, bytes):
            data["sound"] = base64.b64encode(self.body).decode()
        elif self.body:
            data["body"] = self.body
        return json.dumps(data, ensure_ascii=False)

    @classmethod
    def read(cls, line: str) -> Entry:
        """Parse a line that `line` returned.

        Raises:
            JournalError: the line is not an entry.
        """
        try:
            data = json.loads(line)
            kind, body = data["kind"], data.get("body", "")
            if "sound" in data:
                body = base64.b64decode(data["sound"], validate=True)
            if kind not in get_args(Kind) or not isinstance(body, str | bytes):
                raise ValueError(f"kind: wanted one of {', '.join(get_args(Kind))}, got {kind!r}")
            return cls(float(data["at"]), kind, int(data.get("number", 0)), body)
        except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError) as error:
            raise JournalError(f"wanted an entry of a journal, got {line[:80]!r}: {error}") from None


@dataclass(frozen=True, slots=True)
class SavedSession:
    """A session as a journal or a recording holds it.

    Attributes:
        head: what a recording says about the session beside the epoch: `session` (its name), `settings`,
            `scene`; {} in a journal.
    """

    epoch: float  # POSIX time at 0 of the session clock
    entries: list[Entry]  # all entries, or those after the checkpoint; the oldest first
    parts: Mapping[str, str] = field(default_factory=dict)  # name -> text of the checkpoint; {} without one
    head: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def read(
        cls,
        epoch: float,
        lines: Iterable[str | bytes],
        parts: Mapping[str, str],
        head: Mapping[str, Any] | None = None,
        place: str = "the journal:",
    ) -> SavedSession:
        """Parse the stored lines of a session.

        A damaged entry of a journal costs no other one: it is set aside with a warning, and one whose time
        alone is wrong is taken at the time of the entry before.

        Args:
            head: of a recording, which cannot be replayed with a gap.
            place: prefix of messages, before the number of the line; the head of a recording is line 1.

        Raises:
            JournalError: a line of a recording is not an entry, or its time is not finite or before that of
                the line above.
        """
        entries: list[Entry] = []
        for number, line in enumerate(lines, 2 if head else 1):
            last = entries[-1].at if entries else 0.0
            entry = Entry(last, "tick")  # does nothing
            try:
                entry = Entry.read(line if isinstance(line, str) else line.decode())
                check_time(entry.at, last)
            except (JournalError, ValueError) as error:  # also for bytes that are not UTF-8
                is_text = not isinstance(error, UnicodeDecodeError)
                words = str(error) if is_text else f"wanted UTF-8, got {quoted(line)!r}"
                if head is not None:
                    raise JournalError(f"{place}{number}: {words}") from None
                log.warning("%s%d is damaged, and set aside: %s", place, number, words)
                entry = replace(entry, at=last)
            entries.append(entry)
        return cls(epoch, entries, parts, head or {})


def check_time(at: float, least: float = float("-inf")) -> None:
    """Raise ValueError if a time is not finite, or before `least`."""
    if not least - ROUNDING <= at < float("inf"):
        raise ValueError(f"at: wanted seconds, not before {least:g}, got {at:g}")


def quoted(line: str | bytes) -> str:
    """Return the beginning of a line for an error message."""
    return line[:80] if isinstance(line, str) else line[:80].decode(errors="replace")


class Journal(Protocol):
    """A log of sessions from which another process can resume them; it keeps them until they end.

    Its methods but `taken_over` run in the event loop: each takes well under 1 ms. All but `end` raise
    JournalError if the journal cannot be read or written, and nothing has changed then; those that write to a
    session raise TakenOver if another process has taken it over.
    """

    def begin(self, session: str, epoch: float) -> None:
        """Add a new session, whose clock is 0 at the POSIX time `epoch`."""

    def add(self, session: str, entry: Entry) -> None:
        """Append an entry; it is stored when this returns."""

    def end(self, session: str) -> None:
        """End a session. Errors are ignored: expired sessions are deleted later."""

    def close(self) -> None:
        """Close the log."""

    def claim(self, session: str) -> SavedSession | None:
        """Take a session over and return it, or None if there is none."""

    def note(self, session: str, text: str | None) -> None:
        """Store a note about the replay as the part `replay`, or delete it (None)."""

    def replace(self, session: str, index: int, entry: Entry) -> None:
        """Replace an entry after the checkpoint by another, and delete the note about the replay."""

    def taken_over(self, sessions: Collection[str]) -> set[str]:
        """Return those of these sessions that another process has taken over. May block, in any thread."""

    def compact(self, session: str, parts: Mapping[str, str | None]) -> None:
        """Replace the entries of a session by a checkpoint, in one transaction.

        Args:
            parts: name -> text of each new or changed part, None for a part to delete; others stay.
        """
