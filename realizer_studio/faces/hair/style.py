"""Ways to wear hair, as a recipe's [hair] names them."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.core.errors import FaceError
from realizer.tables import toml_table

GREY = np.array([196.0, 193.0, 190.0])  # sRGB, of white hair
Table = list[list[float]]


@dataclass(frozen=True, slots=True)
class Style:
    """The numbers of a hair style; `realizer/tables/hair.toml` explains them."""

    line: Table
    rise: Table
    top: Table
    parting: Table
    tied: bool
    whorl: float
    stray: float
    thick: Table
    depth: float
    ragged: float
    sides: float
    crown: float
    length: list[float]
    lift: float
    soft: float
    over: float
    heavy: float
    ends: Table
    body: float
    tuck: float
    uneven: float
    cards: int
    segments: int
    width: float
    strips: list[str]
    under: str
    edge: str
    thin: list[str]
    cap: str
    border: int
    border_length: float
    cover: float
    contrast: float
    gloss: float
    grey: float
    bun: list[float]


def style_of(table: Mapping[str, Any]) -> Style:
    """Return the style in a recipe's [hair], with its changes.

    Raises:
        FaceError: an unknown style or key.
    """
    table_of_styles = toml_table("hair.toml")
    name = table.get("style", "short")
    if not isinstance(name, str) or name not in table_of_styles["styles"]:
        raise FaceError(f"hair: style: wanted one of {', '.join(table_of_styles['styles'])}, got {name!r}")
    changes = {key: value for key, value in table.items() if key != "style"}
    names = [field.name for field in fields(Style)]
    for key in changes:
        if key not in names:
            raise FaceError(f"hair: wanted one of style, {', '.join(names)}, got {key!r}")
    return Style(**(table_of_styles["plain"] | table_of_styles["styles"][name] | changes))


def colour_of(style: Style, colour: Any) -> Float64:
    """Return the mean colour (3,) of hair and its white strands, sRGB."""
    return np.asarray(np.array(colour, float) * (1 - style.grey) + GREY * style.grey)
