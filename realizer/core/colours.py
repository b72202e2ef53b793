"""Conversion between 8-bit sRGB and linear light (IEC 61966-2-1)."""

import numpy as np

from realizer.core.array_types import Float32, Float64, UInt8


def linear(colours: UInt8 | Float32 | Float64) -> Float32:
    """Return the linear light 0..1 of sRGB colours 0..255."""
    c = np.asarray(colours, np.float32) / np.float32(255)
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4).astype(np.float32)


def srgb(light: Float32) -> Float32:
    """Return the sRGB colours 0..1 of linear light, which is clipped to 0..1."""
    c = np.clip(np.asarray(light, np.float32), 0, 1)
    return np.where(c <= 0.0031308, c * 12.92, 1.055 * c ** (1 / 2.4) - 0.055).astype(np.float32)
