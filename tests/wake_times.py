"""Computes when a session must be ticked, for tests that run a session without the service around it."""

from __future__ import annotations

import math

from realizer.server.session.session import Session

__all__ = ["next_wake"]


def next_wake(session: Session) -> float:
    """Return when `tick` is due on the caller's clock: -inf if a document waits, inf if nothing is due."""
    return -math.inf if session.has_documents else session.next_due()
