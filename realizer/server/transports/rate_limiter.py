"""The limit of the rate at which the messages of a client are read."""

import asyncio
from collections.abc import Callable

from realizer.core.settings import limit_hint

UNIT = 16 * 1024  # bytes that count as much as a message


class RateLimiter:
    """A limit of the rate at which the messages of a client are read.

    Args:
        rate: messages a second; after a pause twice as many may come at once.

    Attributes:
        notice: a text for the client when it begins to exceed the rate, otherwise None.
    """

    def __init__(self, rate: float) -> None:
        self.notice: str | None = None
        self._rate = rate
        self._was_limited = False
        self._free = float("-inf")  # when all messages so far would have arrived at that rate

    def wait(self, now: float, count: float = 1.0) -> float:
        """Return the seconds to wait after a message, or several, that arrived `now`."""
        self._free = max(self._free, now) + count / self._rate
        pause = max(0.0, self._free - now - 2.0)
        words = (
            f"wanted at most {self._rate:g} messages a second; more are read later {limit_hint('max_rate')}"
        )
        self.notice = words if pause and not self._was_limited else None
        self._was_limited = bool(pause)
        return pause

    async def pause(self, warn: Callable[[str], None], count: float = 1.0) -> None:
        """Wait as long as the message that was just read, or several, demand.

        Others run in between also if that is 0: one read may hold many messages, which must not delay the
        frames of other clients.
        """
        seconds = self.wait(asyncio.get_running_loop().time(), count)
        if self.notice is not None:
            warn(self.notice)
        await asyncio.sleep(seconds)
