"""Measurements of action units on an imported face, for `faces fit`."""

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.au.mouth import fit_mouth, shares
from realizer.face.au.units import units
from realizer.face.model import Face
from realizer.facebuild.arkit.mesh_merge import Surface
from realizer.facebuild.au.measure import UnitMeasurement

OPEN = 0.3  # baked light below this: inside the head, or the inner side of a lip


def measure_units(face: Face, surface: Surface) -> dict[int, UnitMeasurement]:
    """Return each displacement unit that the shapes make, on the left half of the skin.

    Raises:
        FaceError: a mouth whose points do not go from the middle to the left corner.
    """
    first, last = face.parts["skin"]
    skin = face.vertices[first:last].astype(np.float64)
    half = skin[:, 0] > -1e-6
    seen = face.occlusion[first:last][half] > OPEN
    upper = shares(face, fit_mouth(face))[first:last][half]
    out = {}
    for unit in units().values():
        move = _mixed(surface, unit.mixture) if unit.kind == "displacement" else None
        if move is not None and move[first:last][half].any():
            out[unit.au] = UnitMeasurement(unit.au, skin[half], move[first:last][half], seen, upper)
    return out


def _mixed(surface: Surface, mixture: dict[str, float]) -> Float64 | None:
    """Return the sum of weighted shapes of both sides, or None if a shape is missing."""
    out = np.zeros_like(surface.vertices)
    for name, weight in mixture.items():
        sides = (name,) if name in surface.moves else (f"{name}Left", f"{name}Right")
        if any(side not in surface.moves for side in sides):
            return None
        for side in sides:
            out += weight * surface.moves[side]
    return out
