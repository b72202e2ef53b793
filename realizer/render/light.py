"""The lights of pictures: two lamps and an environment; `shading` and `surface.glsl` are the formula."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from realizer.core.array_types import Float32
from realizer.core.errors import TableError, UnknownLookError
from realizer.render.environment import Environment, environment_of
from realizer.tables import toml_table

LIGHT = "REALIZER_LIGHT"
LAMPS = ("key", "rim")
Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Lamp:
    """A lamp far away.

    Attributes:
        direction: towards the lamp, any length; +x the character's left, +y up, +z forward.
        colour: linear light it adds where the surface faces it.
    """

    direction: Triple
    colour: Triple


@dataclass(frozen=True, slots=True)
class Light:
    """A row of lights.toml; in linear light.

    Attributes:
        rim: lights the outline from behind; the higher `rim_power`, the thinner.
        exposure: of the lamps and the environment, before the tone curve.
    """

    name: str
    key: Lamp
    rim: Lamp
    rim_power: float
    glint: float  # place of the glint along key + glint x v: 1 is the mirror's place, more is lower
    glint_width: float  # radians from its middle to its edge
    exposure: float
    backdrop_middle: Triple  # sRGB 0..1, behind the head
    backdrop_edge: Triple  # sRGB 0..1, in the corners

    @property
    def environment(self) -> Environment:
        """The light from all around."""
        return environment_of(self.name)


@cache
def presets() -> Mapping[str, Light]:
    """Return the lights of `realizer/tables/lights.toml`, by name."""
    return {name: _light(name, values) for name, values in toml_table("lights.toml").items()}


def preset(name: str | None = None) -> Light:
    """Return the light of that name; None selects REALIZER_LIGHT, then "portrait".

    Raises:
        UnknownLookError: no such light; the text lists the known ones.
    """
    name = name or os.environ.get(LIGHT) or "portrait"
    if name not in presets():
        raise UnknownLookError(f"light: wanted one of {', '.join(presets())}, got {name!r}")
    return presets()[name]


def _light(name: str, values: dict[str, Any]) -> Light:
    try:
        table: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}
        for lamp in LAMPS:
            table[lamp] = Lamp(**{part: tuple(v) for part, v in table[lamp].items()})
        return Light(name, **table)
    except (KeyError, TypeError) as error:
        raise TableError(f"lights.toml: {name}: {error}") from None


def unit(vector: Any) -> Float32:
    """Return the vector at length 1, float32."""
    v = np.asarray(vector, np.float64)
    return (v / np.linalg.norm(v)).astype(np.float32)
