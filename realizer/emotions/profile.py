"""Profiles: expressions as ranges of FAPs, and their files in the format of Paul (2010, 6.3)."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from realizer import tables
from realizer.core.array_types import Float32

RANGE = re.compile(r"\s*F(\d{1,3})\s*\[\s*([^,\[\]]+),([^,\[\]]+)\]\s*")
OUTER = 47  # difference between FAPs of the outer and the inner lips (ISO/IEC 14496-2 annex C)


@dataclass(frozen=True)
class Profile:
    """The ranges of the FAPs that an expression moves (Raouzaiou et al. 2002, section 2).

    Attributes:
        name: name such as "fear 8".
        source: "own", "published", "raw", or another source.
        ranges: FAP 3..68 -> (low, high) in FAPU, sorted by FAP.

    Raises:
        ValueError: an invalid FAP or range.
    """

    name: str
    source: str
    ranges: Mapping[int, tuple[float, float]]

    def __post_init__(self) -> None:
        for fap, (low, high) in self.ranges.items():
            if not 3 <= fap <= 68:
                raise ValueError(f"{self.name}: wanted a FAP 3..68, got {fap}")
            if not (math.isfinite(low) and math.isfinite(high) and low <= high):
                raise ValueError(f"{self.name}, FAP {fap}: wanted low <= high, finite, got [{low}, {high}]")
        ordered = {fap: self.ranges[fap] for fap in sorted(self.ranges)}
        object.__setattr__(self, "ranges", MappingProxyType(ordered))

    def __hash__(self) -> int:
        return hash((self.name, self.source, tuple(self.ranges.items())))

    def __str__(self) -> str:
        """Return the notation of Paul 2010, figure 6.5: F3 [400, 560], F5 [-240, -160]."""
        return ", ".join(
            f"F{fap} [{_plain(low)}, {_plain(high)}]" for fap, (low, high) in self.ranges.items()
        )

    @classmethod
    def parse(cls, text: str, name: str = "profile", source: str = "text") -> Profile:
        """Parse such a text; the ends of a range may be in any order.

        Raises:
            ValueError: an invalid range or a repeated FAP, with its place in the text.
        """
        ranges: dict[int, tuple[float, float]] = {}
        place = 0
        while place < len(text.rstrip()):
            match = RANGE.match(text, place)
            if match is None:
                raise ValueError(
                    f"{name}, column {place + 1}: wanted F3 [low, high], got {text[place:][:30]!r}"
                )
            fap = int(match[1])
            try:
                low, high = sorted((float(match[2]), float(match[3])))
            except ValueError:
                raise ValueError(f"{name}, F{fap}: wanted two numbers, got {match[0].strip()!r}") from None
            if fap in ranges:
                raise ValueError(f"{name}: wanted each FAP once, got F{fap} twice")
            ranges[fap] = low, high
            place = match.end()
            if place < len(text) and text[place] != ",":
                raise ValueError(f"{name}, column {place + 1}: wanted a comma, got {text[place:][:30]!r}")
            place += 1
        return cls(name, source, ranges)

    def midpoint(self) -> dict[int, float]:
        """Return FAP -> middle of its range."""
        return {fap: (low + high) / 2 for fap, (low, high) in self.ranges.items()}

    def frame(self) -> Float32:
        """Return the middle of each range, (68,) with column = FAP - 1, and 0 for other FAPs."""
        return _frame(self.midpoint())

    def draw(self, seed: int | np.random.Generator) -> Float32:
        """Return a random value in each range, (68,), so that expressions vary.

        Both sides of the face, and the inner and outer points of a lip, have values at the same place of
        their ranges, to keep the face whole.
        """
        rng = np.random.default_rng(seed)
        parts: dict[int, float] = {}
        values = {}
        for fap, (low, high) in self.ranges.items():
            group = _group(fap)
            if group not in parts:
                parts[group] = float(rng.uniform())
            values[fap] = low + (high - low) * parts[group]
        return _frame(values)

    def scaled(self, factor: float, name: str | None = None) -> Profile:
        """Return the profile with every range multiplied by `factor`, 0 or more."""
        if not (math.isfinite(factor) and factor >= 0):
            raise ValueError(f"{self.name}: wanted a factor of 0 or more, got {factor}")
        ranges = {fap: (low * factor, high * factor) for fap, (low, high) in self.ranges.items()}
        return Profile(name or self.name, self.source, ranges)


def split_number(name: str) -> tuple[str, int | None]:
    """Split the name of a profile, "fear 8", into "fear" and 8; the number of other names is None."""
    emotion, _, number = name.rpartition(" ")
    return (emotion, int(number)) if emotion and number.isdecimal() and len(number) < 10 else (name, None)


def _group(fap: int) -> int:
    """Return the number of a group of FAPs: mirror images, and inner and outer points of a lip."""
    inner = fap - OUTER if 4 <= fap - OUTER <= 13 else fap
    return min(inner, tables.faps()[inner - 1].mirror)


def _frame(values: Mapping[int, float]) -> Float32:
    frame = np.zeros(68, np.float32)
    for fap, value in values.items():
        frame[fap - 1] = value
    return frame


def _plain(value: float) -> str:
    return f"{round(value, 3) + 0.0:.7g}"  # + 0.0 turns -0.0 into 0.0


def read_profiles(text: str, where: str = "profiles") -> tuple[Profile, ...]:
    """Parse the profiles of a file: each is a line with an emotion and a number, and a line of ranges.

    Empty lines and lines that begin with # are ignored.

    Args:
        where: name of the file in messages.

    Raises:
        ValueError: an invalid line; the text names it.
    """
    found: dict[str, Profile] = {}
    label = ""
    for number, line in enumerate(text.splitlines(), 1):
        if not (line := line.strip()) or line.startswith("#"):
            continue
        if label:
            try:
                found[label] = Profile.parse(line, label, where)
            except ValueError as error:
                raise ValueError(f"{where}, line {number}: {error}") from None
            label = ""
            continue
        emotion, _, index = line.rpartition(" ")
        if not emotion.strip() or not index.isdecimal():
            raise ValueError(f"{where}, line {number}: wanted an emotion and a number, got {line[:60]!r}")
        label = f"{emotion.strip()} {int(index)}"
        if label in found:
            raise ValueError(f"{where}, line {number}: {label} is there twice")
    if label:
        raise ValueError(f"{where}: wanted a line of ranges after {label!r}, got the end")
    return tuple(found.values())


def write_profiles(profiles: Iterable[Profile]) -> str:
    """Return the text of a profile file; a profile without a number gets 0."""
    lines = []
    for profile in profiles:
        label = profile.name if split_number(profile.name)[1] is not None else f"{profile.name} 0"
        lines += [label[:1].upper() + label[1:], str(profile)]
    return "\n".join(lines) + "\n"
