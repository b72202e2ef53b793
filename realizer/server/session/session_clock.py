"""The clock of a session."""

import math

# The clock stands still for at most so long, while the documents of a message are planned.
STANDSTILL = 0.1  # s


class SessionClock:
    """The clock of a session, in seconds since the session opened.

    It never goes back, even if the host's clock does: what arrives late counts as arriving now. All documents
    of one message are planned for one instant: the clock stands still meanwhile. Blocks that start at an
    instant start after everything that arrives at this instant: until then they are held.

    Args:
        opened: seconds on the host's clock when the session opened.
    """

    def __init__(self, opened: float) -> None:
        self.opened = opened  # seconds on the host's clock at 0 of this one; a restored session moves it
        self._latest = 0.0  # nothing happens before this time any more
        self._instant = -math.inf  # where the clock stands still
        self._held = -math.inf  # blocks that start at this time or earlier are held

    def read(self, now: float) -> float:
        """Return the time of something that happens, which is at or after all that has happened."""
        self._latest = max(now - self.opened, self._latest)
        return self._latest

    def end_instant(self, t: float) -> None:
        """End an instant, because blocks start at it: what happens next comes after it."""
        self._latest = max(self._latest, math.nextafter(t, math.inf))

    def stand_still(self, t: float = -math.inf) -> None:
        """Stand still at a time, for at most `STANDSTILL`, or go on."""
        self._instant = t

    def stands_still(self, t: float) -> bool:
        """Return whether it stands still at a time."""
        return self._instant <= t <= self._instant + STANDSTILL

    def present(self, t: float) -> float:
        """Return the time at which it stands still, or else `t`."""
        return self._instant if self.stands_still(t) else t

    def hold(self, t: float = -math.inf) -> None:
        """Hold the blocks that start at a time, because more may arrive at this instant; or none."""
        self._held = t

    def start_of(self, event: float) -> float:
        """Return when a block that is due at `event` starts: later if it is held for documents that wait."""
        return event if event > self._held else self._held + STANDSTILL
