"""A session in, when it is to be woken out: what the shell asks it, for those who drive one by themselves."""

from __future__ import annotations

import math

from realizer.server.session.session import Session

__all__ = ["wakes"]


def wakes(session: Session) -> float:
    """When `tick` is wanted, on the caller's clock: at once while it can read; infinite: never."""
    return -math.inf if session.has_documents else session.next_due()
