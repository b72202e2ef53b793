"""FAP displacement fields of a head with blend shapes, each exactly 1 at its feature point.

A shape such as a raised brow moves several feature points. On the line through them, each feature point has
a weight that is 1 at itself and 0 at the others. The field of its FAP is the weighted shape, divided by the
displacement of the shape on the line. So the FAPs together reproduce the shape, and each feature point is
moved by its FAP only.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.mesh_geometry import half_edges, neighbour_mean
from realizer.tables import faps
from realizer_studio.faces.arkit.mouth import Mouth
from realizer_studio.faces.mpeg4.zone_fields import DIRECTIONS
from realizer_studio.faces.mpeg4.zones import Triple
from realizer_studio.faces.parts import smooth

FLOOR = 0.35  # least share of the largest displacement on a line; a smaller one would inflate the field
TRUE = 0.25  # least share of its largest displacement by which a shape moves a point in a FAP's direction
BLOWN = 0.1  # the same for cheeks, which move more forwards than sideways
# FAP -> its point, its station along the lips (0 right corner .. 4 left), and 1 on the outer contour.
UPPER = {
    4: ("2.2", 2, 0), 8: ("2.6", 3, 0), 9: ("2.7", 1, 0), 51: ("8.1", 2, 1), 55: ("8.5", 3, 1),
    56: ("8.6", 1, 1),
}  # fmt: skip
LOWER = {
    5: ("2.3", 2, 0), 10: ("2.8", 3, 0), 11: ("2.9", 1, 0), 52: ("8.2", 2, 1), 57: ("8.7", 3, 1),
    58: ("8.8", 1, 1),
}  # fmt: skip
BROWS = {1: ((31, "4.1"), (33, "4.3"), (35, "4.5")), -1: ((32, "4.2"), (34, "4.4"), (36, "4.6"))}
CORNERS = {1: ((6, 12, "2.4", 0), (53, 59, "8.3", 1)), -1: ((7, 13, "2.5", 0), (54, 60, "8.4", 1))}
WORDS = {1: "Left", -1: "Right"}
MIDDLE = 0.2  # of half a lip: where the fields of both corners overlap
BINS = 24  # samples across an eye


class ShapedSkin:
    """The skin with its shapes and feature points.

    Args:
        skin: (n, 3) metres; triangles: (m, 3); moves: ARKit's name -> (n, 3).
        points: feature point -> metres; vertex: feature point -> vertex of the skin.
        mouth: coordinates around the mouth; upper_lid: side (1, -1) -> (n,) 1 above the slit.
        zones: FAP -> field (n, 3) made by zones.
    """

    def __init__(
        self, skin: Float64, triangles: Int32, moves: Mapping[str, Float64], points: Mapping[str, Triple],
        vertex: Mapping[str, int], mouth: Mouth, upper_lid: Mapping[int, Float64],
        zones: Mapping[int, Float64],
    ) -> None:  # fmt: skip
        self.skin, self.moves, self.mouth, self.upper_lid = skin, moves, mouth, upper_lid
        self.positions = {name: np.array(value, float) for name, value in points.items()}
        self.vertex, self.zones = vertex, zones
        self.mean = neighbour_mean(len(skin), half_edges(triangles))
        self.eyes = float(self.positions["3.5"][0] - self.positions["3.6"][0])
        # From 1 on the lips, which FAP 3 does not move, to 0 at the chin.
        reach = 0.95 * float(np.linalg.norm(self.positions["8.2"] - self.positions["2.1"]))
        self.lip_share = np.asarray(smooth(mouth.distance, reach, 0.0015))

    def move(self, *names: str) -> Float64 | None:
        """Return the sum of shapes, or None if one is missing."""
        if any(name not in self.moves for name in names):
            return None
        return np.asarray(np.sum([self.moves[name] for name in names], axis=0))

    def smoothed(self, field: Float64) -> Float64:
        return np.asarray(self.mean @ field)

    def without(
        self, move: Float64, fields: Mapping[int, Float64 | None], removed: tuple[int, ...]
    ) -> Float64:
        """Return a shape less the movement of some FAPs, measured at their feature points."""
        for fap in removed:
            row = faps()[fap - 1]
            field = fields.get(fap)
            field = self.zones[fap] if field is None else field
            vertex = self.vertex[row.feature_point]
            amount = float(move[vertex] @ field[vertex]) / max(float(field[vertex] @ field[vertex]), 1e-12)
            move = move - amount * field
        return move

    def exact(self, fap: int, field: Float64, least: float = TRUE) -> Float64 | None:
        """Return the field scaled to 1 in the FAP's direction at its point, or None if it moves otherwise."""
        row = faps()[fap - 1]
        displacement = field[self.vertex[row.feature_point]]
        amount = float(displacement @ np.array(DIRECTIONS[row.direction]))
        if amount < least * float(np.linalg.norm(field, axis=1).max(initial=1e-12)):
            return None
        return field / amount


