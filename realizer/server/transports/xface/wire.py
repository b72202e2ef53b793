"""Xface messages: their XML, and a parser of tasks in a byte stream."""

import re
from collections.abc import Generator, Iterator
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
        self._items: list[Task | Fault] = []
        self._reading = self._read()

    def feed(self, data: bytes) -> list[Task | Fault]:
        """Return what `data` completes, in order."""
        self._data += data
        next(self._reading)
        items, self._items = self._items, []
        return items

    def _read(self) -> Iterator[None]:
        """Read tasks; yield when more data is needed."""
        while True:
            if (passed := _PASSED.match(self._data)) is not None:
                del self._data[: passed.end()]
            if self._may_begin():
                yield
                continue
            text, tag = yield from self._read_task()
            if text:
                self._items.append(Fault(text, _head(tag)))
                del self._data[:1]  # at least the mark where parsing failed
                while (bound := _BOUND.search(self._data)) is None:
                    del self._data[: max(0, len(self._data) - 5)]
                    yield
                del self._data[: bound.start() if bound[0] != b"\0" else bound.end()]

    def _may_begin(self) -> bool:
        """Whether there may be the beginning of `<task ` or of a declaration, or nothing yet."""
        data = self._data
        if len(data) < 6 and b"<task".startswith(data[:5]):
            return True
        return data.startswith((b"<?", b"\xef")) and len(data) < 200 and b"\0" not in data

    def _read_task(self) -> Generator[None, None, tuple[str, bytes]]:
        """Read one task. Return its fault, or "", and the rest of its start tag."""
        if not _OPEN.match(self._data):
            shown = bytes(self._data[:_SHOWN]).split(b"\0")[0].decode("utf-8", "replace")
            return f"wanted <task name=...>, got {shown!r}", b""
        while (start := _START.match(self._data)) is None:
            bound = _BOUND.search(self._data, 5)
            if (bound.start() if bound is not None else len(self._data)) > LONGEST_TAG:
                return f"wanted <task ...> of at most {LONGEST_TAG} bytes, got more", b""
            if bound is not None:
                return "wanted > at the end of <task, got another beginning", b""
            yield
        tag, begin = start[1], start.end()
        if tag.endswith(b"/"):
            yield from self._take(tag[:-1], b"", begin)
            return "", b""
        too_large = f"wanted a task of at most {self._limit} bytes, got more"
        looked = begin
        while (end := _END.search(self._data, looked)) is None:
            if len(self._data) > self._limit:
                return too_large, tag
            looked = max(begin, len(self._data) - 80)  # part of an end may be there
            yield
        if not end[0].startswith(b"</"):
            got = "a NUL" if end[0] == b"\0" else "another <task"
            return f"wanted </task>, got {got}: half a task", tag
        if end.end() > self._limit:
            return too_large, tag
        yield from self._take(tag, bytes(self._data[begin : end.start()]), end.end())
        return "", b""

    def _take(self, tag: bytes, body: bytes, end: int) -> Iterator[None]:
        """Take a task, and skip the bytes of a file that follow it."""
        del self._data[:end]
        task = replace(_head(tag), params=_params(body.decode("utf-8", "replace")))
        if not task.name:
            got = _values(tag).get("name", "")
            self._items.append(Fault(f"wanted <task> with the name of a task, got {got[:64]!r}", _head(tag)))
            return
        self._items.append(task)
        if task.name != FOLLOWED or len(task.params) != 2:
            return
        size = task.params[1].strip()
        if not (size.isascii() and size.isdecimal() and len(size) < 12 and 0 < int(size) <= self._limit):
            words = f"{FOLLOWED}: wanted 1..{self._limit} bytes to follow, got {size[:20]!r}"
            self._items.append(Fault(words))
            return
        # Behind the terminator of the task; no sound file begins so.
        while len(self._data) < (left := int(size) + (self._data[:1] == b"\0")):
            yield
        del self._data[:left]


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
