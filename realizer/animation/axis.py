"""The fixed axis of animation: AUs by side, 68 FAPs, mask channels, and the AUs' mixing order."""

from __future__ import annotations

from functools import cache, lru_cache
from typing import NamedTuple

from realizer import tables

# How far (0..1) something is taken from what shows it otherwise: speech takes the lips, a temporary gaze
# takes eyes and head from the base gaze, a document takes blinks and small movements from the idle face, and
# the successive mixer takes the action units from the additive one.
MASKED_REGIONS = ("lips", "eyes", "head", "blinks", "motion", "successive")


class Target(NamedTuple):
    """One column of the axis.

    `name` is "12L" for an AU, "open_jaw" for a FAP, "lips" for a presence, "rank 12" for an AU's place among
    those that follow one another.
    """

    name: str
    column: int


@cache
def axis() -> dict[str, Target]:
    """Name -> Target of every column: AUs (one a side where they have sides), 68 FAPs, presences, ranks."""
    # What turns is not mixed: turns follow one another as they must.
    ranks = (f"rank {row.au}" for row in tables.action_units() if not row.degrees)
    names = [*_au_names(), *(row.name for row in tables.faps()), *MASKED_REGIONS, *ranks]
    return {name: Target(name, column) for column, name in enumerate(names)}


@cache
def _au_names() -> tuple[str, ...]:
    """ "1L", "1R", ... "17", ...: ascending AU number, left before right."""
    names: list[str] = []
    for row in tables.action_units():
        names += [f"{row.au}L", f"{row.au}R"] if row.sides else [str(row.au)]
    return tuple(names)


def AU_NAMES() -> tuple[str, ...]:
    """Names of the AU columns, in order: the `au.names` of the JSON."""
    return _au_names()


@lru_cache(maxsize=512)  # more than there are
def au(number: int, side: str = "BOTH") -> tuple[Target, ...]:
    """The columns of one AU; side is LEFT, RIGHT or BOTH (the character's). A midline AU has one column.

    Raises:
        KeyError: no such AU.
    """
    columns = axis()
    if str(number) in columns:
        return (columns[str(number)],)
    sides = {"LEFT": "L", "RIGHT": "R", "BOTH": "LR"}[side]
    return tuple(columns[f"{number}{s}"] for s in sides)


def fap(number: int) -> Target:
    """The column of one FAP, 1..68."""
    return axis()[tables.faps()[number - 1].name]


def mask_channel(region: str) -> Target:
    """The column that says how far one of `MASKED_REGIONS` is taken."""
    return axis()[region]


def mixing_order(number: int) -> Target:
    """The column that says how early (0..1) an AU comes where AUs follow one another.

    Raises:
        KeyError: no such AU, or one that turns something.
    """
    return axis()[f"rank {number}"]


def region(target: Target) -> str:
    """What a column moves, as base states are replaced: "eyes" (gaze), "head", "face" or "idle".

    A presence stands in the region it takes; all FAPs but those of eyeballs and head are of the face.
    """
    name = target.name
    if name == "successive" or name.startswith("rank "):
        return "face"
    if name in MASKED_REGIONS:
        return {"lips": "face", "blinks": "idle", "motion": "idle"}.get(name, name)
    if not name.rstrip("LR").isdigit():
        number = next(row.fap for row in tables.faps() if row.name == name)
        return "eyes" if 23 <= number <= 28 else "head" if 48 <= number <= 50 else "face"
    number = int(name.rstrip("LR"))
    return "eyes" if 61 <= number <= 66 else "head" if 51 <= number <= 58 else "face"
