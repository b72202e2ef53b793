"""How kinds of surfaces reflect light: the numbers of the formula in shading.py and surface.glsl."""

from __future__ import annotations

from functools import cache

import numpy as np

from realizer.core.array_types import Float32
from realizer.tables import toml_table

# Columns of `surfaces`.
WRAP, SOFT, REFLECTION, SHARP, SHARP_SHARE, THROUGH = 0, 3, 6, 7, 8, 9
DIRECT = 0.55  # how far occlusion darkens light of lamps, which shadows darken already
THIN = (0.50, 0.13, 0.07)  # colour of light that has come through thin skin


@cache
def surfaces() -> Float32:
    """Return a row of surfaces.toml for each kind of surface, float32."""
    rows = toml_table("surfaces.toml").values()
    names = ("wrap", "soft", "reflection", "sharp", "sharp_share", "through")
    return np.array([np.hstack([row[name] for name in names]) for row in rows], np.float32)
