"""The uniforms of surface.glsl: what one light and one kind of surface are to a graphics card."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from realizer.core.array_types import Float32
from realizer.face.drawn_mesh import EYE, HAIR
from realizer.render.lamp_view import ASIDE, NEAR, SIDE, SOFT, LampView
from realizer.render.light import Light, unit
from realizer.render.surfaces import (
    BENT,
    BOWL,
    DIRECT,
    GLINT,
    REFLECTION,
    SHADED,
    THIN,
    THROUGH,
    WRAP,
    surfaces,
)
from realizer.render.surfaces import SOFT as EVEN
from realizer.render.textures import DEPTH, FOLD_SHADE, IRIS, STEEPEST


def uniforms_of(light: Light, lamp: LampView) -> Mapping[str, Any]:
    """Return the values by name, of all uniforms but the maps, as numbers and lists of numbers.

    Args:
        lamp: the view of the key lamp.
    """
    rows = surfaces()
    view = np.eye(4, dtype=np.float32)
    view[:3] = lamp.matrix / np.array([[SIDE], [SIDE], [1]])
    return {
        "surfaceWrap": rows[:, WRAP : SHADED + 1].tolist(),
        "surfaceSoft": rows[:, EVEN : EVEN + 3].tolist(),
        "surfaceShine": rows[:, REFLECTION : THROUGH + 1].tolist(),
        "hairKind": HAIR,
        "eyeKind": EYE,
        "iris": list(IRIS),
        "cornea": [DEPTH, BENT, BOWL],
        "glint": [light.glint, light.glint_width, GLINT],
        "thinColour": list(THIN),
        "directShare": DIRECT,
        "steepest": STEEPEST,
        "foldShade": FOLD_SHADE,
        "ambientLight": (light.environment.sh * light.exposure).tolist(),
        "keyDirection": unit(light.key.direction).tolist(),
        "keyColour": [part * light.exposure for part in light.key.colour],
        "rimDirection": unit(light.rim.direction).tolist(),
        "rimColour": [part * light.exposure for part in light.rim.colour],
        "rimPower": light.rim_power,
        "shadowView": view.T.ravel().tolist(),  # column after column
        "shadowSteps": [NEAR, ASIDE, SOFT],
        "shadowSide": float(SIDE),
    }


def mirrored_of(light: Light) -> Float32:
    """Return the texels of `mirrorMap`, (levels, side, side, 3) linear light."""
    return np.asarray(light.environment.octahedral() * light.exposure, np.float32)
