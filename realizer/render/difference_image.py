"""A false-colour image of the difference between two pictures."""

from typing import Any

import numpy as np

from realizer.core.array_types import Float32, UInt8

PAPER = np.array([24, 26, 29], np.float32)
# Paul 2010, 4.4.2: the neutral face without its background, blurred, at 25 % below the differences.
STRENGTH = 0.25
BLUR = 0.012  # of the picture's height
FULL = 0.25  # of the way from black to white: the difference that the scale ends at
LEAST = 0.012  # below it, three steps of 255, nothing is shown
# From little to much, sRGB: dark to light, so that it reads without its hues as well.
COLOURS = np.array([[78, 28, 128], [196, 40, 104], [246, 128, 48], [255, 238, 170]], np.float32)


def ramp(amount: Float32) -> Float32:
    """Return colours (..., 3), sRGB 0..255, of differences 0..1, of which 1 is `FULL` and more."""
    places = np.linspace(0, 1, len(COLOURS))
    return np.stack([np.interp(amount, places, COLOURS[:, k]) for k in range(3)], axis=-1).astype(np.float32)


def faint(neutral: UInt8) -> Float32:
    """Return the background (h, w, 3), sRGB 0..255, under the differences, of (h, w, 4) pixels."""
    from PIL import Image, ImageFilter

    share = neutral[..., 3:] / np.float32(255)
    lit = np.concatenate([neutral[..., :3] * share, neutral[..., 3:]], axis=2)
    soft = Image.fromarray(np.rint(lit).astype(np.uint8), "RGBA")
    blurred = np.asarray(soft.filter(ImageFilter.GaussianBlur(BLUR * neutral.shape[0])), np.float32)
    out: Float32 = PAPER * (1 - STRENGTH * blurred[..., 3:] / 255) + STRENGTH * blurred[..., :3]
    return out


def difference(picture: UInt8, neutral: UInt8, below: Float32) -> UInt8:
    """Return (h, w, 3) of where two (h, w, 3) pictures differ, by the largest channel, over `below`."""
    apart = np.abs(picture.astype(np.int16) - neutral).max(axis=2) / np.float32(255)
    colour = ramp(np.minimum(apart / FULL, 1))
    shows = np.clip((apart - LEAST) / (2 * LEAST), 0, 1)[..., None]
    out: UInt8 = np.rint(below * (1 - shows) + colour * shows).astype(np.uint8)
    return out


def flatten(pixels: UInt8, behind: Any) -> UInt8:
    """Return (h, w, 3) of (h, w, 4) pixels that are not premultiplied, over one colour of 0..255."""
    share = pixels[..., 3:] / np.float32(255)
    mixed = pixels[..., :3] * share + np.asarray(behind, np.float32) * (1 - share)
    out: UInt8 = np.rint(mixed).astype(np.uint8)
    return out
