"""ARKit's blend shapes, and recognition of their names in the spellings of other tools."""

import re
from dataclasses import dataclass
from functools import cache, partial
from typing import Literal

from realizer.core.similar import similar
from realizer.tables import csv_index

SIDES = {"left": "Left", "l": "Left", "right": "Right", "r": "Right"}
MIN_LETTERS = 6  # of the end of a name; shorter ends are ambiguous


@dataclass(frozen=True, slots=True)
class Shape:
    """A blend shape; the columns are explained in arkit.csv."""

    name: str
    au: int
    side: Literal["L", "R", ""]
    intensity: float
    serves: str
    without: str


shapes = cache(partial(csv_index, "arkit.csv", Shape, "name"))  # () -> ARKit's 52 shapes by name


@cache
def _spellings() -> dict[str, str]:
    """Return lower-case spelling -> ARKit's name; a half of a symmetric shape stands for the whole shape."""
    spellings: dict[str, str] = {}
    for name in shapes():
        match = re.fullmatch(r"(.+)(Left|Right)", name)
        stems = [(match[1], match[2])] if match else [(name, "Left"), (name, "Right")]
        for stem, side in stems:
            for word in (side, side[0]):
                spellings.setdefault((stem + word).lower(), name)
                spellings.setdefault((word + stem).lower(), name)
    # Last, so that mouthLeft is itself and not a half of another shape.
    return spellings | {name.lower(): name for name in shapes()}


def canonical(name: str) -> str | None:
    """Return ARKit's name of a morph target, or None.

    Recognises `mouthSmile_L`, `MouthSmileLeft`, `blendShape1.jawOpen` and `head_eyeBlink.R`.
    """
    words = [word for word in re.split(r"[.:|/]+", name) if word]
    if len(words) > 1 and words[-1].lower() in SIDES:
        words[-2:] = ["".join(words[-2:])]
    for word in reversed(words or [""]):
        letters = re.sub(r"[^a-z0-9]", "", word.lower())
        if letters in _spellings():
            return _spellings()[letters]
        # Skip a prefix such as the mesh's name, but only whole words.
        pieces = re.findall(r"[A-Z]?[a-z0-9]+|[A-Z]+(?![a-z])", word)
        for k in range(1, len(pieces)):
            tail = "".join(pieces[k:]).lower()
            if len(tail) >= MIN_LETTERS and tail in _spellings():
                return _spellings()[tail]
    return None


def other_side(name: str) -> str:
    """Return `eyeBlinkLeft` for `eyeBlinkRight` and the reverse; names without a side stay."""
    for one, other in (("Left", "Right"), ("Right", "Left")):
        if name.endswith(one):
            return name.removesuffix(one) + other
    return name


def nearest(name: str) -> tuple[str, ...]:
    """Return the ARKit names most similar to a name, for messages."""
    letters = re.sub(r"[^a-z0-9]", "", re.split(r"[.:|/]", name)[-1].lower())
    return tuple(
        dict.fromkeys(_spellings()[spelling] for spelling in similar(letters, _spellings(), 3, 0.72))
    )
