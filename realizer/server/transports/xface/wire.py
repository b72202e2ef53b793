"""Xface messages: their XML, and a parser of tasks in a byte stream."""

import re
from dataclasses import dataclass, replace
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


UNREAD = Task("")


@dataclass(frozen=True, slots=True)
class Fault:
    """A span of the stream that is no task.

    Attributes:
        task: the head of a task that is too large, incomplete, or has an invalid name (then ""); else UNREAD.
    """

    text: str
    task: Task = UNREAD


_OPEN = re.compile(rb"<task(?=[\s/>])")
_START = re.compile(rb"""<task((?:[^<>"']|"[^"<]*"|'[^'<]*')*)>""")
_END = re.compile(rb"</task\s*>|\0|<task(?=[\s/>])")
_PASSED = re.compile(rb"(?:[\s\0]|\xef\xbb\xbf|<\?[^<>]{0,200}\?>)+")
_BOUND = re.compile(rb"\0|<task(?=[\s/>])")
# Possessive, so that a long name is examined only once.
_VALUE = re.compile(r"""(?<![\w:.-])([\w:.-]++)\s*+=\s*(?:"([^"]*)"|'([^']*)')""")
_PARAM = re.compile(r"<param\s*/>|<param\s*>|</param\s*>")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]{0,63}")
LONGEST_TAG = 4096  # bytes
# The only task that is followed by the bytes of a file.
FOLLOWED = "UPLOAD_WAV"
_SHOWN = 60  # bytes of a stray span that its fault quotes


class TaskReader:
    """A parser of the tasks in one byte stream.

    A task ends at `</task>` or `/>`, with or without NULs after it. Any other span gives one Fault; then
    reading resumes after the next NUL or at the next `<task`. The result does not depend on how the stream is
    cut into reads, and each byte is examined a few times at most.

    Args:
        limit: most bytes of a task, and of the content after it.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._data = bytearray()
        self._looked = 0  # the open task has no end before it
        self._lost = False  # inside a span whose fault is reported
        self._size = 0  # bytes of a file that follow a task and are skipped

    def feed(self, data: bytes) -> list[Task | Fault]:
        """Return what `data` completes, in order."""
        self._data += data
        items: list[Task | Fault] = []
        while self._step(items):
            pass
        return items

    def _step(self, items: list[Task | Fault]) -> bool:
        if self._size:
            return self._skip_content()
        if self._lost:
            return self._skip()
        if (passed := _PASSED.match(self._data)) is not None:
            self._drop(passed.end())
        if not self._data:
            return False
        if not _OPEN.match(self._data):
            # It may be the beginning of `<task ` or of a declaration.
            if len(self._data) < 6 and b"<task".startswith(bytes(self._data[:5])):
                return False
            if self._data.startswith((b"<?", b"\xef")) and len(self._data) < 200 and b"\0" not in self._data:
                return False
            shown = bytes(self._data[:_SHOWN]).split(b"\0")[0].decode("utf-8", "replace")
            return self._give_up(f"wanted <task name=...>, got {shown!r}", items)
        return self._in_task(items)

    def _in_task(self, items: list[Task | Fault]) -> bool:
        start = _START.match(self._data)
        if start is None:
            bound = _BOUND.search(self._data, 5)
            if (bound.start() if bound is not None else len(self._data)) > LONGEST_TAG:
                return self._give_up(f"wanted <task ...> of at most {LONGEST_TAG} bytes, got more", items)
            if bound is None:
                return False
            return self._give_up("wanted > at the end of <task, got another beginning", items)
        if start[1].endswith(b"/"):
            self._tell(start[1][:-1], b"", start.end(), items)
            return True
        end = _END.search(self._data, max(start.end(), self._looked))
        if end is None or not end[0].startswith(b"</"):
            if end is not None:
                got = "a NUL" if end[0] == b"\0" else "another <task"
                return self._give_up(f"wanted </task>, got {got}: half a task", items, start[1])
            if len(self._data) > self._limit:
                return self._give_up(self._too_large, items, start[1])
            self._looked = max(start.end(), len(self._data) - 80)  # part of an end may be there
            return False
        if end.end() > self._limit:
            return self._give_up(self._too_large, items, start[1])
        self._tell(start[1], bytes(self._data[start.end() : end.start()]), end.end(), items)
        return True

    def _tell(self, tag: bytes, body: bytes, end: int, items: list[Task | Fault]) -> None:
        self._drop(end)
        task = replace(_head(tag), params=_params(body.decode("utf-8", "replace")))
        if not task.name:
            got = _values(tag).get("name", "")
            items.append(Fault(f"wanted <task> with the name of a task, got {got[:64]!r}", _head(tag)))
            return
        items.append(task)
        if task.name != FOLLOWED or len(task.params) != 2:
            return
        size = task.params[1].strip()
        if not (size.isascii() and size.isdecimal() and len(size) < 12 and 0 < int(size) <= self._limit):
            items.append(Fault(f"{FOLLOWED}: wanted 1..{self._limit} bytes to follow, got {size[:20]!r}"))
            return
        self._size = int(size)

    def _skip_content(self) -> bool:
        size = self._size + (self._data[:1] == b"\0")  # the terminator of the task; no sound file begins so
        if len(self._data) < size:
            return False
        self._drop(size)
        self._size = 0
        return True

    @property
    def _too_large(self) -> str:
        return f"wanted a task of at most {self._limit} bytes, got more"

    def _give_up(self, text: str, items: list[Task | Fault], tag: bytes = b"") -> bool:
        """Report a fault; `tag` is the rest of the start tag of the task that has it."""
        items.append(Fault(text, _head(tag)))
        self._lost = True
        self._drop(1)  # at least the mark where parsing failed
        return True

    def _skip(self) -> bool:
        bound = _BOUND.search(self._data)
        if bound is None:
            self._drop(max(0, len(self._data) - 5))
            return False
        self._lost = False
        self._drop(bound.start() if bound[0] != b"\0" else bound.end())
        return True

    def _drop(self, count: int) -> None:
        del self._data[:count]
        self._looked = 0


def _values(tag: bytes) -> dict[str, str]:
    return {name: one or two for name, one, two in _VALUE.findall(tag.decode("utf-8", "replace"))}


def _head(tag: bytes) -> Task:
    """Return a task without its params; its name is "" if it is invalid."""
    values = _values(tag)
    name = values.get("name", "")
    valid = name if _NAME.fullmatch(name) else ""
    return Task(valid, _number(values.get("ownerId", "")), _number(values.get("taskId", "")))


def _number(text: str) -> int:
    """Return a number, or 0 if it is none, as Xface's own player does."""
    return int(text) if text.isascii() and text.isdecimal() and len(text) < 10 else 0


def _params(body: str) -> tuple[str, ...]:
    """Return the content of each <param>, unchanged; it may be XML, also with params of its own."""
    params: list[str] = []
    depth = begin = 0
    for mark in _PARAM.finditer(body):
        if mark[0].endswith("/>"):
            if depth == 0:
                params.append("")
        elif mark[0].startswith("</"):
            depth -= 1
            if depth == 0:
                params.append(_plain(body[begin : mark.start()]))
            depth = max(depth, 0)
        else:
            if depth == 0:
                begin = mark.end()
            depth += 1
    return tuple(params)


def _plain(text: str) -> str:
    inner = text.strip()
    if inner.startswith("<![CDATA[") and inner.endswith("]]>"):
        return inner[9:-3]
    return text
