"""The journal of sessions that no other process can resume, in the memory of their process."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from realizer.server.journal.entry import Entry, SavedSession

MOST = 2**23  # bytes of one session; one that accepts more without a checkpoint is not kept


class MemoryJournal:
    """What each session has accepted since its last checkpoint: it is rebuilt from that if it fails.

    The methods are those of `Journal`; they raise nothing.
    """

    def __init__(self) -> None:
        self._sessions: dict[str, SavedSession] = {}
        self._sizes: dict[str, int] = {}

    def begin(self, session: str, epoch: float) -> None:
        self._sessions[session] = SavedSession(epoch, [])
        self._sizes[session] = 0

    def add(self, session: str, entry: Entry) -> None:
        if (saved := self._sessions.get(session)) is not None:
            saved.entries.append(entry)
            self._sizes[session] += len(entry.body)
            if self._sizes[session] > MOST:
                self.end(session)

    def end(self, session: str) -> None:
        self._sessions.pop(session, None)
        self._sizes.pop(session, None)

    def close(self) -> None:
        self._sessions.clear()

    def claim(self, session: str) -> SavedSession | None:
        return self._sessions.get(session)

    def note(self, session: str, text: str | None) -> None:
        """Keep no note: a replay in the same process cannot be interrupted by its end."""

    def replace(self, session: str, index: int, entry: Entry) -> None:
        if (saved := self._sessions.get(session)) is not None:
            saved.entries[index] = entry

    def taken_over(self, sessions: Collection[str]) -> set[str]:
        return set()

    def compact(self, session: str, parts: Mapping[str, str | None]) -> None:
        if (saved := self._sessions.get(session)) is not None:
            left = {name: text for name, text in {**saved.parts, **parts}.items() if text is not None}
            self._sessions[session] = SavedSession(saved.epoch, [], left)
            self._sizes[session] = sum(map(len, left.values()))