def shape_fields(shaped: ShapedSkin) -> dict[int, Float64]:
    """Return FAP -> field (n, 3) on the skin, for every FAP that can be made from the head's shapes."""
    found = _brows(shaped) | _cheeks(shaped) | _lids(shaped) | _chin(shaped) | _lip_funnel(shaped)
    found |= _corners(shaped, found)
    found |= _upper_lip(shaped, found) | _lower_lip(shaped)
    return {fap: field for fap, field in found.items() if field is not None}


def _upper_lip(shaped: ShapedSkin, fields: Mapping[int, Float64 | None]) -> dict[int, Float64 | None]:
    """Return the fields of the upper lip, from the shape that bares the upper teeth."""
    move = shaped.move("mouthUpperUpLeft", "mouthUpperUpRight")
    if move is None:
        return {}
    # Nose and cheeks are moved by other FAPs.
    move = shaped.without(move, fields, (41, 42, 61, 62, 63, 17))
    weight = smooth(shaped.mouth.distance, 0.030, 0.0) * shaped.mouth.upper
    return _line(shaped, UPPER, move, weight)


def _lower_lip(shaped: ShapedSkin) -> dict[int, Float64 | None]:
    """Return the fields of the lower lip, from its part of the jaw's opening; FAP 3 has the rest."""
    move = shaped.move("jawOpen")
    if move is None:
        return {}
    return _line(shaped, LOWER, move, shaped.lip_share * (1 - shaped.mouth.upper))


def _line(
    shaped: ShapedSkin, line: Mapping[int, tuple[str, int, int]], move: Float64, weight: Float64
) -> dict[int, Float64 | None]:
    """Return a shape divided among the points of a lip."""
    mouth, height = shaped.mouth, np.zeros((2, 5))
    direction = np.array(DIRECTIONS[faps()[min(line) - 1].direction])
    for name, knot, outer in line.values():
        height[outer, knot] = -float(move[shaped.vertex[name]] @ direction)
    largest = height.max()
    if largest <= 0:
        return {}
    height[:, [0, 4]] = height[:, [1, 3]]  # the shape ends at the corners
    height = np.maximum(height, FLOOR * largest)
    local = (1 - mouth.outer) * (height[0] @ mouth.knots) + mouth.outer * (height[1] @ mouth.knots)
    profile = -move / local[:, None] * weight[:, None]
    return {
        fap: shaped.exact(
            fap, profile * ((mouth.outer if outer else 1 - mouth.outer) * mouth.knots[knot])[:, None]
        )
        for fap, (_, knot, outer) in line.items()
    }


def _corners(shaped: ShapedSkin, fields: Mapping[int, Float64 | None]) -> dict[int, Float64 | None]:
    """Return the fields of the corners: a smile and a stretch, combined to move a corner only up or only out.

    Half a lip moves outwards with its corner, because no other FAP moves it sideways, and a corner alone
    would fold the lip over the cheek. Upwards each station has its own FAP.
    """
    out: dict[int, Float64 | None] = {}
    for side, rows in CORNERS.items():
        smile, wide = (shaped.move(f"mouth{stem}{WORDS[side]}") for stem in ("Smile", "Stretch"))
        if smile is None or wide is None:
            continue
        smile, wide = (shaped.without(shape, fields, (41 if side > 0 else 42,)) for shape in (smile, wide))
        for across, upward, name, outer in rows:
            vertex = shaped.vertex[name]
            pull = np.array(
                [[smile[vertex, 0] * side, wide[vertex, 0] * side], [smile[vertex, 1], wide[vertex, 1]]]
            )
            size = np.linalg.norm(pull, axis=0)
            if size.min() < 1e-4 or abs(np.linalg.det(pull / size)) < 0.2:
                continue  # both move the corner in one direction
            mixes = np.linalg.solve(pull, np.eye(2))
            half = np.asarray(smooth(shaped.mouth.along * side, -MIDDLE, MIDDLE))
            corner = shaped.mouth.knots[4 if side > 0 else 0]
            contour = shaped.mouth.outer if outer else 1 - shaped.mouth.outer
            share = np.stack([half, corner, half], axis=1) * contour[:, None]
            for fap, mix in ((across, mixes[:, 0]), (upward, mixes[:, 1])):
                out[fap] = shaped.exact(fap, (smile * mix[0] + wide * mix[1]) * share)
    return out


def _lip_funnel(shaped: ShapedSkin) -> dict[int, Float64 | None]:
    """Return the fields of FAPs 16 and 17: the forward movement of each lip in a funnel."""
    move = shaped.move("mouthFunnel")
    if move is None:
        return {}
    bow = (1 + np.cos(np.pi * np.clip(shaped.mouth.along, -1, 1))) / 2
    ahead = np.clip(move[:, 2:], 0, None) * bow[:, None] * [0, 0, 1.0]
    upper = shaped.mouth.upper[:, None]
    return {16: shaped.exact(16, ahead * (1 - upper)), 17: shaped.exact(17, ahead * upper)}


