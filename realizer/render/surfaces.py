"""How kinds of surfaces reflect light: the numbers of the formula in shading.py and surface.glsl.

The uniforms of surface.glsl are what one light and these kinds are to a graphics card.
"""

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from realizer.core.array_types import Float32
from realizer.face.drawn_mesh import EYE, HAIR
from realizer.render.lamp_view import ASIDE, NEAR, SIDE, LampView
from realizer.render.lamp_view import SOFT as SHADOW_SOFT
from realizer.render.light import Light, unit
from realizer.render.textures import DEPTH, FOLD_SHADE, IRIS, STEEPEST
from realizer.tables import toml_table

# Columns of `surfaces`.
WRAP, SHADED, SOFT, REFLECTION, SHARP, SHARP_SHARE, THROUGH, COAT = 0, 3, 4, 7, 8, 9, 10, 11
GLINT = 2.0  # brightness of the key lamp's reflection on a coat, as a share of its light on white
DIRECT = 0.55  # how far occlusion darkens light of lamps, which shadows darken already
BENT = 1 / 1.336  # how light is bent at the cornea
BOWL = 1.3  # slope of an iris at its rim, against the cornea: a bowl that is brightest opposite to the lamp
THIN = (0.50, 0.13, 0.07)  # colour of light that has come through thin skin


@cache
def surfaces() -> Float32:
    """Return a row of surfaces.toml for each kind of surface, float32."""
    rows = toml_table("surfaces.toml").values()
    names = ("wrap", "shaded", "soft", "reflection", "sharp", "sharp_share", "through", "coat")
    return np.array([np.hstack([row[name] for name in names]) for row in rows], np.float32)


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
        "surfaceSoft": rows[:, SOFT : SOFT + 3].tolist(),
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
        "shadowSteps": [NEAR, ASIDE, SHADOW_SOFT],
        "shadowSide": float(SIDE),
    }


def mirrored_of(light: Light) -> Float32:
    """Return the texels of `mirrorMap`, (levels, side, side, 3) linear light."""
    return np.asarray(light.environment.octahedral() * light.exposure, np.float32)
