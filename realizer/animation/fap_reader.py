"""MPEG-4 FAP text in, as every known program writes it; a FAPClip and what was odd out."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from realizer.animation.fap_clip import FAPClip
from realizer.arrays import Bool
from realizer.errors import RealizerError
from realizer.tables import faps

__all__ = ["read_fap"]

FPS = 25.0  # where there is no header: the rate of Xface and Greta
COLUMNS = (68, 69)  # Greta writes a null FAP 0 first
WIDTHS = {1: (4, 1), 2: (6, 1)}  # numbers a compound FAP takes; Greta and Xface write one
INT32 = 2**31 - 1
# Frame numbers may be absolute on a sender's clock, but a clip this sparse is damaged, not long.
SPARSEST = 50


@dataclass
class _Frame:
    number: int
    line: int
    groups: dict[int, list[int]]


@dataclass
class _Notes:
    """Each kind of deviation once, with its first line and how often it came."""

    found: dict[str, list[int]] = field(default_factory=dict)

    def add(self, says: str, line: int = 0) -> None:
        self.found.setdefault(says, []).append(line)

    def sentences(self) -> tuple[str, ...]:
        out = []
        for says, lines in self.found.items():
            where = f"line {lines[0]}: " if lines[0] else ""
            often = f" ({len(lines)} times)" if len(lines) > 1 else ""
            out.append(f"{where}{says}{often}")
        return tuple(out)


def read_fap(text: str | bytes) -> FAPClip:
    """The clip of a text FAP file, however odd; `notes` says what was.

    Survives comments, a byte order mark, CRLF, tabs, a missing header or last newline, names with blanks or
    paths, 69 columns, masks that vary, frame numbers that start anywhere or have gaps, compound FAPs as one
    number, floats and rubbish (0) for integers, values out of range, a wrong frame count. Where a frame does
    not give a FAP it is neutral, as all readers have it. Version 2.0 is read like 2.1.

    Raises:
        RealizerError: no FAP text: a body animation (version 3.x), or a line that is neither mask nor values.
    """
    if isinstance(text, bytes):
        text = text.decode("utf-8", "replace")
    notes = _Notes()
    text = text.lstrip("\ufeff").replace("\0", "")
    lines = [(number, line.split()) for number, line in enumerate(text.splitlines(), 1) if line.split()]
    if any(words[0].startswith("#") for _, words in lines):
        lines = [(number, words) for number, words in lines if not words[0].startswith("#")]
    name, fps, count, lines = _header(lines, text, notes)
    frames = [_frame(mask, values, notes) for mask, values in _pairs(lines)]
    if count is not None and count != len(frames):
        notes.add(f"the header says {count} frames, there are {len(frames)}", 1)
    return _clip(name, fps, frames, notes)


Line = tuple[int, list[str]]


def _header(lines: list[Line], text: str, notes: _Notes) -> tuple[str, float, int | None, list[Line]]:
    """Name, rate, frame count and the lines after the header; the last two numbers of it count."""
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
    """Mask and values of each frame; a mask without values at the end of a cut-off file is left out."""
    for k in range(0, len(lines) - 1, 2):
        mask, values = lines[k], lines[k + 1]
        if not _is_mask(mask[1]):
            raise RealizerError(f"line {mask[0]}: wanted a mask of 68 columns, got {len(mask[1])}")
        yield mask, values
    if len(lines) % 2 and not _is_mask(lines[-1][1]):
        raise RealizerError(f"line {lines[-1][0]}: wanted a mask of 68 columns, got {len(lines[-1][1])}")


def _frame(mask: Line, values: Line, notes: _Notes) -> _Frame:
    columns = mask[1]
    first = 1
    if len(columns) == 69:
        notes.add("the mask has 69 columns; the first is taken as a null FAP 0", mask[0])
        first = 0
    used = [fap for fap, bit in enumerate(columns, first) if _bit(bit)]
    line, words = values
    number, numbers = _integer(words[0], notes, line), [_integer(w, notes, line) for w in words[1:]]
    widths = _widths(used, len(numbers))
    if widths is None:
        widths = dict.fromkeys(used, 1)
        notes.add(f"wanted {len(used)} values, got {len(numbers)}", line)
    elif any(widths[fap] == 1 for fap in (1, 2) if fap in widths):
        notes.add("a compound FAP as one number", line)
    groups, at = {}, 0
    for fap in used:
        groups[fap] = numbers[at : at + widths[fap]] or [0]
        at += widths[fap]
    return _Frame(number, line, groups)


def _widths(used: list[int], available: int) -> dict[int, int] | None:
    """How many numbers each FAP takes so that all are used up; None where no reading fits."""
    simple = sum(1 for fap in used if fap not in WIDTHS)
    for viseme in WIDTHS[1] if 1 in used else (0,):
        for expression in WIDTHS[2] if 2 in used else (0,):
            if simple + viseme + expression == available:
                return {fap: {1: viseme, 2: expression}.get(fap, 1) for fap in used}
    return None


def _clip(name: str, fps: float, frames: list[_Frame], notes: _Notes) -> FAPClip:
    places = _places(frames, notes)
    count = max(places, default=-1) + 1
    values = np.zeros((count, 69), np.int64)
    compound = {1: np.zeros((count, 4), np.int32), 2: np.zeros((count, 6), np.int32)}
    given = np.zeros((count, 69), bool)
    for frame, place in zip(frames, places, strict=True):
        values[place], given[place] = 0, False
        for fap, numbers in frame.groups.items():
            given[place, fap] = True
            if fap in compound:
                compound[fap][place] = 0
                compound[fap][place, : len(numbers)] = numbers
            else:
                values[place, fap] = numbers[0]
    seen = given[[*places]] if places else given
    if len(seen) and not (seen == seen[0]).all():
        notes.add("the mask varies; where a frame does not give a FAP it is neutral")
    _note_ranges(values[:, 1:], notes)
    used: Bool = np.asarray(given[:, 1:].any(axis=0))
    integers = values[:, 1:].astype(np.int32)
    return FAPClip(name, fps, integers, used, compound[1], compound[2], notes.sentences())


def _places(frames: list[_Frame], notes: _Notes) -> list[int]:
    """Where each frame goes, from its number relative to the least one."""
    if not frames:
        return []
    least = min(frame.number for frame in frames)
    if least != 0:
        notes.add(f"frames are numbered from {least}", frames[0].line)
    places = [frame.number - least for frame in frames]
    if len(set(places)) < len(places):
        notes.add("a frame number comes twice; the later frame counts")
    if max(places) >= SPARSEST * len(frames):
        notes.add("frame numbers jump wildly; taken in the order of the file")
        return list(range(len(frames)))
    if len(set(places)) <= max(places):
        notes.add("frame numbers have gaps; frames in between are neutral")
    return places


def _note_ranges(values: np.ndarray[tuple[int, ...], np.dtype[np.int64]], notes: _Notes) -> None:
    rows = faps()
    out = (values < [row.least for row in rows]) | (values > [row.most for row in rows])
    out[:, :2] = False
    names = [rows[column].name for column in np.flatnonzero(out.any(0))]
    if names:
        notes.add(f"values beyond the range of the standard, kept: {', '.join(names)}")


def _is_mask(words: list[str]) -> bool:
    return len(words) in COLUMNS and all(re.fullmatch(r"[+-]?\d+", word) for word in words) and _small(words)


def _small(words: list[str]) -> bool:
    """Mask entries are 0 or 1 (not 0 counts as 1); a line of values has others."""
    return sum(word not in ("0", "1") for word in words) <= 1


def _bit(word: str) -> bool:
    return int(word) != 0


def _number(word: str) -> float | None:
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _integer(word: str, notes: _Notes, line: int) -> int:
    value = _number(word)
    if value is None:
        notes.add("a value is no number, taken as 0", line)
        return 0
    if value != int(value):
        notes.add("values are not whole, rounded", line)
    return max(-INT32, min(INT32, round(value)))
