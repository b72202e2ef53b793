"""How kinds of surfaces reflect light: the numbers of the formula in shading.py and surface.glsl."""

from functools import cache

import numpy as np

from realizer.core.array_types import Float32
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
