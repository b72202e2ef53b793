"""The states of a block from its announcement to its end, and the table of the changes between them."""

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType


class State(StrEnum):
    """The state of a block, as BMLA names it."""

    IN_PREP = "IN_PREP"  # announced, and being planned
    PENDING = "PENDING"  # planned, waiting to be activated
    LURKING = "LURKING"  # planned, waiting for its start
    IN_EXEC = "IN_EXEC"  # playing
    SUBSIDING = "SUBSIDING"  # every behaviour is past its relax, some are not past their end
    DONE = "DONE"  # ended by itself
    INTERRUPTED = "INTERRUPTED"  # stopped while it played
    REVOKED = "REVOKED"  # ended before it started


class BlockEvent(StrEnum):
    """An event that changes the state of a block."""

    PREPLAN = "preplan"  # it is accepted as preplanned, and waits for ACTIVATE
    PLAN = "plan"  # it is accepted
    ACTIVATE = "activate"  # by a behaviour, by another block's onStart, or by the client
    START = "start"
    SUBSIDE = "subside"
    END = "end"
    STOP = "stop"  # by the client, another block, or a behaviour


# The only place that decides which state follows; docs/blocks.md draws it.
TRANSITIONS: Mapping[tuple[State, BlockEvent], State] = MappingProxyType(
    {
        (State.IN_PREP, BlockEvent.PREPLAN): State.PENDING,
        (State.IN_PREP, BlockEvent.PLAN): State.LURKING,
        (State.IN_PREP, BlockEvent.STOP): State.REVOKED,
        (State.PENDING, BlockEvent.ACTIVATE): State.LURKING,
        (State.PENDING, BlockEvent.STOP): State.REVOKED,
        (State.LURKING, BlockEvent.START): State.IN_EXEC,
        (State.LURKING, BlockEvent.STOP): State.REVOKED,
        (State.IN_EXEC, BlockEvent.SUBSIDE): State.SUBSIDING,
        (State.IN_EXEC, BlockEvent.END): State.DONE,
        (State.IN_EXEC, BlockEvent.STOP): State.INTERRUPTED,
        (State.SUBSIDING, BlockEvent.END): State.DONE,
        (State.SUBSIDING, BlockEvent.STOP): State.INTERRUPTED,
    }
)


class TransitionError(RuntimeError):
    """An event is impossible in the state of a block: a fault of the realizer, not of a document."""


def next_state(state: State, event: BlockEvent) -> State:
    """Return the state of a block after an event; raise TransitionError if it cannot happen in that state."""
    try:
        return TRANSITIONS[state, event]
    except KeyError:
        raise TransitionError(f"a block that is {state} cannot {event}") from None
