"""When Python's garbage is collected in the service."""

import gc

from realizer.server.documents.limits import memory

# Closed connections leave cycles: a collection is due after this many, or as many as are still open.
ENDED = 100
# Other cycles show in the memory of the process: it has grown to this factor and by these bytes, and by the
# most that a behaviour takes which plays or is planned. While ten thousand play, a collection takes long.
GROWN, MORE, PLAYED = 1.5, 100e6, 35e3


def disable_automatic_gc() -> None:
    """Disable Python's automatic collections.

    Playing leaves no cycles, and a full collection among the objects of a thousand sessions takes a quarter
    of a second, one of the youngest generation 10 ms.
    """
    gc.collect()
    gc.freeze()  # tables and faces live as long as the service
    gc.disable()


class GcPolicy:
    """A policy of full collections, for when there may be many cycles."""

    def __init__(self) -> None:
        self.ended_connections = 0
        self._least = memory()

    def collect_if_needed(self, alive: int, behaviours: int = 0) -> bool:
        """Run a full collection if one is due. Return whether it was.

        Args:
            alive: number of open connections.
            behaviours: number of behaviours of all blocks.
        """
        used = memory()
        self._least = min(self._least, used)
        most = GROWN * self._least + MORE + PLAYED * behaviours
        if self.ended_connections < max(ENDED, alive) and used < most:
            return False
        gc.collect()
        self.ended_connections, self._least = 0, memory()
        return True
