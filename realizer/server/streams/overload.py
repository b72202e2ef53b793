"""Detection of overload: sessions are woken too late for a while, because there is more work than time."""

from __future__ import annotations

import logging
import math

from realizer.server.streams.frame_windows import first_frame_at

log = logging.getLogger(__name__)

LATE = 0.1  # s; it begins when all sessions have been woken later than this
PERIOD = 2.0  # s; for so long
TIMELY = 0.05  # s; it ends when none has been woken later than this
RECOVERY = 5.0  # s; for so long
# Frames that are later than this, after the process stalled, are not sent.
OUTDATED = 0.5  # s


class Overload:
    """Whether a process is overloaded.

    Then it opens no new sessions, and of frames that are late it sends the newest only: all sessions get
    fewer frames, instead of frames that are later and later.

    Attributes:
        is_active: whether the process is overloaded.
    """

    def __init__(self) -> None:
        self.is_active = False
        self._late_since = math.inf  # all were woken later than LATE since then
        self._noted = -math.inf
        self._behind = -math.inf  # when one was last woken later than TIMELY

    def note(self, late: float, now: float) -> None:
        """Note that a session was woken `late` seconds after its time.

        Args:
            now: seconds on any clock, rising.
        """
        if late <= LATE:
            self._late_since = math.inf
        elif self._late_since > now or now - self._noted > PERIOD:
            self._late_since = now
        if late > TIMELY:
            self._behind = now
        self._noted = now
        if not self.is_active and now - self._late_since >= PERIOD:
            self.is_active = True
            words = "sessions are woken %.0f ms too late. New ones are refused, and frames are left out"
            log.warning(f"overloaded: {words}", 1000 * late)

    def end_if_over(self, now: float) -> None:
        """End the overload if sessions have been woken in time for a while."""
        if self.is_active and now - self._behind >= RECOVERY:
            self.is_active = False
            log.warning("no longer overloaded: sessions are woken in time")

    def oldest(self, newest: int, now: float, fps: float) -> int:
        """Return the number of the oldest frame that is worth sending.

        Args:
            newest: number of the last frame whose time has come.
            now: seconds on the session clock.
        """
        return newest if self.is_active else first_frame_at(now - OUTDATED, fps)
