"""A false-colour image of the difference between two pictures."""

from typing import Any

import numpy as np
from PIL import Image, ImageFilter

from realizer.core.array_types import Float32, UInt8

PAPER = np.array([24, 26, 29], np.float32)
# The background is the neutral face, blurred, at 25 % opacity (Paul 2010, 4.4.2).
STRENGTH = 0.25
BLUR = 0.012  # of the picture's height
MAX_DIFFERENCE = 0.25  # of the last colour; 1 is the difference between black and white
MIN_DIFFERENCE = 0.012  # three steps of 255; smaller differences are invisible
# Colours (sRGB) of increasing differences, which become lighter, so that the scale does not depend on hues.
COLOURS = np.array([[78, 28, 128], [196, 40, 104], [246, 128, 48], [255, 238, 170]], np.float32)


def ramp(amount: Float32) -> Float32:
    """Return the colours (..., 3), sRGB 0..255, of differences in units of `MAX_DIFFERENCE`, 0..1."""
    stops = np.linspace(0, 1, len(COLOURS))
    return np.stack([np.interp(amount, stops, COLOURS[:, k]) for k in range(3)], axis=-1).astype(np.float32)


def faint(neutral: UInt8) -> Float32:
    """Return the background (h, w, 3), sRGB 0..255, of a difference image, from pixels (h, w, 4)."""
    share = neutral[..., 3:] / np.float32(255)
    lit = np.concatenate([neutral[..., :3] * share, neutral[..., 3:]], axis=2)
    soft = Image.fromarray(np.rint(lit).astype(np.uint8), "RGBA")
    blurred = np.asarray(soft.filter(ImageFilter.GaussianBlur(BLUR * neutral.shape[0])), np.float32)
    out: Float32 = PAPER * (1 - STRENGTH * blurred[..., 3:] / 255) + STRENGTH * blurred[..., :3]
    return out


def difference(picture: UInt8, neutral: UInt8, below: Float32) -> UInt8:
    """Return the difference image (h, w, 3) of two pictures (h, w, 3), over the background `below`.

    The difference of two pixels is that of their most different channel.
    """
    amount = np.abs(picture.astype(np.int16) - neutral).max(axis=2) / np.float32(255)
    colour = ramp(np.minimum(amount / MAX_DIFFERENCE, 1))
    opacity = np.clip((amount - MIN_DIFFERENCE) / (2 * MIN_DIFFERENCE), 0, 1)[..., None]
    out: UInt8 = np.rint(below * (1 - opacity) + colour * opacity).astype(np.uint8)
    return out


def flatten(pixels: UInt8, behind: Any) -> UInt8:
    """Return pixels (h, w, 3) of a picture (h, w, 4), which is not premultiplied, over `behind`.

    Args:
        behind: a colour, or pixels (h, w, 3); 0..255.
    """
    share = pixels[..., 3:] / np.float32(255)
    mixed = pixels[..., :3] * share + np.asarray(behind, np.float32) * (1 - share)
    out: UInt8 = np.rint(mixed).astype(np.uint8)
    return out
