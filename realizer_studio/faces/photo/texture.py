"""The projection of two photographs onto the maps of a skin."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates

from realizer.core.array_types import Float32, Float64
from realizer.core.colours import linear, srgb
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.photo.photo_fit import Fit, Observation
from realizer_studio.faces.photo.shape import Pose
from realizer_studio.faces.skin.skin import Skin

FACING = 0.12, 0.55  # cosines between skin and camera at which a picture begins to count, and counts fully
CELL, HIDDEN = 3.0, 0.004  # pixels of the depth image; m behind it beyond which skin is hidden
SAMPLE, ROUNDS = 20_000, 6  # texels from which the light is estimated; iterations
ALIKE = 0.25  # standard deviation of the differences of logarithms between picture and lit recipe
ODD = 0.55, 1.1  # such differences at which colours are possibly, and certainly, not skin (hair, shadows)
LEAST = 0.15  # of the mean light; with less light, skin is left dark
BROWS = ("4.1", "4.2", "4.3", "4.4", "4.5", "4.6")
BROW, LIDS = (0.013, 0.0085, 0.03), 2  # half axes around a brow's points; unpainted rings of the lids
# m before the ear lobes, above the chin and below the hairline between which the pictures fade.
BEFORE, BELOW, UNDER = (0.018, 0.042), (-0.030, 0.0), (-0.005, 0.012)
SPREAD = 45.0  # texels; radius of the extrapolation of colours beside the pictures
FULL_WEIGHT = 0.25  # weight above which a texel has the colour of the pictures only


@dataclass(frozen=True, eq=False)
class Projected:
    """A photograph projected to the texels of a skin."""

    colours: Float32  # (k, 3) light 0..1
    weight: Float32  # (k,) 0..1, their weights
    normals: Float64  # (k, 3) normals, mirrored like the photograph


class Painter:
    """A painter of a recipe's skin with two photographs."""

    def __init__(self, fit: Fit) -> None:
        self._fit = fit

    def __call__(self, skin: Skin, albedo: Float32) -> Float32:
        """Return the skin's colours (k, 3), sRGB 0..255, with those of the photographs where it is visible.

        The light is removed from each photograph, and the results are blended by the cosine between skin and
        camera. Lids, mouth and brows keep the colours of the recipe.
        """
        base = linear(albedo)
        free = _face(skin) * (1 - _unpainted(skin))
        layers = []
        for number, (observation, pose) in enumerate(
            zip(self._fit.observations, self._fit.poses, strict=True)
        ):
            photograph = projected(skin, observation, pose, both=number == 0)
            colours, odd = unlit(photograph, base, skin.rng(90 + number))
            layers.append((colours, photograph.weight * smooth(odd, ODD[1], ODD[0]) * free))
        total = sum(weight for _, weight in layers)
        share = np.minimum(total / FULL_WEIGHT, 1)
        mixed = (
            sum(weight[:, None] * colours for colours, weight in layers) / np.maximum(total, 1e-6)[:, None]
        )
        # Beside the pictures the recipe's colours get the tint of nearby picture colours.
        ratio = np.where(share[:, None] > 0, np.log((mixed + 0.01) / (base + 0.01)), 0)
        near = skin.texels.blurred(skin.float(share), SPREAD)
        tint = np.stack([skin.texels.blurred(skin.float(share * part), SPREAD) for part in ratio.T], 1)
        tint = np.exp(tint / np.maximum(near, 0.05)[:, None]) * (base + 0.01) - 0.01
        dry = skin.dry[:, None]
        out = share[:, None] * mixed + (1 - share[:, None]) * np.where(dry, tint, base)
        return skin.float(255 * srgb(np.clip(skin.float(out), 0, 1)))


def _face(skin: Skin) -> Float32:
    """Return the weight (k,) 0..1 of the face: before the ears, above the neck, below the hair."""
    lobe, chin, line = (skin.person.figure.point(name) for name in ("10.7", "2.1", "11.1"))
    before = smooth(skin.at[:, 2] - lobe[2], *BEFORE)
    return skin.float(
        before * smooth(skin.at[:, 1] - chin[1], *BELOW) * smooth(line[1] - skin.at[:, 1], *UNDER)
    )


