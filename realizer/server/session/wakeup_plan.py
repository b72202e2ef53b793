"""The time at which a session must be woken next."""

from __future__ import annotations

import math
from collections.abc import Mapping

from realizer.playback.player import Player
from realizer.server.documents.document_queue import Intake
from realizer.server.streams.broadcast import Broadcast, Run
from realizer.server.streams.connection import Connection
from realizer.server.streams.frame_windows import EPSILON


class Rhythm:
    """Times are seconds on the session clock.

    Args:
        connections: who shares the session, as it goes on.

    Attributes:
        run: the frames of its only client for which nobody need ask it; None where there is more to it.
        unsettled: who has left may have left speeches, which end now: nothing else says when.
    """

    def __init__(
        self, player: Player, intake: Intake, broadcast: Broadcast, connections: Mapping[int, Connection]
    ) -> None:
        self.run: Run | None = None
        self.unsettled = False
        self._player = player
        self._intake = intake
        self._broadcast = broadcast
        self._connections = connections
        # Until then nothing is due but frames and what blocks tell as they play; None where that is not
        # known. And when they tell something.
        self._calm: float | None = None
        self._tells = 0.0

    def stir(self) -> None:
        """Something may change: nobody knows what is due before all of it has been looked at."""
        self._calm = self.run = None

    def calm(self, t: float) -> bool:
        """Nothing is due but frames and feedback."""
        return self._calm is not None and t + EPSILON < self._calm

    def tells(self, t: float) -> bool:
        """Feedback is due."""
        return t + EPSILON >= self._tells

    def told(self, plans: int) -> None:
        """Feedback has been told; `plans`: the player's revision before."""
        self._tells = self._player.next_change()
        if self._player.version != plans:
            self.stir()

    @property
    def reads(self) -> bool:
        """A document can be read or planned at once."""
        return self._calm is None and (self.unsettled or self._intake.ready)

    def next(self) -> float:
        """When something is due that is no document; infinite where nothing is."""
        other, streams = self._calm, self._broadcast
        if other is None:
            self._tells, asked = self._player.next_change(), self._intake.orders.deadline()
            other = streams.next_other if streams.active else math.inf
            other = other if asked is None else min(other, asked)
            # Speeches that last and clients that are slow are looked at with every frame, plans with whatever
            # is told.
            slow = any(connection.slow for connection in self._connections.values())
            shown = streams.active and streams.shows_plans
            if not (self.reads or slow or self._intake.speeches.lasting or shown):
                self._calm = other
        return min(other, self._tells, streams.next_frame if streams.active else math.inf)

    def go_on(self, following: float, opened: float) -> float:
        """As `next`, when frames have been sent; those that follow need nobody to ask for them, if they can.

        Args:
            following: when the next frame is due.
            opened: when the session's clock was 0, on the caller's clock.
        """
        if self._calm is None:
            return self.next()
        other = min(self._calm, self._tells)
        self.run = self._broadcast.run(opened, other + opened)
        return min(other, following)
