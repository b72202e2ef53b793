"""The mixers of action units as Wojdel 2005 (5.1) describes them, to compare deformers with."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.au.deformer import OPENING, limit_opening
from realizer.face.au.model import Model, rotation
from realizer.face.au.units import units

# The parts of a face. "fixed" moves with the head alone: upper teeth, clothes.
Thing = Literal["face", "left eye", "right eye", "jaw", "fixed"]


def additive(model: Model, at: Float64, values: Mapping[int, float]) -> Float64:
    """Return the sum of displacement units, each at the neutral place: their order does not matter.

    Args:
        at: (n, 3) metres.
        values: action unit -> intensity 0..1.
    """
    moves = np.zeros_like(at)
    for au, value in values.items():
        moves += value * model.displacement(au, at)
    return np.asarray(at + moves)


def successive(
    model: Model, at: Float64, values: Mapping[int, float], upper: Float64 | None = None
) -> Float64:
    """Return places moved by one displacement unit after the other: their order matters.

    `successive_mixer.SuccessiveMixer` does it for a whole face, frame by frame.

    Args:
        at: (n, 3) metres.
        values: action unit -> intensity 0..1, in this order.
        upper: (n,) share of each vertex in the upper half of the face; None: by its position, at every step.
    """
    for au, value in values.items():
        at = at + value * model.displacement(au, at, upper=upper)
    return np.asarray(at)


def mix(model: Model, at: Float64, values: Mapping[int, float], thing: Thing = "face") -> Float64:
    """Return the places of an object's points under several action units, by Wojdel's rules.

    Single object and sub-object units are added up, of the neutral places; those that open the mouth as far
    as the widest of them does. Turns cannot be: they follow one
    after the other. A unit that moves several objects comes after those that are an object's own: the eyes
    look, the jaw opens, then the head turns with all of it.

    Args:
        at: (n, 3) metres, neutral.
        values: action unit -> intensity 0..1; those that are not of the model move nothing.
    """
    known = units()
    moved = at
    wide = [au for au in OPENING if au in model.units and au in values]
    amounts = limit_opening(np.array([model.gap(au) for au in wide]), np.array([[values[au]] for au in wide]))
    values = {**values, **{au: float(amount[0]) for au, amount in zip(wide, amounts, strict=True)}}
    if thing == "face":
        moved = additive(model, at, {au: value for au, value in values.items() if au in model.units})
    elif thing == "jaw":
        for au, value in values.items():
            if au in model.units and model.units[au].jaw_degrees:
                moved = turned(moved, (1, 0, 0), value * np.radians(model.units[au].jaw_degrees), model.jaw)
    elif thing in ("left eye", "right eye"):
        for au in _turns(model, values, "eyes"):
            angle = values[au] * np.radians(model.degrees[au])
            moved = turned(moved, axis_of(known[au].turn), angle, model.eyes[thing == "right eye"])
    # Which part of the neck follows is a matter of the neutral face: an open jaw does not leave its head.
    share = model.head.density(at)[:, None]
    for au in _turns(model, values, "head"):
        angle = values[au] * np.radians(model.degrees[au])
        moved = moved + share * (turned(moved, axis_of(known[au].turn), angle, model.head.pivot) - moved)
    return np.asarray(moved)


def axis_of(turn: str) -> tuple[float, float, float]:
    """Return the unit vector that a turn such as "-z" goes about, right-handed."""
    x, y, z = (float(f"{turn[0]}1") if letter == turn[1] else 0.0 for letter in "xyz")
    return x, y, z


def _turns(model: Model, values: Mapping[int, float], kind: str) -> list[int]:
    """Return the turns among the units, tilts first, turns to a side last: as FAPs 48 to 50 turn."""
    known = units()
    mine = [au for au in values if au in model.degrees and known[au].kind == kind and values[au]]
    return sorted(mine, key=lambda au: "zxy".index(known[au].turn[1]))


def turned(at: Float64, axis: tuple[float, float, float], radians: float, pivot: object) -> Float64:
    """Return points (n, 3) turned right-handed about an axis through the pivot."""
    centre = np.asarray(pivot, np.float64)
    return np.asarray((at - centre) @ rotation(axis, radians).T + centre)
