"""Detection of sessions that another process has taken over."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterable
from itertools import islice

from realizer.server.journal import Journal, JournalError
from realizer.server.session.session import Session

log = logging.getLogger(__name__)

# So many are asked for at a time, in a millisecond or two: whose frames are due is not kept waiting longer.
BATCH = 100


async def taken_over(journal: Journal, sessions: Iterable[Session]) -> list[Session]:
    """Those that another process has now. It is asked for in a thread: a store may hang.

    Args:
        sessions: any; only those with a name can be another's.
    """
    loop = asyncio.get_running_loop()
    named = iter([session for session in sessions if session.named and not session.closed])
    found: list[Session] = []
    while batch := {session.id: session for session in islice(named, BATCH)}:
        try:
            gone = await loop.run_in_executor(None, journal.taken_over, batch.keys())
        except JournalError as error:
            log.warning("who has which session is not known: %s", error)
            break
        # Meanwhile one may have been found out by writing.
        found += [batch[id] for id in gone if not batch[id].closed]
    return found
