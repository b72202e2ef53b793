"""The lights of pictures: two lamps and an environment; `shading` and `surface.glsl` are the formula."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import product
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, Index
from realizer.core.errors import RenderError, TableError, UnknownLookError
from realizer.tables import toml_table

LEVELS, HEIGHT, WIDTH = 5, 32, 64


@dataclass(frozen=True, slots=True, eq=False)
class Environment:
    """Light from all directions: +x the character's left, +y up, +z forward; linear.

    Attributes:
        sh: (9, 3) float32; the irradiance over pi is the sum of these times `polynomials` of the normal.
        levels: (LEVELS, HEIGHT, WIDTH, 3) float32, radiance in GGX lobes of roughness 0, 1/4, ... 1 (alpha is
            its square). Row 0 is up; a column is the azimuth atan2(x, z), from -pi to pi.
    """

    sh: Float32
    levels: Float32

    def irradiance(self, normals: Float32) -> Float32:
        """Return the irradiance over pi, (n, 3), of surfaces with unit normals (n, 3)."""
        light: Float32 = np.maximum(polynomials(normals) @ self.sh, 0)
        return light

    def radiance(self, directions: Float32, roughness: Float32) -> Float32:
        """Return the light (n, 3) that surfaces of a roughness (n,) mirror from unit directions (n, 3).

        Linear between texels and between levels.
        """
        x, y, z = np.asarray(directions, np.float32).T
        across = (np.arctan2(x, z) / (2 * np.pi) + 0.5) * WIDTH - 0.5
        down = np.clip(np.arccos(np.clip(y, -1, 1)) / np.pi * HEIGHT - 0.5, 0, HEIGHT - 1)
        level = np.clip(roughness, 0, 1) * (LEVELS - 1)
        light = np.zeros((len(x), 3), np.float32)
        for (k, a), (i, b), (j, c) in product(_pair(level), _pair(down), _pair(across)):
            texels = self.levels[np.minimum(k, LEVELS - 1), np.minimum(i, HEIGHT - 1), j % WIDTH]
            light += (a * b * c)[:, None] * texels
        return light

    def octahedral(self) -> Float32:
        """Return `levels` as octahedral maps (LEVELS, HEIGHT, HEIGHT, 3), which graphics cards read quickly.

        A direction is divided by the sum of its parts' sizes and seen from the front; what lies behind is
        folded over the corners (Cigolle et al. 2014, JCGT 3:2).
        """
        u, v = np.meshgrid(*2 * [(np.arange(HEIGHT) + 0.5) / HEIGHT * 2 - 1])
        z = 1 - np.abs(u) - np.abs(v)
        x = np.where(z < 0, (1 - np.abs(v)) * np.sign(u), u)
        y = -np.where(z < 0, (1 - np.abs(u)) * np.sign(v), v)
        directions = np.stack([x, y, z], axis=-1).reshape(-1, 3)
        flat: Float32 = (directions / np.linalg.norm(directions, axis=1)[:, None]).astype(np.float32)
        rough = np.full(len(flat), 1 / (LEVELS - 1), np.float32)
        maps = [self.radiance(flat, rough * np.float32(k)) for k in range(LEVELS)]
        return np.stack(maps).reshape(LEVELS, HEIGHT, HEIGHT, 3)


@cache
def environment_of(name: str) -> Environment:
    """Return the environment of a preset of `realizer/tables/lights.toml`.

    Raises:
        RenderError: it has none.
    """
    with np.load(str(files("realizer.tables").joinpath("environments.npz"))) as table:
        if f"{name}_sh" not in table:
            raise RenderError(f"light {name}: wanted its environment in environments.npz, got none")
        return Environment(table[f"{name}_sh"], table[f"{name}_levels"].astype(np.float32))


def polynomials(directions: Float32) -> Float32:
    """Return 1, y, z, x, xy, yz, 3zz-1, xz, xx-yy of unit directions (..., 3), as (..., 9)."""
    x, y, z = np.moveaxis(np.asarray(directions), -1, 0)
    terms = [np.ones_like(x), y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y]
    return np.stack(terms, axis=-1)


def _pair(place: Float32) -> list[tuple[Index, Float32]]:
    """Return the texels before and after fractional places (n,), each with its share."""
    first = np.floor(place)
    share = (place - first).astype(np.float32)
    before = first.astype(np.intp)
    return [(before, 1 - share), (before + 1, share)]


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
