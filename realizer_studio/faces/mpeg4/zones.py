"""The parameters of the MPEG-4 deformer: zones of influence, masks and synchronised sides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.core.errors import FaceError
from realizer.face.mesh_geometry import mirror_twins
from realizer.tables import faps

Falloff = Literal["ease", "smooth", "cosine", "linear"]
FALLOFFS: tuple[Falloff, ...] = ("ease", "smooth", "cosine", "linear")
Triple = tuple[float, float, float]
MIN_POWER = 1e-3  # least exponent of "ease"; with the exponent 0 of an ease of -100 nothing would move
SAMPLES = 2001  # of a smooth curve
MARGIN = 5e-4  # m; largest distance between a vertex and the mirror image of its twin


@dataclass(frozen=True, slots=True)
class Zone:
    """The zone of influence of a FAP's feature point (Paul 2010, 4.3.3)."""

    fap: int  # number of the FAP
    falloff: Falloff  # curve of the influence from the centre to the edge
    size: float  # radius in metres
    scale: Triple = (1.0, 1.0, 1.0)  # factors of the radius along x, y and z
    ease: float = 0.0  # -100..100, for "ease"
    smooth_centre: float = 0.0  # 0..1, for "smooth"
    smooth_side: float = 0.0  # 0..1, for "smooth"
    use_mask: bool = False  # only vertices of the FAP's mask move
    invert_mask: bool = False  # only vertices outside the mask move
    # Metres forwards per metre along the FAP's direction, for skin that slides over a curve.
    slide: float = 0.0
    # 0..1, part of the displacement that points away from `pivot`, not in the FAP's direction.
    radial: float = 0.0
    pivot: Triple = (0.0, 0.0, 0.0)  # (x, y, z) metres, for radial

    def __post_init__(self) -> None:
        where = f"zone of FAP {self.fap}"
        if not 3 <= self.fap <= 68:
            raise FaceError(f"{where}: wanted a FAP from 3 to 68")
        if self.falloff not in FALLOFFS:
            raise FaceError(f"{where}: falloff: wanted one of {', '.join(FALLOFFS)}, got {self.falloff!r}")
        numbers = (self.size, *self.scale, self.ease, self.slide, self.radial, *self.pivot)
        if not np.isfinite(numbers).all():
            raise FaceError(f"{where}: wanted finite numbers, got {numbers}")
        if self.size <= 0 or min(self.scale) <= 0:
            raise FaceError(f"{where}: wanted a size and scales above 0, got {self.size}, {self.scale}")
        for name, value, least, most in (
            ("ease", self.ease, -100, 100),
            ("smooth_centre", self.smooth_centre, 0, 1),
            ("smooth_side", self.smooth_side, 0, 1),
            ("radial", self.radial, 0, 1),
        ):
            if not least <= value <= most:
                raise FaceError(f"{where}: {name}: wanted {least}..{most}, got {value}")

    @property
    def radii(self) -> Float64:
        """(3,) metres along x, y and z."""
        return np.asarray(self.size * np.array(self.scale))

    def influence(self, distance: Any) -> Float64:
        """Return the influence (n,) at distances (n,) in radii: 1 at the centre, 0 at the edge."""
        if self.falloff == "smooth":
            return smooth_curve(distance, self.smooth_centre, self.smooth_side)
        limited = np.clip(distance, 0, 1)
        if self.falloff == "cosine":  # raised cosine (Paul 2010, 8.2)
            return np.asarray((1 + np.cos(np.pi * limited)) / 2, np.float64)
        if self.falloff == "ease":  # Paul 2010, 4.3.3
            power = 1 + self.ease / (100 if self.ease <= 0 else 20)
            limited = limited ** max(power, MIN_POWER)
        return np.asarray(1 - limited, np.float64)

    def mirrored(self, fap: int) -> Zone:
        """Return the mirrored zone, for the FAP of the other side."""
        x, y, z = self.pivot
        return replace(self, fap=fap, pivot=(-x if x else x, y, z))


