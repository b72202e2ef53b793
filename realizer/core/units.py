"""Unit conversions: durations to frames, the MPEG-4 angle unit."""

import math

# ISO/IEC 14496-2 counts rotations in units of 1e-5 rad ("AU" there; never called au here).
ANGLE_UNIT = 1e-5  # rad


def frame_count(duration: float, fps: float) -> int:
    """Number of frames k/fps in 0..duration, both ends included: floor(duration x fps) + 1.

    A duration that is a whole number of frames up to rounding counts its last frame.
    """
    return math.floor(duration * fps + 1e-6) + 1
