"""The [look] section of a recipe: parameters of brows, lips, skin and collar."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from realizer.core.errors import FaceError


@dataclass(frozen=True, slots=True)
class Appearance:
    """Figures of how a person looks, as `realizer/tables/look.toml` explains them."""

    brow_thick: float
    brow_low: float
    brow_grey: float
    brow_cover: float
    lash: float
    lips: float
    flush: float
    stubble: float
    freckles: float
    age: float
    collar_low: float
    collar_point: float


def appearance_of(table: Mapping[str, Any]) -> Appearance:
    """Return the plain look with the changes of a recipe's [look].

    Raises:
        FaceError: no such figure, or not a number.
    """
    from realizer.tables import read_toml, text_of

    names = [field.name for field in fields(Appearance)]
    for key, value in table.items():
        if key not in names:
            raise FaceError(f"look: wanted one of {', '.join(names)}, got {key!r}")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise FaceError(f"look: {key}: wanted a number, got {value!r}")
    plain = read_toml(text_of("look.toml"), "look.toml")
    return Appearance(**{name: float(table.get(name, plain[name])) for name in names})
