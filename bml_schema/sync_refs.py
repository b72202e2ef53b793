"""Sync references such as `b1:head1:stroke + 0.5`: parser, value and writer."""

import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from bml_schema.errors import did_you_mean, quoted
from bml_schema.node_schema import node
from bml_schema.values import MAX_SECONDS, NUMBER, decimal, describe_mismatch

# Sync points of the core. In the middle of three names, one of these is not a behaviour's id.
_POINTS = frozenset({"start", "ready", "strokeStart", "stroke", "strokeEnd", "attackPeak", "relax", "end"})
_LONGEST = 1000  # characters of a reference: two ids of 256, a sync id, an offset
_WANTED = 'a number of seconds or a reference such as "behaviour:sync + 0.5"'
_UNSIGNED = re.compile(r"[0-9]+(?:\.[0-9]*)?|\.[0-9]+")
_PLAIN = re.compile(r"([^:+\-\s]+)\s*([+-])\s*([0-9]+(?:\.[0-9]*)?|\.[0-9]+)")
_OFFSET_LIKE = re.compile(r".*[+-]\s*(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)")


@node
class SyncRef:
    """A point in time in a document."""

    block: str | None = None  # another block's id; None for the own block
    behaviour: str | None = None  # a behaviour's id, "bml" for the block itself, None for a plain number
    sync: str | None = None  # sync point name; None for a plain number
    index: int | None = None  # n of "stroke:n", counted from 1, or None
    offset: float = 0.0  # seconds after that point; for a plain number, seconds after block start

    @property
    def point(self) -> str:
        """The sync point with its index, such as "stroke:2"; "" if the reference is a number."""
        return f"{self.sync}:{self.index}" if self.index is not None else self.sync or ""

    def __str__(self) -> str:
        if self.behaviour is None or self.sync is None:
            return decimal(self.offset)
        point = ":".join(filter(None, (self.block, self.behaviour, self.point)))
        # Blanks around the sign, because ids may hold hyphens; "+ 0" if the name ends like an offset.
        if self.offset or _OFFSET_LIKE.fullmatch(point):
            point += f" {'-' if self.offset < 0 else '+'} {decimal(abs(self.offset))}"
        return point


class Points(NamedTuple):
    """The sync points of one behaviour, and how many strokes it has ("stroke:n")."""

    names: Collection[str]
    strokes: int = 1


@dataclass(slots=True)
class Names:
    """The names that references of one block can use: its id, and the sync points of each behaviour id.

    Points are None for an unknown element: references to it are dropped with it.
    """

    block: str
    points: dict[str, Points | None] = field(default_factory=dict)
    suggestions: int = 10  # "did you mean" is slow, and a document may have many faults

    def suggest(self, word: str, choices: Iterable[str], cutoff: float = 0.6) -> str:
        """Return `, did you mean ...?` or "", and always "" after ten suggestions for one document."""
        if self.suggestions <= 0:
            return ""
        self.suggestions -= 1
        return did_you_mean(word, choices, cutoff)


def read_sync_ref(text: str, names: Names | None = None) -> SyncRef:
    """Parse a sync reference.

    Ids may hold hyphens and dots: a reading whose names exist takes precedence over one with an offset.
    References into other blocks are not checked; the id of the own block is removed.

    Args:
        text: value of an attribute.
        names: the names of the own block; None checks the grammar only.

    Raises:
        ValueError: not a reference, or no such behaviour or sync point in the own block. The message has
            the expected and the actual value.

    Source: BML 1.0, sync references.
    """
    source, colon, sync = text.partition(":")
    if colon and names is not None and (points := names.points.get(source)):
        # Nearly all references have this form, and their names exist.
        if sync in points.names:
            return SyncRef(behaviour=source, sync=sync)
        plain = _PLAIN.fullmatch(sync)
        if plain and plain[1] in points.names:
            return SyncRef(behaviour=source, sync=plain[1], offset=_seconds(plain[2] + plain[3]))
    text = text.strip()
    if NUMBER.fullmatch(text):
        return SyncRef(offset=_seconds(text))
    if len(text) > _LONGEST:
        raise ValueError(f"wanted at most {_LONGEST} characters, got {len(text)}")
    readings = [r for r in (_point(text, ""), _with_offset(text)) if r is not None]
    if not readings:
        raise ValueError(describe_mismatch(_WANTED, text, quoted(text)))
    if names is None:
        return readings[-1]
    readings = [replace(r, block=None) if r.block == names.block else r for r in readings]
    for reading in readings:
        if reading.block is None and not _missing(reading, names):
            return _single_stroke(reading, names)
    likely = readings[-1]
    if likely.block is None:
        raise ValueError(_missing(likely, names, say=True))
    return likely


