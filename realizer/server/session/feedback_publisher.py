"""The publisher of due feedback to subscribers."""

from __future__ import annotations

from collections.abc import Iterable

from realizer.playback.player import Player
from realizer.server.documents.submission import Intake
from realizer.server.session.effects import Send
from realizer.server.session.feedback_log import FeedbackLog
from realizer.server.streams.connection import Connection
from realizer.server.streams.frame_windows import EPSILON


class Telling:
    """What a session tells of its blocks.

    Args:
        log: what it has told, for clients that come back.
    """

    def __init__(self, player: Player, intake: Intake, log: FeedbackLog) -> None:
        self.log = log
        self._player = player
        self._intake = intake

    def publish(self, t: float, connections: Iterable[Connection]) -> list[Send]:
        """Number what is due, keep it, and send it to every connection that has not switched it off."""
        texts: list[str] = []
        while due := self._player.due(t + EPSILON):
            for feedback in due:
                told, ends = self._intake.speeches.told(feedback)
                texts.append(self.log.add(told, t))
                if ends:
                    waiting = self._intake.preparation.waiting
                    self._intake.withdraw([w for w in waiting if w.block.id in ends], t)
                    self._player.stop(t, ends)
        return (
            [send for connection in connections for send in self._sends(connection, texts)] if texts else []
        )

    def catch_up(self, connection: Connection) -> list[Send]:
        """What a connection has not got of what was told."""
        return self._sends(connection, self.log.since(connection.place))

    def _sends(self, connection: Connection, texts: list[str]) -> list[Send]:
        connection.place = self.log.newest + 1
        wanted = connection.feedback
        return [] if wanted is None else [Send(connection.id, text) for text in texts if wanted.takes(text)]
