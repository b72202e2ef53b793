"""The connections of a session, and what is sent to them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from realizer.core import work
from realizer.protocol.messages.common import Reply
from realizer.protocol.messages.replies import Gap
from realizer.protocol.messages.requests import Save
from realizer.server.session.effects import Close, Effect, MoveConnection, Send, Write
from realizer.server.session.feedback_log import FeedbackLog
from realizer.server.streams.connection import SLOW, STUCK, Connection


class Connections(dict[int, Connection]):
    """The connections of a session, by id.

    Args:
        log: the published feedback.
        add_effects: takes what is sent.

    Attributes:
        log: the published feedback.
    """

    def __init__(self, log: FeedbackLog, add_effects: Callable[[Iterable[Effect]], None]) -> None:
        super().__init__()
        self.log = log
        self._add_effects = add_effects

    @property
    def has_slow(self) -> bool:
        """Whether one of them is slow."""
        return any(connection.is_slow for connection in self.values())

    @property
    def has_subscriptions(self) -> bool:
        """Whether one of them has a subscription to a stream."""
        return any(connection.subscriptions for connection in self.values())

    def dropped_count(self, id: int) -> int:
        """Return how many frames, pictures and packets a client missed because it was slow."""
        return connection.dropped if (connection := self.get(id)) else 0

    def update_backlog(self, id: int, waiting: int) -> bool:
        """Take the number of unsent bytes of a client: a slow one misses frames, a stuck one is closed.

        Returns:
            Whether it is slow.
        """
        if (connection := self.get(id)) is None:
            return False
        connection.is_slow = waiting > SLOW
        if waiting > STUCK:
            reason = f"{waiting} bytes wait to be read; reconnect with the session's name and seen"
            self._add_effects([Close(id, 1013, reason)])
        return connection.is_slow

    def reply(self, id: int, reply: Reply) -> None:
        """Send a message to a connection."""
        if self:  # the session has not ended
            self._add_effects([Send(id, reply.text())])

    def write(self, id: int, message: Save, folder: Path) -> None:
        """Save a file for a connection, which gets the answer."""
        self._add_effects([Write(id, message, folder)])

    def send_feedback(self, texts: list[str]) -> None:
        """Send feedback to all that want it."""
        for connection in self.values():
            self._send_feedback(connection, texts)

    def send_missed_feedback(self, id: int, seen: int) -> None:
        """Send the feedback after `seen`, and `gap` first if some of it is not stored or never existed."""
        first = self.log.first
        if seen + 1 < first or seen > self.log.newest:
            self.reply(id, Gap(seen=seen, first=first))
            seen = first - 1
        self._send_feedback(self[id], self.log.since(seen + 1))

    def move(self, id: int, session: str, seen: int | None) -> None:
        """Move a connection to another session, where it gets all feedback after `seen`."""
        self._add_effects([MoveConnection(id, session, seen)])

    def _send_feedback(self, connection: Connection, texts: list[str]) -> None:
        if (filter := connection.feedback) is not None:
            self._add_effects(
                [Send(connection.id, text) for text in work.counted(texts) if filter.accepts(text)]
            )