def _unpainted(skin: Skin) -> Float32:
    """Return the weight (k,) 0..1 of unpainted skin: the mouth, the edges of the lids, the brows."""
    edge = np.zeros(len(skin.person.figure.at))
    for lid in skin.lids:
        for ring in lid.rings[:LIDS]:
            edge[ring] = 1
    brows = smooth(skin.around(*BROWS, radii=BROW), 0.05, 0.5)
    return skin.float(np.maximum.reduce([smooth(skin.field(edge), 0.05, 0.6), brows, 1.0 - skin.dry]))


def projected(skin: Skin, observation: Observation, pose: Pose, both: bool) -> Projected:
    """Return a photograph projected to a skin.

    Args:
        both: whether it shows both halves of the face; if not, the right half is mirrored to the left.
    """
    at, normals = skin.at.astype(np.float64), skin.normals().astype(np.float64)
    if not both:
        mirror = np.where(at[:, :1] > 0, (-1.0, 1.0, 1.0), 1.0)
        at, normals = at * mirror, normals * mirror
    flat, near = pose(at)
    pixels = linear(np.asarray(observation.view.image))
    pixel = (flat - 0.5).T[::-1]
    colours = np.stack(
        [map_coordinates(channel, pixel, order=1, mode="nearest") for channel in np.moveaxis(pixels, 2, 0)], 1
    )
    inside = ((flat >= 1) & (flat <= np.array(pixels.shape[1::-1]) - 1)).all(axis=1)
    facing = smooth(normals @ pose.rotation[2], *FACING)
    return Projected(skin.float(colours), skin.float(facing * inside * _open(flat, near)), normals)


def _open(flat: Float64, near: Float64) -> Any:
    """Return which texels (k,) are visible, by a depth image of all texels."""
    cell = np.floor((flat - flat.min(axis=0)) / CELL).astype(int)
    wide = cell[:, 0].max() + 1
    index = cell[:, 1] * wide + cell[:, 0]
    depth = np.full(index.max() + 1, -np.inf)
    np.maximum.at(depth, index, near)
    return near > depth[index] - HIDDEN


def unlit(photograph: Projected, base: Float32, rng: np.random.Generator) -> tuple[Float32, Float32]:
    """Return the albedo (k, 3) in a photograph, and its difference (k,) from the recipe's.

    Diffuse light is approximated by a polynomial of degree 2 in the normal (Ramamoorthi and Hanrahan 2001).
    The polynomial that fits the recipe's colours best to the picture's is divided out.

    Args:
        base: the recipe's colours (k, 3), 0..1.
    """
    chosen = np.flatnonzero(photograph.weight > 0.3)
    chosen = rng.choice(chosen, min(SAMPLE, len(chosen)), replace=False)
    terms = _terms(photograph.normals[chosen])
    ratio = photograph.colours[chosen] / (base[chosen] + 0.01)
    weights = photograph.weight[chosen].astype(np.float64)
    light = np.zeros((terms.shape[1], 3))
    for _ in range(ROUNDS):
        root = np.sqrt(weights)[:, None]
        light = np.linalg.lstsq(root * terms, root * ratio, rcond=1e-4)[0]
        level = terms @ light
        deviation = np.log((ratio.mean(axis=1) + 0.02) / (np.maximum(level.mean(axis=1), 0) + 0.02))
        weights = photograph.weight[chosen] * np.exp(-0.5 * (deviation / ALIKE) ** 2)
    mean = np.average(level, axis=0, weights=weights)
    every = np.maximum(_terms(photograph.normals) @ light, LEAST * mean)
    colours = photograph.colours / every
    odd = np.abs(np.log((colours.mean(axis=1) + 0.01) / (base.mean(axis=1) + 0.01)))
    return np.asarray(np.clip(colours, 0, 1), np.float32), np.asarray(odd, np.float32)


def _terms(normals: Float64) -> Float64:
    """Return the nine polynomials (k, 9) of degree 2 of unit normals (k, 3)."""
    x, y, z = normals.T
    return np.stack([np.ones_like(x), x, y, z, x * y, y * z, x * z, x * x - y * y, 3 * z * z - 1], axis=1)
