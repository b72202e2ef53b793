"""When the pictures and the sound of a session are sent to a peer: together, behind the session's clock."""

import math
from collections import deque

from realizer.server.streams.audio_stream import PACKET

FIRST = 0.1  # s; the delay until pictures have shown how long they take
MOST = 0.5  # s; later pictures are left out of account: lips are late, but the sound is not
LOST = 1.0  # s; the clock of the session has moved
WINDOW, EXCEPTIONS = 25, 2  # pictures after which the delay is reviewed, and those that may come later


class Playout:
    """The delay between the session's clock and what a peer is sent, the same for pictures and sound.

    Sound comes ahead of its time, and pictures when they have been drawn: the delay grows to the time that
    this takes. It changes by whole packets, and in silence, so that nobody hears it.

    Args:
        opened: seconds on the loop's clock at which the session's clock was 0.

    Attributes:
        began: seconds on the loop's clock at which the timestamps of both tracks are 0.
        offset: seconds on the loop's clock, minus seconds on the session's, at which something is sent.
    """

    def __init__(self, opened: float, now: float) -> None:
        self._opened = opened
        self.offset = opened + FIRST
        # A whole number of packets: those of the session are sent as they are.
        self.began = self.offset + math.ceil((now - self.offset) / PACKET) * PACKET
        self._lags: deque[float] = deque(maxlen=WINDOW)
        self._change = 0  # packets

    @property
    def delay(self) -> float:
        """Seconds by which everything is sent after its time."""
        return self.offset - self._opened

    def note_picture(self, time: float, now: float) -> None:
        """Note that the picture of a time of the session has come."""
        lag = now - time - self._opened
        if abs(lag) > LOST:
            self._lags.clear()
            if lag < 0:  # it comes before its time: this is another clock
                self._opened = now - time
                self.offset += round((self._opened + FIRST - self.offset) / PACKET) * PACKET
            return
        self._lags.append(lag)
        if len(self._lags) == WINDOW:
            wanted = min(MOST, sorted(self._lags)[-1 - EXCEPTIONS])
            self._change = math.ceil((wanted - self.delay) / PACKET + 0.5)  # half a packet to spare
            self._lags.clear()

    def adapt(self) -> None:
        """Change the delay if it is too short, or much too long. Call it in silence."""
        if self._change > 0 or self._change < -2:
            self.offset += self._change * PACKET
        self._change = 0
