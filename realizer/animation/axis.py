"""The columns of animation frames: AUs by side, 68 FAPs, mask channels, mixing order of the AUs."""

from collections.abc import Mapping
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np

from realizer import tables
from realizer.core.array_types import Float32

# Each has a mask channel (0..1), by which one source suppresses another: speech suppresses other movements of
# the lips, a temporary gaze the base gaze of eyes and head, a document a kind of idle motion (blinks, small
# movements, slow motion, or the usual saccades while the character listens or thinks), and the successive
# mixer the additive one.
IDLE_MASKS = ("blinks", "motion", "life", "listening", "thinking")
MASKED_REGIONS = ("lips", "eyes", "head", *IDLE_MASKS, "successive")


class Target(NamedTuple):
    """One column of the axis.

    `name` is "12L" for an AU, "open_jaw" for a FAP, "lips" for a mask channel, "rank 12" for the position of
    an AU in the successive mixer.
    """

    name: str
    column: int


@cache
def axis() -> dict[str, Target]:
    """Return the target of every column by name: AUs (by side), 68 FAPs, mask channels, ranks."""
    # Rotations have no rank, because they add up in any order.
    ranks = (f"rank {row.au}" for row in tables.action_units() if not row.degrees)
    names = [*AU_NAMES(), *(row.name for row in tables.faps()), *MASKED_REGIONS, *ranks]
    return {name: Target(name, column) for column, name in enumerate(names)}


@cache
def AU_NAMES() -> tuple[str, ...]:
    """Return the names of the AU columns: "1L", "1R", ... "17", ..., by number, left before right."""
    names: list[str] = []
    for row in tables.action_units():
        names += [f"{row.au}L", f"{row.au}R"] if row.sides else [str(row.au)]
    return tuple(names)


@lru_cache(maxsize=512)  # more than all AUs and sides
def au(number: int, side: str = "BOTH") -> tuple[Target, ...]:
    """Return the columns of one AU, of the character's LEFT or RIGHT side or BOTH; midline AUs have one.

    Raises:
        KeyError: if there is no such AU.
    """
    columns = axis()
    if str(number) in columns:
        return (columns[str(number)],)
    sides = {"LEFT": "L", "RIGHT": "R", "BOTH": "LR"}[side]
    return tuple(columns[f"{number}{s}"] for s in sides)


def au_row(units: Mapping[tuple[int, str], float]) -> Float32:
    """Return a row (n_targets,) of AUs, (AU, side LEFT | RIGHT | BOTH) -> intensity; the rest is 0."""
    row = np.zeros(len(axis()), np.float32)
    for (number, side), intensity in units.items():
        row[[target.column for target in au(number, side)]] = intensity
    return row


def fap(number: int) -> Target:
    """Return the column of one FAP, 1..68."""
    return axis()[tables.faps()[number - 1].name]


def mask_channel(region: str) -> Target:
    """Return the mask channel of one of `MASKED_REGIONS`."""
    return axis()[region]


def mixing_order(number: int) -> Target:
    """Return the column of an AU's position (0..1) in the successive mixer; KeyError for a rotation."""
    return axis()[f"rank {number}"]


def region(target: Target) -> str:
    """Return the region of a column by which base states are replaced: "eyes", "head", "face" or "idle"."""
    name = target.name
    if name == "successive" or name.startswith("rank "):
        return "face"
    if name in MASKED_REGIONS:
        return "idle" if name in IDLE_MASKS else "face" if name == "lips" else name
    if not name.rstrip("LR").isdigit():
        number = next(row.fap for row in tables.faps() if row.name == name)
        return "eyes" if 23 <= number <= 28 else "head" if 48 <= number <= 50 else "face"
    number = int(name.rstrip("LR"))
    return "eyes" if 61 <= number <= 66 else "head" if 51 <= number <= 58 else "face"
