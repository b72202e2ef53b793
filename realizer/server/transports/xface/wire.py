"""Xface messages: XML and framing."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import IntEnum


class Status(IntEnum):
    """What a note says of a task; of the eight that there are, those that are ever sent."""

    UNKNOWN = 0
    QUEUED = 1
    STARTED = 2
    FINISHED = 3
    ERROR = 7


@dataclass(frozen=True, slots=True)
class Task:
    """What a client asks for. `owner` 0 wants no notes; `id` is of the client's choice."""

    name: str
    owner: int = 0
    id: int = 0
    params: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Note:
    """What the player says of a task."""

    name: str
    owner: int
    id: int
    status: int


_NOTE = re.compile(
    rb'<notify name="([^"<>]{1,64})" ownerId="(\d{1,9})" taskId="(\d{1,9})" status="(\d{1,3})"\s*/>'
)
LONGEST_NOTE = 4096  # bytes


def pack_note(name: str, owner: int, task: int, status: int) -> bytes:
    """A note as the player writes it, to the blank; clients compare it with a pattern."""
    return f'<notify name="{name}" ownerId="{owner}" taskId="{task}" status="{int(status)}"/>\0\0'.encode()


def pack_task(task: Task) -> bytes:
    """A task as clients of the player write it: its params as they are, one NUL at the end."""
    params = "".join(f"<param>{param}</param>" for param in task.params)
    return f'<task name="{task.name}" ownerId="{task.owner}" taskId="{task.id}">{params}</task>\0'.encode()


def read_notes(data: bytearray) -> list[Note]:
    """The whole notes at the beginning of what a player sent; they are taken out of `data`."""
    notes: list[Note] = []
    end = 0
    for found in _NOTE.finditer(data):
        name, *numbers = found.groups()
        notes.append(Note(name.decode("utf-8", "replace"), *map(int, numbers)))
        end = found.end()
    del data[:end]
    if len(data) > LONGEST_NOTE:  # none of it is a note
        del data[: len(data) - 200]  # but its end may be the beginning of one
    return notes
