"""Names of ARKit's blend shapes, and the spellings that tools use for them."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import Literal

from realizer.tables import read_csv, text_of

SIDES = {"left": "Left", "l": "Left", "right": "Right", "r": "Right"}
LEAST = 6  # letters; a shorter tail of a name says nothing


@dataclass(frozen=True, slots=True)
class Shape:
    """A row of arkit.csv."""

    name: str
    au: int
    side: Literal["L", "R", ""]
    intensity: float
    serves: str
    without: str

    @property
    def faps(self) -> tuple[int, ...]:
        return tuple(int(fap) for fap in self.serves.split())


@cache
def shapes() -> dict[str, Shape]:
    """ARKit's 52 shapes by name."""
    return {row.name: row for row in read_csv(text_of("arkit.csv"), Shape, "arkit.csv")}


@cache
def _known() -> dict[str, str]:
    """Letters of a spelling -> ARKit's name; a half of a shape of both sides adds to the whole."""
    out: dict[str, str] = {}
    for name in shapes():
        found = re.fullmatch(r"(.+)(Left|Right)", name)
        stems = [(found[1], found[2])] if found else [(name, "Left"), (name, "Right")]
        for stem, side in stems:
            for word in (side, side[0]):
                out.setdefault((stem + word).lower(), name)
                out.setdefault((word + stem).lower(), name)
    # Last, so that mouthLeft is itself and no half of another.
    return out | {name.lower(): name for name in shapes()}


def canonical(name: str) -> str | None:
    """ARKit's name of a morph target, or None.

    `mouthSmile_L`, `MouthSmileLeft`, `blendShape1.jawOpen` and `head_eyeBlink.R` are understood.
    """
    words = [word for word in re.split(r"[.:|/]+", name) if word]
    if len(words) > 1 and words[-1].lower() in SIDES:
        words[-2:] = ["".join(words[-2:])]
    for word in reversed(words or [""]):
        letters = re.sub(r"[^a-z0-9]", "", word.lower())
        if letters in _known():
            return _known()[letters]
        # After a prefix such as the mesh's name, the rest must be a whole word.
        pieces = re.findall(r"[A-Z]?[a-z0-9]+|[A-Z]+(?![a-z])", word)
        for k in range(1, len(pieces)):
            tail = "".join(pieces[k:]).lower()
            if len(tail) >= LEAST and tail in _known():
                return _known()[tail]
    return None


def nearest(name: str) -> tuple[str, ...]:
    """ARKit names that look like a name that is none; may be empty."""
    from difflib import get_close_matches

    letters = re.sub(r"[^a-z0-9]", "", re.split(r"[.:|/]", name)[-1].lower())
    found = get_close_matches(letters, list(_known()), n=3, cutoff=0.72)
    return tuple(dict.fromkeys(_known()[one] for one in found))


def group_names(names: Iterable[str]) -> tuple[dict[str, list[str]], tuple[str, ...]]:
    """ARKit name -> the file's names for it; and the names that are none of ARKit's."""
    found: dict[str, list[str]] = {}
    foreign = []
    for name in names:
        known = canonical(name)
        if known is None:
            foreign.append(name)
        else:
            found.setdefault(known, []).append(name)
    return found, tuple(foreign)