@dataclass(frozen=True, slots=True)
class Setup:
    """The parameters of the deformer of one head."""

    points: Mapping[str, Triple]  # feature point -> (x, y, z) metres, the centres of the zones
    zones: Mapping[int, Zone]  # FAP -> zone
    masks: Mapping[int, Int32] = field(default_factory=dict)  # FAP -> (k,) vertices that move, ascending
    synced: frozenset[int] = frozenset()  # FAPs whose zone is mirrored to the other side
    # Whether overlapping neighbours share their influence, so that equal FAPs move a lip evenly.
    joined: bool = True
    rigid: frozenset[int] = frozenset()  # FAPs without a zone that move a part of the head as a whole


def smooth_curve(distance: Any, centre: float, side: float) -> Float64:
    """Return the heights of a cubic Bezier curve (Paul 2010, 4.3.4) at distances in radii.

    The control points are (0, 1), (centre, 1), (1, 0) and (1 + side, 0); they are read from a figure, because
    the text has no formula. The curve is a straight line if both parameters are 0.

    Args:
        centre: 0..1, flattens the curve near the centre.
        side: 0..1, part of the radius by which the zone becomes larger.
    """
    t = np.linspace(0, 1, SAMPLES)
    second, third, fourth = 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3  # Bernstein polynomials
    x = second * centre + third + fourth * (1 + side)
    height = (1 - t) ** 3 + second
    return np.asarray(np.interp(np.maximum(distance, 0), x, height, right=0.0), np.float64)


def mask_faults(setup: Setup, skin: tuple[int, int]) -> list[str]:
    """Return a sentence for each mask with vertices beyond the skin's (first, last + 1)."""
    first, last = skin
    return [
        f"mask of FAP {fap}: wanted vertices of the skin, {first}..{last - 1}, got {mask.min()}.."
        f"{mask.max()}; take out the others"
        for fap, mask in setup.masks.items()
        if len(mask) and (mask.min() < first or mask.max() >= last)
    ]


def synchronised(setup: Setup, vertices: Float64 | None = None) -> Setup:
    """Return the setup with each synchronised FAP's zone, and its mask, copied to the other side.

    The FAP with the lower number of a pair, which is on the left side, is copied.

    Args:
        vertices: (n, 3) metres; needed if masks are mirrored.

    Raises:
        FaceError: a mask's vertex has no twin.
    """
    zones, masks = dict(setup.zones), dict(setup.masks)
    for row in faps()[2:]:
        if row.fap not in setup.synced or row.mirror <= row.fap or row.fap not in zones:
            continue
        zones[row.mirror] = zones[row.fap].mirrored(row.mirror)
        if row.fap in masks and vertices is not None:
            masks[row.mirror] = mirror_mask(masks[row.fap], vertices, row.fap)
    return replace(setup, zones=zones, masks=masks)


def mirrorable(setup: Setup, vertices: Float64) -> Setup:
    """Return the setup with synchronisation removed from FAPs whose masks have no mirror image.

    Args:
        vertices: (n, 3) metres, of the skin.
    """
    twin = mirror_twins(vertices, MARGIN)
    lost = {fap for fap, mask in setup.masks.items() if (twin[mask] < 0).any()}
    return replace(setup, synced=setup.synced - lost - {faps()[fap - 1].mirror for fap in lost})


def mirror_mask(mask: Int32, vertices: Float64, fap: int) -> Int32:
    """Return the mirror images of a mask's vertices, ascending.

    Raises:
        FaceError: one has no twin within `MARGIN`.
    """
    twin = mirror_twins(vertices, MARGIN)[mask]
    if (twin < 0).any():
        raise FaceError(
            f"mask of FAP {fap}: vertex {mask[twin < 0][0]} has no twin on the other side within "
            f"{MARGIN * 1000:.1f} mm; the mask can be mirrored on a symmetrical mesh only"
        )
    return np.unique(twin)
