"""The skin's colours from two photographs, projected onto the maps of a recipe's skin."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, Float64
from realizer.core.colours import linear, srgb
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.photo.fit import Fit, Sight
from realizer_studio.faces.photo.shape import Pose
from realizer_studio.faces.skin.skin import Skin

FACING = 0.12, 0.55  # cosines between skin and camera from which a picture counts, and counts fully
CELL, HIDDEN = 3.0, 0.004  # pixels of the depth picture; m behind it from which on skin is hidden
SAMPLE, ROUNDS = 20_000, 6  # texels that the light is measured at, and how often
ALIKE = 0.25  # differences of logarithms that the light does not explain, a standard deviation
# Such differences from which colours are not the skin's, and are certainly not: hair, shadows.
ODD = 0.55, 1.1
LEAST = 0.15  # of the mean light; darker skin is left as dark as it is
BROWS = ("4.1", "4.2", "4.3", "4.4", "4.5", "4.6")
BROW, LIDS = (0.013, 0.0085, 0.03), 2  # half axes about a brow's points; rings of the lids that are left
# m before the lobes of the ears, above the chin and below the hairline between which the pictures fade.
BEFORE, BELOW, UNDER = (0.018, 0.042), (-0.030, 0.0), (-0.005, 0.012)
SPREAD = 45.0  # texels over which colours go on beside the pictures
SEEN = 0.25  # weight from which on a texel shows the pictures alone


@dataclass(frozen=True, eq=False)
class Projected:
    """What a photograph shows at the texels of a skin."""

    colours: Float32  # (k, 3) light 0..1
    weight: Float32  # (k,) 0..1, how much they count
    normals: Float64  # (k, 3) as it sees them


class Painter:
    """Paints a recipe's skin with two photographs."""

    def __init__(self, fit: Fit) -> None:
        self._fit = fit

    def __call__(self, skin: Skin, albedo: Float32) -> Float32:
        """Return the skin's colours (k, 3), sRGB 0..255, with those of the photographs where they show it.

        The light is taken out of each photograph: what of it the recipe's colours and the shape explain. The
        pictures are blended by the cosine between skin and camera. Eyes, mouth and brows stay the recipe's.
        """
        base = linear(albedo)
        free = _face(skin) * (1 - _kept(skin))
        looks = []
        for number, (sight, pose) in enumerate(zip(self._fit.sights, self._fit.poses, strict=True)):
            seen = projected(skin, sight, pose, both=number == 0)
            colours, odd = unlit(seen, base, skin.rng(90 + number))
            looks.append((colours, seen.weight * smooth(odd, ODD[1], ODD[0]) * free))
        total = sum(weight for _, weight in looks)
        share = np.minimum(total / SEEN, 1)
        mixed = sum(weight[:, None] * colours for colours, weight in looks) / np.maximum(total, 1e-6)[:, None]
        # Beside the pictures the recipe's colours are tinted as those within.
        ratio = np.where(share[:, None] > 0, np.log((mixed + 0.01) / (base + 0.01)), 0)
        near = skin.texels.blurred(skin.float(share), SPREAD)
        tint = np.stack([skin.texels.blurred(skin.float(share * part), SPREAD) for part in ratio.T], 1)
        tint = np.exp(tint / np.maximum(near, 0.05)[:, None]) * (base + 0.01) - 0.01
        dry = skin.dry[:, None]
        out = share[:, None] * mixed + (1 - share[:, None]) * np.where(dry, tint, base)
        return skin.float(255 * srgb(np.clip(skin.float(out), 0, 1)))


def _face(skin: Skin) -> Float32:
    """Return where photographs show the face, 0..1 (k,): before the ears, above the neck, below the hair."""
    lobe, chin, line = (skin.person.ground.point(name) for name in ("10.7", "2.1", "11.1"))
    before = smooth(skin.at[:, 2] - lobe[2], *BEFORE)
    return skin.float(
        before * smooth(skin.at[:, 1] - chin[1], *BELOW) * smooth(line[1] - skin.at[:, 1], *UNDER)
    )