# A number as programs write it: a tiny one with an exponent, or with a unit; behind a point with a sign.
_WRITTEN = r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE]-\d{1,3})?"
_UNIT = r"\s*(ms|s|secs?|seconds?)?"
_ALONE = re.compile(rf"()([+-]?)\s*({_WRITTEN}){_UNIT}")
_BEHIND = re.compile(rf"([^\s\d+-].*?)\s*([+-])\s*({_WRITTEN}){_UNIT}")
_POINT = re.compile(r"([A-Za-z_-]+(?::\d{1,6})?)\s*((?:[+-]\s*(?:\d+(?:\.\d*)?|\.\d+))?)")


def respelled(text: str, behaviour: str, points: Iterable[str]) -> str:
    """Return the reference that a program means which writes it in another form, or "".

    Args:
        text: such as "start+1", "1e-05", "500ms" or "s1:end+0.5s".
        behaviour: id of the behaviour whose points may be named without it; "" for none.
        points: the names of its sync points.
    """
    text = text.strip()
    if len(text) > _LONGEST:
        return ""
    meant = text
    if (found := _ALONE.fullmatch(text) or _BEHIND.fullmatch(text)) is not None:
        point, sign, number, unit = found.groups()
        seconds = float(number) * (0.001 if unit == "ms" else 1.0)
        if not seconds <= MAX_SECONDS:
            return ""
        meant = f"{point} {sign} {decimal(seconds)}" if point else f"{sign}{decimal(seconds)}"
    if behaviour and (own := _POINT.fullmatch(meant)) is not None:
        name = own[1].replace("_", "").replace("-", "").lower()
        point = next((point for point in points if point.lower() == name), "")
        meant = f"{behaviour}:{point} {own[2]}".strip() if point else meant
    return "" if meant.replace(" ", "") == text.replace(" ", "") else meant


def _seconds(text: str) -> float:
    value = float(text)
    if not abs(value) <= MAX_SECONDS:
        raise ValueError(f"wanted at most {MAX_SECONDS:g} seconds, got {quoted(text)}")
    return value


def _with_offset(text: str) -> SyncRef | None:
    cut = max(text.rfind("+"), text.rfind("-"))
    tail = text[cut + 1 :].strip()
    if cut < 0 or not _UNSIGNED.fullmatch(tail):
        return None
    return _point(text[:cut], text[cut] + tail)


def _point(text: str, offset: str) -> SyncRef | None:
    """Parse [block:]source:sync[:index] with an offset such as "-0.5" or ""; return None for another form."""
    parts = [p.strip() for p in text.split(":")]
    if not all(parts):
        return None
    index: int | None = None
    if len(parts) in (3, 4) and parts[-2] in _POINTS:
        if parts[-2] != "stroke" or not re.fullmatch(r"0{0,9}[1-9][0-9]{0,5}", parts[-1]):
            return None
        index = int(parts.pop())
    if len(parts) not in (2, 3):
        return None
    *block, behaviour, sync = parts
    return SyncRef(
        block=block[0] if block else None,
        behaviour=behaviour,
        sync=sync,
        index=index,
        offset=_seconds(offset) if offset else 0.0,
    )


def _single_stroke(ref: SyncRef, names: Names) -> SyncRef:
    """Replace stroke:1 of a behaviour with one stroke by stroke."""
    points = names.points.get(ref.behaviour or "")
    is_single = ref.index == 1 and points is not None and points.strokes == 1
    return replace(ref, index=None) if is_single else ref


def _missing(ref: SyncRef, names: Names, say: bool = False) -> str:
    """Return why a reference into the own block is wrong, or ""; a full message only with `say`."""
    source, sync = ref.behaviour or "", ref.sync or ""
    if source == "bml":
        return (
            ""
            if sync == "start" and ref.index is None
            else f'wanted "bml:start", got {quoted(f"bml:{sync}")}'
        )
    if source not in names.points:
        if not say:
            return "unknown"
        near = ', did you mean "bml:start"?' if source == names.block else names.suggest(source, names.points)
        return f"no behaviour {quoted(source)} in this block{near}"
    points = names.points[source]
    if points is None:
        return ""
    if sync not in points.names:
        return f"no sync point {quoted(sync)} on {quoted(source)}" + (
            names.suggest(sync, points.names) if say else ""
        )
    if ref.index is not None and ref.index > points.strokes:
        return f"wanted stroke:1..{points.strokes} of {quoted(source)}, got stroke:{ref.index}"
    return ""
