"""The texture of an eye: iris and white, on the square that `eyeball` describes."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from PIL import Image, ImageDraw
from scipy.ndimage import gaussian_filter

from realizer.core.array_types import Float32, Float64, UInt8
from realizer.render.textures import DEPTH
from realizer_studio.faces.eyeball import CORNEA, LIMBUS, PUPIL
from realizer_studio.faces.face_files import to_bytes
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.skin.noise import noise, ridges

FINER = 3  # supersampling
COLLARETTE = 0.56  # radius of the ruff around the pupil, in radii of the limbus
STEPS = 100  # of a vessel at most; most have under 30
VESSELS = 64
ROUGHNESS = 0.10, 0.34  # of cornea and white


def eye_picture(size: int, colours: Mapping[str, Sequence[float]], seed: int) -> tuple[UInt8, UInt8]:
    """Return albedo and surface, (size, size, 3) each, of an eye whose nose is at the left.

    The third channel of the surface, thickness, is how near the iris lies behind the cornea: 255 is at it,
    0 is `DEPTH` behind it.

    Args:
        colours: sRGB of pupil, iris_inner, iris_middle, iris_outer, ring, white and corner.
        seed: of fibres and vessels.
    """
    fine = size * FINER
    line = (np.arange(fine) + 0.5) / fine * 2 - 1
    x, y = np.meshgrid(line, line)
    out = np.hypot(x, y) * 2  # in radii of the limbus
    tint = {name: np.array(colours[name], float) for name in
            ("pupil", "iris_inner", "iris_middle", "iris_outer", "ring", "white", "corner")}  # fmt: skip
    shares = smooth(out, 1.07, 0.96)[..., None]
    albedo = _white(x, y, out, tint, seed) * (1 - shares) + _iris(x, y, out, tint, seed) * shares
    depth = np.sqrt(CORNEA**2 - np.minimum(out * LIMBUS, LIMBUS) ** 2) - np.sqrt(CORNEA**2 - LIMBUS**2)
    clear, white = ROUGHNESS
    wet = white + (clear - white) * smooth(out, 0.97, 0.85)
    surface = np.stack([np.ones_like(out), wet, 1 - depth / DEPTH], -1) * 255
    return _smaller(albedo, size), _smaller(surface, size)


def _smaller(picture: Any, size: int) -> UInt8:
    out: UInt8 = to_bytes(picture.reshape(size, FINER, size, FINER, -1).mean(axis=(1, 3)))
    return out


def _field(function: Any, x: Float64, y: Float64, out: Float64, lengths: Any, seed: int) -> Any:
    """Return a random field around the pupil at the angle of (x, y) and the distance `out`."""
    around = np.stack([x, y], -1) / np.maximum(np.hypot(x, y), 1e-6)[..., None]
    at = np.concatenate([around, out[..., None]], -1).reshape(-1, 3)
    return function(at, (lengths[0], lengths[0], lengths[1]), seed).reshape(x.shape)


def _iris(x: Float64, y: Float64, out: Float64, tint: dict[str, Float64], seed: int) -> Any:
    edge = COLLARETTE + 0.035 * _field(noise, x, y, out * 0, (0.35, 1.0), seed)
    inner, outer = smooth(out, edge + 0.05, edge - 0.07), smooth(out, 0.66, 0.98)
    base = tint["iris_middle"] + inner[..., None] * (tint["iris_inner"] - tint["iris_middle"])
    base = base + outer[..., None] * (tint["iris_outer"] - base)
    # Wavy fibres run from the ruff to the rim; between them the iris is dark.
    bent = 0.05 * _field(noise, x, y, out, (0.5, 0.35), seed + 1)
    c, s = np.cos(bent), np.sin(bent)
    u, v = c * x - s * y, s * x + c * y
    fibres = 0.6 * _field(noise, u, v, out, (0.10, 0.9), seed + 2)
    fibres += 0.55 * _field(noise, u, v, out, (0.045, 0.7), seed + 3)
    pale = _field(ridges, u, v, out, (0.14, 0.8), seed + 4)
    light = 1 + 0.17 * np.clip(fibres, -1.6, 1.8) + 0.24 * (pale - 0.35)
    crypts = smooth(_field(noise, x, y, out, (0.22, 0.16), seed + 5), 0.9, 1.6)
    light *= 1 - 0.35 * crypts * smooth(out, edge, edge + 0.06) * smooth(out, 0.92, 0.75)
    light *= 1 + 0.26 * np.exp(-(((out - edge) / 0.035) ** 2)) - 0.10 * smooth(out, edge - 0.02, 0.40)
    # Furrows where the iris folds as the pupil widens.
    light *= 1 - 0.10 * np.exp(-(((out - 0.80 - 0.02 * bent) / 0.018) ** 2))
    colour = base * light[..., None]
    rim = (smooth(out, 0.80, 0.99) * 0.85)[..., None]
    colour = colour + rim * (tint["ring"] - colour)
    ruff = 0.006 * _field(noise, x, y, out * 0, (0.12, 1.0), seed + 6) + PUPIL / LIMBUS
    black = smooth(out, ruff + 0.035, ruff - 0.015)[..., None]
    return np.clip(colour + black * (tint["pupil"] - colour), 0, 255)


def _white(x: Float64, y: Float64, out: Float64, tint: dict[str, Float64], seed: int) -> Any:
    far = smooth(out, 1.05, 1.7)
    cloud = _field(noise, x, y, out, (0.4, 0.3), seed + 10)
    # Grey at the limbus, ivory farther out, pink in the corners.
    colour = tint["white"] * (0.79 + 0.010 * cloud)[..., None]
    colour = colour * (1 + (1 - far)[..., None] * np.array([-0.02, -0.012, -0.015]))
    colour = colour * (1 + far[..., None] * np.array([0.02, -0.045, -0.12]))
    pink = smooth(-x, 0.50, 0.95) * 0.7 + smooth(x, 0.56, 0.95) * 0.55 + smooth(np.abs(y), 0.6, 0.95) * 0.4
    pink = np.clip(pink + 0.05 * cloud * far, 0, 0.8)[..., None]
    colour = colour + pink * (tint["corner"] - colour)
    red = _vessels(x.shape[0], seed)[..., None]
    return np.clip(colour * (1 - red * np.array([0.10, 0.5, 0.5])), 0, 255)


def _vessels(size: int, seed: int) -> Float32:
    """Return the coverage by vessels, (size, size) 0..1: winding lines towards the limbus."""
    rng = np.random.default_rng(seed)
    paper = Image.new("F", (size, size), 0)
    draw = ImageDraw.Draw(paper)
    for _ in range(VESSELS):
        # Most vessels begin in the corners.
        angle = rng.choice([0, np.pi]) + rng.normal(0, 0.55)
        position, heading = np.array([np.cos(angle), np.sin(angle)]) * rng.uniform(0.8, 1.0), angle + np.pi
        end, dark, width = rng.uniform(0.54, 0.74), rng.uniform(0.4, 1.0), rng.uniform(1.8, 4.6)
        for _ in range(STEPS):  # a vessel may wind away
            if np.hypot(*position) <= end:
                break
            heading += rng.normal(0, 0.22) + 0.15 * np.sin(angle + np.pi - heading)
            step = position + 0.02 * np.array([np.cos(heading), np.sin(heading)])
            ends = [tuple((point + 1) / 2 * size) for point in (position, step)]
            fade = float(np.clip((np.hypot(*position) - end) / 0.2, 0.1, 1))
            draw.line([*ends[0], *ends[1]], fill=dark * fade, width=max(1, round(width * fade)))
            position = step
    return np.asarray(gaussian_filter(np.array(paper), FINER * 0.35), np.float32)
