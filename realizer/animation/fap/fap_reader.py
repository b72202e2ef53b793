"""A tolerant reader of MPEG-4 FAP text files, with warnings."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from realizer.animation.fap.fap_clip import FAPClip
from realizer.core.array_types import Bool
from realizer.core.errors import RealizerError
from realizer.tables import faps

FPS = 25.0  # of files without a header: the rate of Xface and Greta
MASK = 68
COLUMNS = (MASK, 69)  # Greta writes a null FAP 0 first
WIDTHS = {1: (4, 1), 2: (6, 1)}  # numbers in a compound FAP; Greta and Xface write one
COMPOUND = {1: 69, 2: 73}  # the columns of their numbers, after those of FAP 0 to 68
INT32 = 2**31 - 1
# Frame numbers may be absolute on a sender's clock, but a clip this sparse is damaged, not long.
SPARSEST = 50


@dataclass
class _Frame:
    number: int
    line: int
    layout: _Layout
    numbers: list[int]


@dataclass
class _Notes:
    """Deviations from the format: each kind with the lines in which it occurs."""

    found: dict[str, list[int]] = field(default_factory=dict)

    def add(self, text: str, line: int = 0) -> None:
        self.found.setdefault(text, []).append(line)

    def sentences(self) -> tuple[str, ...]:
        out = []
        for says, lines in self.found.items():
            where = f"line {lines[0]}: " if lines[0] else ""
            often = f" ({len(lines)} times)" if len(lines) > 1 else ""
            out.append(f"{where}{says}{often}")
        return tuple(out)


def read_fap(text: str | bytes) -> FAPClip:
    """Parse a text FAP file; the clip's `notes` list deviations from the format.

    Tolerates comments, a byte order mark, CRLF, tabs, a missing header or last newline, names with blanks or
    paths, 69 columns, masks that vary, frame numbers that start anywhere or have gaps, compound FAPs as one
    number, floats and garbage (0) for integers, values out of range, a wrong frame count, and frames that
    span lines. A FAP that a frame does not specify is neutral, as in other readers. Version 2.0 is read like
    2.1.

    Raises:
        RealizerError: if the text is a body animation (version 3.x), or a line is neither mask nor values.
    """
    if isinstance(text, bytes):
        text = text.decode("utf-8", "replace")
    notes = _Notes()
    text = text.lstrip("\ufeff").replace("\0", "")
    lines = [(number, line.split()) for number, line in enumerate(text.splitlines(), 1) if line.split()]
    if any(words[0].startswith("#") for _, words in lines):
        lines = [(number, words) for number, words in lines if not words[0].startswith("#")]
    name, fps, count, lines = _header(lines, text, notes)
    try:
        pairs = list(_pairs(lines))
    except RealizerError:
        if (stream := _stream(lines)) is None:
            raise
        pairs = stream
        notes.add("frames are not lines; read as one stream of numbers, as Xface does", lines[0][0])
    frames = [_frame(mask, values, notes) for mask, values in pairs]
    if count is not None and count != len(frames):
        notes.add(f"the header says {count} frames, the file has {len(frames)}", 1)
    return _clip(name, fps, frames, notes)


Line = tuple[int, list[str]]


def _header(lines: list[Line], text: str, notes: _Notes) -> tuple[str, float, int | None, list[Line]]:
    """Return name, rate, frame count and the lines after the header; its last two numbers are the latter."""
    if not lines or _is_mask(lines[0][1]):
        notes.add("no header; taken as 25 frames a second")
        return "", FPS, None, lines
    number, words = lines[0]
    version, rest = words[0], words[1:]
    if re.fullmatch(r"3(\.\d+)?", version):
        raise RealizerError(
            f"line {number}: wanted FAP version 2.0 or 2.1, got {version}: body animation (BAP)"
        )
    if not re.fullmatch(r"\d+(\.\d+)*", version):
        raise RealizerError(f"line {number}: wanted a header '2.1 NAME FPS COUNT' or a mask, got {version!r}")
    if version != "2.1":
        notes.add(f"version {version}, read like 2.1", number)
    numbers: list[float] = []
    while rest and len(numbers) < 2 and (value := _number(rest[-1])) is not None:
        numbers.insert(0, value)
        rest.pop()
    if len(rest) != 1:
        notes.add("the name has blanks" if rest else "the header has no name", number)
    fps, count = FPS, None
    if len(numbers) == 2:
        fps, count = numbers[0], int(min(max(numbers[1], 0), INT32))
    elif numbers:
        notes.add("wanted FPS and COUNT at the end of the header, got one number", number)
        fps = numbers[0]
    else:
        notes.add("wanted FPS and COUNT at the end of the header, got none", number)
    if not fps > 0:
        notes.add(f"wanted a positive frame rate, got {fps:g}; taken as 25", number)
        fps = FPS
    return " ".join(rest), fps, count, lines[1:]


def _pairs(lines: list[Line]) -> Iterator[tuple[Line, Line]]:
    """Yield mask and values of each frame, ignoring a mask without values at the end of a truncated file."""
    for k in range(0, len(lines) - 1, 2):
        mask, values = lines[k], lines[k + 1]
        if not _is_mask(mask[1]):
            raise RealizerError(f"line {mask[0]}: wanted a mask of 68 columns, got {len(mask[1])}")
        yield mask, values
    if len(lines) % 2 and not _is_mask(lines[-1][1]):
        raise RealizerError(f"line {lines[-1][0]}: wanted a mask of 68 columns, got {len(lines[-1][1])}")


def _stream(lines: list[Line]) -> list[tuple[Line, Line]] | None:
    """Return mask and values of each frame, ignoring line ends, or None if the numbers do not fit."""
    words = [(number, word) for number, line in lines for word in line]
    pairs: list[tuple[Line, Line]] = []
    at = 0
    while at < len(words):
        mask = [word for _, word in words[at : at + MASK]]
        if len(mask) < MASK or not _is_mask(mask):
            return None
        used = [fap for fap, bit in enumerate(mask, 1) if int(bit) != 0]
        count = 1 + sum(WIDTHS[fap][0] if fap in WIDTHS else 1 for fap in used)
        values = words[at + MASK : at + MASK + count]
        if len(values) < count:
            return None
        pairs.append(((words[at][0], mask), (values[0][0], [word for _, word in values])))
        at += MASK + count
    return pairs


def _frame(mask: Line, values: Line, notes: _Notes) -> _Frame:
    if len(mask[1]) == 69:
        notes.add("the mask has 69 columns; the first is taken as a null FAP 0", mask[0])
    line, words = values
    number, *numbers = _integers(words, notes, line)
    layout = _layout(tuple(mask[1]), len(numbers))
    if layout.note:
        notes.add(layout.note, line)
    return _Frame(number, line, layout, numbers)


@dataclass(frozen=True, eq=False)
class _Layout:
    """The columns of the numbers of a frame."""

    used: npt.NDArray[np.intp]  # the FAPs in the mask
    columns: npt.NDArray[np.intp]  # for each number, its FAP, or its column in FAP 1 or 2 (see `COMPOUND`)
    note: str  # the deviation from the format, or ""


@lru_cache(maxsize=64)
def _layout(mask: tuple[str, ...], available: int) -> _Layout:
    """Return the layout of frames; nearly all frames of a file have the same."""
    used = [fap for fap, bit in enumerate(mask, 69 - len(mask)) if int(bit) != 0]
    widths, says = _widths(used, available), ""
    if widths is None:
        widths = dict.fromkeys(used, 1)
        says = f"wanted {len(used)} values, got {available}"
    elif any(widths[fap] == 1 for fap in (1, 2) if fap in widths):
        says = "a compound FAP as one number"
    columns: list[int] = []
    for fap in used:
        columns += [fap] if fap not in COMPOUND else list(range(COMPOUND[fap], COMPOUND[fap] + widths[fap]))
    return _Layout(np.array(used, np.intp), np.array(columns[:available], np.intp), says)


def _widths(used: list[int], available: int) -> dict[int, int] | None:
    """Return how many numbers each FAP has so that all are used, or None if there is no solution."""
    simple = sum(1 for fap in used if fap not in WIDTHS)
    for viseme in WIDTHS[1] if 1 in used else (0,):
        for expression in WIDTHS[2] if 2 in used else (0,):
            if simple + viseme + expression == available:
                return {fap: {1: viseme, 2: expression}.get(fap, 1) for fap in used}
    return None


def _clip(name: str, fps: float, frames: list[_Frame], notes: _Notes) -> FAPClip:
    places = _places(frames, notes)
    count = max(places, default=-1) + 1
    numbers = np.zeros((count, 79), np.int64)
    given = np.zeros((count, 69), bool)
    for frame, place in zip(frames, places, strict=True):
        columns = frame.layout.columns
        numbers[place], given[place] = 0, False
        numbers[place, columns] = frame.numbers[: len(columns)]
        given[place, frame.layout.used] = True
    seen = given[[*places]] if places else given
    if len(seen) and not (seen == seen[0]).all():
        notes.add("the mask varies; FAPs that a frame omits are neutral")
    values = numbers[:, 1:69]
    _note_ranges(values, notes)
    used: Bool = np.asarray(given[:, 1:].any(axis=0))
    visemes, expressions = np.split(numbers[:, 69:].astype(np.int32), [4], axis=1)
    return FAPClip(name, fps, values.astype(np.int32), used, visemes, expressions, notes.sentences())


def _places(frames: list[_Frame], notes: _Notes) -> list[int]:
    """Return the position of each frame: its number relative to the least one."""
    if not frames:
        return []
    least = min(frame.number for frame in frames)
    if least != 0:
        notes.add(f"frames are numbered from {least}", frames[0].line)
    places = [frame.number - least for frame in frames]
    if len(set(places)) < len(places):
        notes.add("a frame number occurs twice; the later frame is used")
    if max(places) >= SPARSEST * len(frames):
        notes.add("frame numbers are far apart; frames are used in the order of the file")
        return list(range(len(frames)))
    if len(set(places)) <= max(places):
        notes.add("frame numbers have gaps; missing frames are neutral")
    return places


def _note_ranges(values: np.ndarray[tuple[int, ...], np.dtype[np.int64]], notes: _Notes) -> None:
    rows = faps()
    out = (values < [row.least for row in rows]) | (values > [row.most for row in rows])
    out[:, :2] = False
    names = [rows[column].name for column in np.flatnonzero(out.any(0))]
    if names:
        notes.add(f"values beyond the range of the standard, kept: {', '.join(names)}")


def _is_mask(words: list[str]) -> bool:
    """Return whether words are a mask: entries are 0 or 1 (one other integer counts as 1)."""
    if len(words) not in COLUMNS:
        return False
    others = [word for word in words if word not in ("0", "1")]
    return len(others) <= 1 and all(re.fullmatch(r"[+-]?\d{1,9}", word) for word in others)


def _number(word: str) -> float | None:
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _integers(words: list[str], notes: _Notes, line: int) -> list[int]:
    try:
        numbers = list(map(int, words))
    except ValueError:
        return [_integer(word, notes, line) for word in words]
    if max(numbers) > INT32 or min(numbers) < -INT32:
        return [max(-INT32, min(INT32, number)) for number in numbers]
    return numbers


def _integer(word: str, notes: _Notes, line: int) -> int:
    value = _number(word)
    if value is None:
        notes.add("a value is not a number; taken as 0", line)
        return 0
    if value != int(value):
        notes.add("values are not integers; rounded", line)
    return max(-INT32, min(INT32, round(value)))
