"""Xface messages: XML and framing."""

import re
from dataclasses import dataclass
from enum import IntEnum


class Status(IntEnum):
    """The status of a task in a note: those of the protocol's eight that are ever sent."""

    UNKNOWN = 0
    QUEUED = 1
    STARTED = 2
    FINISHED = 3
    ERROR = 7


@dataclass(frozen=True, slots=True)
class Task:
    """A task from a client. With `owner` 0 it gets no notes; the client chooses `id`."""

    name: str
    owner: int = 0
    id: int = 0
    params: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Note:
    """A note of the player about a task."""

    name: str
    owner: int
    id: int
    status: int


_NOTE = re.compile(
    rb'<notify name="([^"<>]{1,64})" ownerId="(\d{1,9})" taskId="(\d{1,9})" status="(\d{1,3})"\s*/>'
)
LONGEST_NOTE = 4096  # bytes


def pack_note(name: str, owner: int, task: int, status: int) -> bytes:
    """Return a note exactly as the player writes it: clients match it with a pattern."""
    return f'<notify name="{name}" ownerId="{owner}" taskId="{task}" status="{int(status)}"/>\0\0'.encode()


def pack_task(task: Task) -> bytes:
    """Return a task as clients of the player write it: unescaped params, and a NUL at the end."""
    params = "".join(f"<param>{param}</param>" for param in task.params)
    return f'<task name="{task.name}" ownerId="{task.owner}" taskId="{task.id}">{params}</task>\0'.encode()


def read_notes(data: bytearray) -> list[Note]:
    """Return the complete notes of a player, and remove them from `data`."""
    notes: list[Note] = []
    end = 0
    for match in _NOTE.finditer(data):
        name, *numbers = match.groups()
        notes.append(Note(name.decode("utf-8", "replace"), *map(int, numbers)))
        end = match.end()
    del data[:end]
    if len(data) > LONGEST_NOTE:  # not a note; its end may be the beginning of one
        del data[: len(data) - 200]
    return notes