def _off_lids(shaped: ShapedSkin) -> Float64:
    """Return 0 on the edges of the lids, which follow neither brows nor cheeks, 1 elsewhere, (n, 1)."""
    shut = np.zeros(len(shaped.skin))
    for word in WORDS.values():
        blink = shaped.move(f"eyeBlink{word}")
        if blink is not None:
            size = np.linalg.norm(blink, axis=1)
            shut = np.maximum(shut, size / max(float(size.max()), 1e-12))
    return np.asarray(1 - smooth(shut, 0.08, 0.6))[:, None]


def _brows(shaped: ShapedSkin) -> dict[int, Float64 | None]:
    move = shaped.move("browInnerUp", "browOuterUpLeft", "browOuterUpRight")
    if move is None:
        return {}
    move = shaped.smoothed(move * _off_lids(shaped))
    out: dict[int, Float64 | None] = {}
    for side, line in BROWS.items():
        x = shaped.skin[:, 0] * side
        stations = np.abs([shaped.positions[name][0] for _, name in line])
        if (np.diff(stations) <= 0).any():
            continue
        height = np.array([move[shaped.vertex[name], 1] for _, name in line])
        height = np.maximum(height, FLOOR * height.max())
        if height.max() <= 0:
            continue
        ramps = smooth(x, stations[0], stations[1]), smooth(x, stations[1], stations[2])
        shares = (1 - ramps[0], ramps[0] - ramps[1], ramps[1])
        local = sum(share * tall for share, tall in zip(shares, height, strict=True))
        # Both sides lift the middle by half.
        half = smooth(x, -0.2 * shaped.eyes, 0.2 * shaped.eyes)
        for (fap, _), share in zip(line, shares, strict=True):
            out[fap] = shaped.exact(fap, move * (half * share / local)[:, None])
    return out


def _cheeks(shaped: ShapedSkin) -> dict[int, Float64 | None]:
    out: dict[int, Float64 | None] = {}
    free = np.asarray(smooth(shaped.mouth.distance, 0.0, 0.012))[:, None]
    puff = shaped.move("cheekPuff")
    for side, puffed, lifted in ((1, 39, 41), (-1, 40, 42)):
        if puff is not None:
            half = smooth(shaped.skin[:, 0] * side, -0.008, 0.008)
            far = smooth(shaped.mouth.distance, 0.0, 0.032)
            out[puffed] = shaped.exact(puffed, puff * (half * far)[:, None], BLOWN)
        squint = shaped.move(f"cheekSquint{WORDS[side]}")
        if squint is not None:
            out[lifted] = shaped.exact(lifted, shaped.smoothed(squint * free * _off_lids(shaped)))
    return out


def _chin(shaped: ShapedSkin) -> dict[int, Float64 | None]:
    """Return the field of FAP 18, from the shrug of the lower lip, without the lip."""
    move = shaped.move("mouthShrugLower")
    if move is None:
        return {}
    free = smooth(shaped.mouth.distance, 0.001, 0.010) * (1 - shaped.mouth.upper)
    return {18: shaped.exact(18, shaped.smoothed(move * free[:, None]))}


def _lids(shaped: ShapedSkin) -> dict[int, Float64 | None]:
    """Return the fields of FAPs 19 to 22, from the blink; both lids together close the whole opening."""
    out: dict[int, Float64 | None] = {}
    for side, top, bottom in ((1, 19, 21), (-1, 20, 22)):
        move = shaped.move(f"eyeBlink{WORDS[side]}")
        if move is None:
            continue
        on_upper = shaped.upper_lid[side]
        x = shaped.skin[:, 0] * side
        falls, rises = -move[:, 1] * on_upper, move[:, 1] * (1 - on_upper)
        moved = np.linalg.norm(move, axis=1) > 0.1 * np.linalg.norm(move, axis=1).max()
        samples = np.linspace(x[moved].min(), x[moved].max(), BINS)
        fall, rise = _largest(x, falls, samples), _largest(x, rises, samples)
        gap = np.interp(x, samples, fall + rise) / np.maximum(np.interp(x, samples, fall), 1e-6)
        out[top] = shaped.exact(top, move * (on_upper * np.clip(gap, 1, 3))[:, None])
        middle = abs(float(shaped.positions["3.3"][0]))
        open_ = np.interp(x, samples, fall + rise) / max(float(np.interp(middle, samples, fall + rise)), 1e-9)
        out[bottom] = shaped.exact(bottom, shaped.zones[bottom] * np.clip(open_, 0, 1.2)[:, None])
    return out


def _largest(x: Float64, amount: Any, samples: Float64) -> Float64:
    """Return the largest amount near each sample, smoothed over neighbouring samples."""
    step = samples[1] - samples[0]
    is_near = np.abs(x[:, None] - samples) < 0.75 * step
    largest = np.where(is_near, amount[:, None], 0).max(axis=0)
    padded = np.pad(largest, 1, mode="edge")
    return np.asarray((padded[:-2] + 2 * padded[1:-1] + padded[2:]) / 4)
