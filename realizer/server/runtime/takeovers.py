"""Detection of sessions that another process has taken over."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterable
from itertools import islice

from realizer.server.journal import Journal, JournalError
from realizer.server.session.session import Session

log = logging.getLogger(__name__)

# A query for so many sessions takes a millisecond or two, which delays no frame.
BATCH = 100


async def taken_over(journal: Journal, sessions: Iterable[Session]) -> list[Session]:
    """Return those of the named sessions that another process has taken over.

    The journal is queried in a thread, because a server may hang.
    """
    loop = asyncio.get_running_loop()
    named = iter([session for session in sessions if session.named and not session.closed])
    lost: list[Session] = []
    while batch := {session.id: session for session in islice(named, BATCH)}:
        try:
            ids = await loop.run_in_executor(None, journal.taken_over, batch.keys())
        except JournalError as error:
            log.warning("sessions that other processes have taken over are not known: %s", error)
            break
        # A failed write may have closed one meanwhile.
        lost += [batch[id] for id in ids if not batch[id].closed]
    return lost
