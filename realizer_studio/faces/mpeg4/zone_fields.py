"""The displacement field of each FAP, per metre of movement of its feature point.

Neighbouring zones that overlap share their influence. At a vertex each zone gets a share of the influence
around the line between their feature points, and the shares add up to one: equal FAPs move the skin between
them evenly, where a plain sum would make a w (Paul 2010, 7.1). A zone's share is 0 at the feature point of a
neighbour, so each feature point moves exactly as its own FAP requests.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

from realizer.core.array_types import Float64
from realizer.core.errors import FaceError
from realizer.face.mesh_geometry import components
from realizer.tables import csv_rows, faps
from realizer_studio.faces.mpeg4.zones import Setup, Zone

# The unit vectors of FAP directions.
DIRECTIONS: dict[str, tuple[float, float, float]] = {
    "up": (0, 1, 0), "down": (0, -1, 0), "left": (1, 0, 0), "right": (-1, 0, 0), "forward": (0, 0, 1),
}  # fmt: skip
NEAREST = 1e-9  # radii; at a feature point the share of its zone is 1
POWER = 1.2  # of the distance: 1 makes a kink at a feature point, 2 a step half-way to the next


@dataclass(frozen=True)
class _Pair:
    one: int
    other: int


pairs = cache(partial(csv_rows, "neighbours.csv", _Pair, __package__))  # FAPs with neighbouring points


def zone_fields(setup: Setup, vertices: Float64) -> dict[int, Float64]:
    """Return FAP -> displacement field (n, 3), for every FAP that has a zone.

    Raises:
        FaceError: a zone whose feature point is missing, whose mask is out of range, or that moves nothing
            at its feature point.
    """
    at = np.asarray(vertices, np.float64)
    n = len(at)
    distance, unmasked = {}, {}
    for fap, zone in setup.zones.items():
        distance[fap] = np.linalg.norm((at - _centre(setup, zone)) / zone.radii, axis=1)
        unmasked[fap] = _unmasked(setup, zone, n)
    weights = {fap: zone.influence(distance[fap]) * unmasked[fap] for fap, zone in setup.zones.items()}
    if setup.joined and setup.zones:
        weights = _shared(setup, at, distance, unmasked, weights)
    return {fap: _directed(setup, zone, at, weights[fap]) for fap, zone in setup.zones.items()}


def _centre(setup: Setup, zone: Zone) -> Float64:
    name = faps()[zone.fap - 1].feature_point
    if name not in setup.points:
        raise FaceError(f"zone of FAP {zone.fap}: its feature point {name} is not there; add it")
    return np.asarray(setup.points[name], np.float64)


def _unmasked(setup: Setup, zone: Zone, n: int) -> Float64:
    if not zone.use_mask:
        return np.ones(n)
    mask = setup.masks.get(zone.fap)
    if mask is None:
        raise FaceError(f"zone of FAP {zone.fap}: it uses a mask and there is none; add one or do not use it")
    if len(mask) and (mask.min() < 0 or mask.max() >= n):
        raise FaceError(
            f"mask of FAP {zone.fap}: wanted vertices 0..{n - 1}, got {mask.min()}..{mask.max()}; "
            "take out those that the mesh does not have"
        )
    unmasked = np.zeros(n)
    unmasked[mask] = 1
    return 1 - unmasked if zone.invert_mask else unmasked


def _shared(
    setup: Setup,
    at: Float64,
    distance: Mapping[int, Float64],
    unmasked: Mapping[int, Float64],
    unshared: Mapping[int, Float64],
) -> dict[int, Float64]:
    """Return the influence of each zone after overlapping neighbours have shared it."""
    links = [pair for pair in pairs() if pair.one in setup.zones and pair.other in setup.zones]
    order = sorted(setup.zones)
    joined = np.array([[order.index(pair.one), order.index(pair.other)] for pair in links], np.int32)
    label = components(joined.reshape(-1, 2), len(order))
    out = dict(unshared)
    for k in np.flatnonzero(np.bincount(label) > 1):
        group = [order[i] for i in np.flatnonzero(label == k)]
        envelope = np.max([unshared[fap] for fap in group], axis=0)
        for pair in links:
            if pair.one in group:
                envelope = np.maximum(
                    envelope, _between(setup, pair, at) * unmasked[pair.one] * unmasked[pair.other]
                )
        # Vertices near a point belong to its zone; zones farther than twice their radius have no influence.
        strength = {
            fap: unmasked[fap]
            * np.clip(2 - distance[fap], 0, None) ** 2
            / np.maximum(distance[fap], NEAREST) ** POWER
            for fap in group
        }
        total = np.maximum(np.sum(list(strength.values()), axis=0), 1e-30)
        for fap in group:
            out[fap] = envelope * strength[fap] / total
    return out


def _between(setup: Setup, pair: _Pair, at: Float64) -> Float64:
    """Return the influence around the line between two neighbours' points, with interpolated radii."""
    one, other = setup.zones[pair.one], setup.zones[pair.other]
    a, b = _centre(setup, one), _centre(setup, other)
    along = b - a
    t = np.clip((at - a) @ along / max(float(along @ along), 1e-18), 0, 1)
    radii = one.radii + t[:, None] * (other.radii - one.radii)
    distance = np.linalg.norm((at - a - t[:, None] * along) / radii, axis=1)
    return (1 - t) * one.influence(distance) + t * other.influence(distance)


def _directed(setup: Setup, zone: Zone, at: Float64, weight: Float64) -> Float64:
    """Return the field of a zone: its influence times its direction, scaled to 1 at the feature point."""
    row = faps()[zone.fap - 1]
    direction = np.array(DIRECTIONS[row.direction])
    move = np.broadcast_to(direction + zone.slide * np.array([0, 0, 1.0]), at.shape)
    middle = _centre(setup, zone)
    if zone.radial:
        outward = at - np.array(zone.pivot)
        outward /= max(float(np.linalg.norm(middle - zone.pivot)), 1e-9)
        move = (1 - zone.radial) * move + zone.radial * outward
    field = np.asarray(move * weight[:, None])
    nearest = int(np.argmin(np.linalg.norm(at - middle, axis=1)))
    scale = float(field[nearest] @ direction)
    if scale < 1e-3:
        raise FaceError(
            f"zone of FAP {zone.fap}: it does not move vertex {nearest} at its feature point "
            f"{row.feature_point}; make it larger, or put the vertex into its mask"
        )
    return np.asarray(field / scale)
