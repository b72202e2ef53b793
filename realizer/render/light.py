"""The lighting model: normals, colours and a table of lamps to sRGB; the page gets the same table."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, UInt8
from realizer.core.colours import linear, srgb
from realizer.core.errors import RenderError, TableError
from realizer.render.environment import Environment, environment_of
from realizer.tables import toml_table

LIGHT = "REALIZER_LIGHT"
LAMPS = ("key", "fill", "rim")
Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Lamp:
    """A lamp far away.

    Attributes:
        direction: towards the lamp, any length; +x the character's left, +y up, +z forward.
        colour: linear light it adds where the surface faces it.
        wrap: how far it reaches around the edge, a channel each: 0 is Lambert, 1 reaches the far side. Red
            reaches further than blue, as light that has wandered through skin.
    """

    direction: Triple
    colour: Triple
    wrap: Triple


@dataclass(frozen=True, slots=True)
class Light:
    """Everything that decides how bright a vertex is; in linear light.

    With n the normal, v towards the camera, h halfway between key and v, occ and gloss of the vertex:

        lamp(l)  = l.colour * max(0, (n.l + l.wrap) / (1 + l.wrap))
        edge     = rim.colour * max(0, (n.rim + rim.wrap) / (1 + rim.wrap)) * (1 - max(0, n.v)) ^ rim_power
        ambient  = mix(ground, sky, (1 + n.y) / 2) * occ
        reach    = 1 - shadow * (1 - occ)
        shine    = gloss * (highlight * max(0, n.h) ^ (dull * (sharp / dull) ^ gloss)) * key.colour
        colour   = albedo * ((lamp(key) + lamp(fill) + edge) * reach + ambient) + shine * reach
        picture  = sRGB(shoulder(colour)); shoulder(x) = x up to the knee, then towards 1
    """

    name: str
    key: Lamp
    fill: Lamp
    rim: Lamp
    rim_power: float
    sky: Triple
    ground: Triple
    shadow: float
    highlight: float
    dull: float
    sharp: float
    glint: float  # place of the glint along key + glint x v: 1 is the mirror's place, more is lower
    glint_width: float  # radians from its middle to its edge
    exposure: float  # of pictures that light each pixel
    knee: float
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
        RenderError: no such light; the text lists the known ones.
    """
    name = name or os.environ.get(LIGHT) or "portrait"
    if name not in presets():
        raise RenderError(f"light: wanted one of {', '.join(presets())}, got {name!r}")
    return presets()[name]


def _light(name: str, values: dict[str, Any]) -> Light:
    try:
        table: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}
        for lamp in LAMPS:
            table[lamp] = Lamp(**{part: tuple(v) for part, v in table[lamp].items()})
        return Light(name, **table)
    except (KeyError, TypeError) as error:
        raise TableError(f"lights.toml: {name}: {error}") from None


class Shader:
    """A light, a camera direction and a head's fixed colours made into one product a frame.

    Every term but the highlight and the edge is max(0, affine in the normal), so one (n, 3) x (3, 12)
    product gives them all; 1.1 ms for 10,000 vertices.
    """

    def __init__(
        self, light: Light, colours: UInt8, occlusion: Float32, gloss: Float32, towards_camera: Float32
    ) -> None:
        """The view direction is one for the whole head: with a long lens it turns by 6 degrees at most."""
        # A channel a row: numpy is three times as fast along vertices as along colours.
        reach = (1 - light.shadow * (1 - occlusion)).astype(np.float32)
        albedo = linear(colours).T
        self._lit = np.ascontiguousarray(albedo * reach)
        self._hidden = np.ascontiguousarray(albedo * occlusion)
        self._rim_power = light.rim_power
        view = unit(towards_camera)
        half = unit(unit(light.key.direction) + view)
        sky, ground = np.asarray(light.sky), np.asarray(light.ground)
        lamps = [_affine(lamp) for lamp in (light.key, light.fill, light.rim)]
        ambient = (np.outer([0, 1, 0], (sky - ground) / 2), (sky + ground) / 2)
        plain = (np.stack([view, half], axis=1), np.zeros(2))
        slopes, offsets = zip(*lamps, ambient, plain, strict=True)
        self._slopes = np.ascontiguousarray(np.hstack(slopes).T, np.float32)
        self._offsets = np.hstack(offsets).astype(np.float32)[:, None]
        self._power = (light.dull * (light.sharp / light.dull) ** gloss).astype(np.float32)
        strength = gloss * light.highlight * reach
        self._shine = np.outer(light.key.colour, strength).astype(np.float32)
        self._curve = _curve(light.knee)

    def __call__(self, normals: Float32) -> Float32:
        """Return sRGB 0..1 (n_vertices, 3) float32 of unit normals (n_vertices, 3)."""
        terms = self._slopes @ normals.T
        terms += self._offsets
        key, fill, rim, ambient, (facing_camera, facing_half) = np.split(terms, (3, 6, 9, 12))
        np.maximum(terms[:9], 0, out=terms[:9])
        edge = (1 - np.clip(facing_camera, 0, 1)) ** self._rim_power
        total: Float32 = rim * edge
        total += key
        total += fill
        total *= self._lit
        total += ambient * self._hidden
        total += self._shine * np.maximum(facing_half, 1e-6) ** self._power
        steps = len(self._curve) - 1
        total *= np.float32(steps / BRIGHTEST)
        np.minimum(total, np.float32(steps), out=total)
        shaded: Float32 = self._curve[total.astype(np.int32)].T
        return shaded


BRIGHTEST = 4.0  # linear light at the end of the curve; beyond it all is white


def unit(vector: Any) -> Float32:
    """Return the vector at length 1, float32."""
    v = np.asarray(vector, np.float64)
    return (v / np.linalg.norm(v)).astype(np.float32)


@cache
def _curve(knee: float) -> Float32:
    """Return shoulder and sRGB in one table over 0..BRIGHTEST; a step of 1.2e-4 is finer than 8 bits."""
    x = np.linspace(0, BRIGHTEST, 32768)
    shoulder = np.where(x < knee, x, 1 - (1 - knee) * np.exp(-(x - knee) / (1 - knee)))
    return srgb(shoulder.astype(np.float32))


def _affine(lamp: Lamp) -> tuple[Float32, Float32]:
    """Return colour * (n.l + wrap) / (1 + wrap) as slope (3, 3) and offset (3,), a column a channel."""
    wrap = np.asarray(lamp.wrap)
    scale = np.asarray(lamp.colour) / (1 + wrap)
    return np.outer(unit(lamp.direction), scale).astype(np.float32), (scale * wrap).astype(np.float32)
