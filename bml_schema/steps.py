"""A hook for programs that count the steps of long reading and writing, or let other work go on meanwhile."""

from collections.abc import Callable
from contextvars import ContextVar

# Called before each behaviour and constraint is read, written or examined.
on_element: ContextVar[Callable[[], object] | None] = ContextVar("on_element", default=None)


def next_element() -> None:
    """Call the hook of this context, if there is one."""
    if (hook := on_element.get()) is not None:
        hook()