def _kept(skin: Skin) -> Float32:
    """Return where the recipe's skin stays, 0..1 (k,): the mouth, the edges of lids, the brows."""
    edge = np.zeros(len(skin.person.ground.at))
    for lid in skin.lids:
        for ring in lid.rings[:LIDS]:
            edge[ring] = 1
    brows = smooth(skin.around(*BROWS, radii=BROW), 0.05, 0.5)
    return skin.float(np.maximum.reduce([smooth(skin.field(edge), 0.05, 0.6), brows, 1.0 - skin.dry]))


def projected(skin: Skin, sight: Sight, pose: Pose, both: bool) -> Projected:
    """Return what a photograph shows of a skin.

    Args:
        both: it shows both halves of the face; else the right one, and the left one is taken to be alike.
    """
    from scipy.ndimage import map_coordinates

    at, normals = skin.at.astype(np.float64), skin.normals().astype(np.float64)
    if not both:
        way = np.where(at[:, :1] > 0, (-1.0, 1.0, 1.0), 1.0)
        at, normals = at * way, normals * way
    flat, near = pose(at)
    pixels = linear(np.asarray(sight.view.image))
    place = (flat - 0.5).T[::-1]
    colours = np.stack(
        [map_coordinates(channel, place, order=1, mode="nearest") for channel in np.moveaxis(pixels, 2, 0)], 1
    )
    inside = ((flat >= 1) & (flat <= np.array(pixels.shape[1::-1]) - 1)).all(axis=1)
    facing = smooth(normals @ pose.rotation[2], *FACING)
    return Projected(skin.float(colours), skin.float(facing * inside * _open(flat, near)), normals)


def _open(flat: Float64, near: Float64) -> Any:
    """Return which texels (k,) nothing hides, by a depth picture made of them all."""
    cell = np.floor((flat - flat.min(axis=0)) / CELL).astype(int)
    wide = cell[:, 0].max() + 1
    index = cell[:, 1] * wide + cell[:, 0]
    depth = np.full(index.max() + 1, -np.inf)
    np.maximum.at(depth, index, near)
    return near > depth[index] - HIDDEN


def unlit(seen: Projected, base: Float32, rng: np.random.Generator) -> tuple[Float32, Float32]:
    """Return the skin's own colours (k, 3) in a photograph, and how odd they are (k,).

    Light from all around a matt surface is a polynomial of degree 2 of its normal (Ramamoorthi and Hanrahan
    2001). The one that makes the recipe's colours most like the picture's is divided out.

    Args:
        base: the recipe's colours (k, 3), 0..1.
    """
    chosen = np.flatnonzero(seen.weight > 0.3)
    chosen = rng.choice(chosen, min(SAMPLE, len(chosen)), replace=False)
    terms = _terms(seen.normals[chosen])
    wanted = seen.colours[chosen] / (base[chosen] + 0.01)
    weights = seen.weight[chosen].astype(np.float64)
    light = np.zeros((terms.shape[1], 3))
    for _ in range(ROUNDS):
        root = np.sqrt(weights)[:, None]
        light = np.linalg.lstsq(root * terms, root * wanted, rcond=1e-4)[0]
        level = terms @ light
        off = np.log((wanted.mean(axis=1) + 0.02) / (np.maximum(level.mean(axis=1), 0) + 0.02))
        weights = seen.weight[chosen] * np.exp(-0.5 * (off / ALIKE) ** 2)
    mean = np.average(level, axis=0, weights=weights)
    every = np.maximum(_terms(seen.normals) @ light, LEAST * mean)
    colours = seen.colours / every
    odd = np.abs(np.log((colours.mean(axis=1) + 0.01) / (base.mean(axis=1) + 0.01)))
    return np.asarray(np.clip(colours, 0, 1), np.float32), np.asarray(odd, np.float32)


def _terms(normals: Float64) -> Float64:
    """Return the nine polynomials (k, 9) of degree 2 of unit normals (k, 3)."""
    x, y, z = normals.T
    return np.stack([np.ones_like(x), x, y, z, x * y, y * z, x * z, x * x - y * y, 3 * z * z - 1], axis=1)
