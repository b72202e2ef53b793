"""Conversions at the edges: frames, the MPEG-4 angle unit, FACS letters."""

import math

__all__: list[str] = []

# ISO/IEC 14496-2 counts rotations in units of 1e-5 rad ("AU" there; never called au here).
ANGLE_UNIT = 1e-5  # rad

# FACS scores intensity by letter; inside we use 0..1, upper end of each letter's band.
FACS_LETTERS = {"A": 0.2, "B": 0.4, "C": 0.6, "D": 0.8, "E": 1.0}


def frame_count(duration: float, fps: float) -> int:
    """Number of frames k/fps in 0..duration, both ends included: floor(duration x fps) + 1.

    A duration that is a whole number of frames up to rounding counts its last frame.
    """
    return math.floor(duration * fps + 1e-6) + 1


def degrees_to_angle_units(degrees: float) -> float:
    """MPEG-4 angle units (1e-5 rad) of an angle in degrees."""
    return math.radians(degrees) / ANGLE_UNIT
