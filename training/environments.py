"""Makes realizer/tables/environments.npz: python training/environments.py FOLDER

First `npm install --prefix FOLDER @pmndrs/assets@1.7.0` and `pip install OpenEXR`, which is no dependency of
the realizer.
"""

from __future__ import annotations

import base64
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from realizer.render.light import HEIGHT, LEVELS, WIDTH, polynomials

TABLE = Path(__file__).parents[1] / "realizer/tables/environments.npz"
FINE = 2  # texels of the source along each side of a texel of the table
# Integrals of the nine polynomials' squares over the sphere, and what a cosine lobe keeps of each order.
SQUARES = 4 * np.pi * np.array([1, 1 / 3, 1 / 3, 1 / 3, 1 / 15, 1 / 15, 4 / 5, 1 / 15, 4 / 15])
LOBE = np.array([1, 2 / 3, 2 / 3, 2 / 3, 1 / 4, 1 / 4, 1 / 4, 1 / 4, 1 / 4])


@dataclass(frozen=True)
class Recipe:
    """What a preset's environment is made of.

    Attributes:
        panorama: file in the package's folder `hdri`.
        turn: degrees; where the panorama's middle comes to lie, from the front to the character's left.
        limit: brightest luminance, as photographed; the rest of a lamp or the sun is the key light.
        saturation: 0 is grey, 1 is as photographed.
        mean: linear light over the whole sphere.
    """

    panorama: str
    turn: float
    limit: float
    saturation: float
    mean: tuple[float, float, float]


RECIPES = {
    # A bright room; its window is where the key light is.
    "portrait": Recipe("apartment", 13, 5, 0.7, (0.225, 0.22, 0.225)),
    # Clouds over a calm sea, which reflects them; the sun behind a cloud is where the key light is.
    "daylight": Recipe("sky", 12, 4, 0.25, (0.40, 0.40, 0.405)),
    # The blue hour; the sky is brightest behind the character's left shoulder.
    "evening": Recipe("venice", 100, 6, 0.75, (0.105, 0.118, 0.165)),
    # A black studio with a white floor; its umbrella is the second lamp, at the character's left.
    "studio": Recipe("studio", 112, 12, 0.3, (0.22, 0.22, 0.224)),
    # A square by the sea under a clear sky; its low sun is where the key light is.
    "outdoors": Recipe("sunset", 76, 3, 0.8, (0.325, 0.34, 0.385)),
}


def main(folder: Path) -> None:
    arrays = {}
    for name, recipe in RECIPES.items():
        picture = _graded(_read(folder, recipe.panorama), recipe)
        arrays[f"{name}_sh"] = harmonics(picture).astype(np.float32)
        arrays[f"{name}_levels"] = levels(picture).astype(np.float16)
    np.savez_compressed(TABLE, **arrays)
    print(f"{TABLE.name}: {TABLE.stat().st_size / 1000:.0f} kB")


def harmonics(picture: np.ndarray) -> np.ndarray:
    """Return (9, 3): factors of the polynomials whose sum is the irradiance / pi; of a panorama (h, w, 3)."""
    solid, directions = _solid_angles(picture), directions_of(*picture.shape[:2])
    sums = np.einsum("hwk,hwc,hw->kc", polynomials(directions), picture, solid)
    return sums * (LOBE / SQUARES)[:, None]


def levels(picture: np.ndarray) -> np.ndarray:
    """Return the light in GGX lobes about each direction, (LEVELS, HEIGHT, WIDTH, 3)."""
    fine, solid = directions_of(*picture.shape[:2]).reshape(-1, 3), _solid_angles(picture).ravel()
    light = picture.reshape(-1, 3)
    mirror = picture.reshape(HEIGHT, FINE, WIDTH, FINE, 3).mean((1, 3))
    facing = directions_of(HEIGHT, WIDTH).reshape(-1, 3) @ fine.T
    rows = [mirror]
    for level in range(1, LEVELS):
        alpha = (level / (LEVELS - 1)) ** 2
        # Seen along the normal, n.h = cos(half the angle to the light), and the density of a lobe is D / 4.
        half = (1 + facing) / 2
        weights = np.maximum(facing, 0) * (alpha / (half * (alpha**2 - 1) + 1)) ** 2 * solid
        rows.append((weights @ light / weights.sum(1, keepdims=True)).reshape(HEIGHT, WIDTH, 3))
    return np.stack(rows)


def directions_of(height: int, width: int) -> np.ndarray:
    """Return the unit directions of the texels of a panorama, (height, width, 3)."""
    down = (np.arange(height) + 0.5) / height * np.pi
    across = ((np.arange(width) + 0.5) / width * 2 - 1) * np.pi
    y, flat = np.cos(down)[:, None], np.sin(down)[:, None]
    parts = np.broadcast_arrays(flat * np.sin(across), y, flat * np.cos(across))
    return np.stack(parts, axis=-1).astype(np.float32)


def _read(folder: Path, panorama: str) -> np.ndarray:
    """Return a panorama of the package (256, 512, 3), linear light."""
    import OpenEXR

    text = (folder / f"node_modules/@pmndrs/assets/hdri/{panorama}.exr.js").read_text("ascii")
    with tempfile.NamedTemporaryFile(suffix=".exr") as file:
        file.write(base64.b64decode(text.split("base64,")[1].split("'")[0]))
        file.flush()
        with OpenEXR.File(file.name) as exr:
            # Its compression overshoots beside lamps.
            return np.maximum(exr.channels()["RGB"].pixels, 0).astype(np.float64)


def _graded(photograph: np.ndarray, recipe: Recipe) -> np.ndarray:
    """Return the panorama as the recipe wants it, FINE times the table's size."""
    height, width = HEIGHT * FINE, WIDTH * FINE
    # Seen from inside, the character's left (the right half of our rows) is at the left.
    rows = np.roll(photograph[:, ::-1], round(recipe.turn / 360 * photograph.shape[1]), axis=1)
    rows = rows.reshape(height, len(rows) // height, width, -1, 3).mean((1, 3))
    grey = rows.mean(2, keepdims=True)
    rows = (grey + (rows - grey) * recipe.saturation) * np.minimum(1, recipe.limit / np.maximum(grey, 1e-9))
    solid = _solid_angles(rows)[..., None] / (4 * np.pi)
    return rows * np.array(recipe.mean) / (rows * solid).sum((0, 1))


def _solid_angles(picture: np.ndarray) -> np.ndarray:
    """Return the solid angle of each texel (h, w), steradians."""
    height, width = picture.shape[:2]
    edges = np.cos(np.linspace(0, np.pi, height + 1))
    return np.repeat((edges[:-1] - edges[1:])[:, None], width, axis=1) * 2 * np.pi / width


if __name__ == "__main__":
    main(Path(sys.argv[1]))
