"""The garbage collection policy of the service: full collections are rare."""

from __future__ import annotations

import gc

from realizer.server.documents.limits import memory

# Connections that have ended leave cycles behind, which are looked for when there are so many of them, and as
# many as have not ended.
ENDED = 100
# Whatever else leaves some is noticed by what the process takes: so much more than when they were looked for.
GROWN, MORE = 1.5, 100e6  # bytes


def disable_automatic_gc() -> None:
    """Let Python look for no cycles of its own accord.

    What plays leaves none behind; among the objects of a thousand sessions a search takes a quarter of a
    second, and even of the new ones 10 ms.
    """
    gc.collect()
    gc.freeze()  # tables and faces stay as long as the service
    gc.disable()


class GcPolicy:
    """Looks for cycles where there may be many.

    Attributes:
        ended_connections: connections that have ended since.
    """

    def __init__(self) -> None:
        self.ended_connections = 0
        self._least = memory()

    def collect_if_needed(self, alive: int) -> bool:
        """Free what nothing else holds, if it is time; whether it was.

        Args:
            alive: how many connections there are.
        """
        used = memory()
        self._least = min(self._least, used)
        if self.ended_connections < max(ENDED, alive) and used < GROWN * self._least + MORE:
            return False
        gc.collect()
        self.ended_connections, self._least = 0, memory()
        return True
