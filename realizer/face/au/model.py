"""The model of a face's action units: functions that displace any point (Wojdel 2005, chapter 4)."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.au.functions import heading, height

CENTIMETRE = 0.01  # m; the functions' unit of length, with which their parameters are near 1
BEND_DEPTH = 0.008  # m before and behind the line between the lips; beyond it the mouth's plane is level
FADE_WIDTH = 0.008  # m on either side of the middle, in which an action unit of one side fades out


@dataclass(frozen=True, eq=False)
class Motion:
    """The density and direction functions of a displacement."""

    origin: Float64  # (3,) metres, origin of their coordinates
    # (k, 10): height in metres, the rest in centimetres from the origin (`functions.density`).
    gaussians: Float64
    alpha: Float64  # (19,) each (`functions.angle`), radians
    beta: Float64  # (19,) each (`functions.angle`), radians

    def density(self, at: Float64) -> Float64:
        """Return the length (n,) of the displacement of points (n, 3) with full intensity, metres."""
        return height(self.gaussians, (at - self.origin) / CENTIMETRE)

    def direction(self, at: Float64) -> Float64:
        """Return the directions (n, 3) of the displacements of points, unit vectors."""
        return heading(self.alpha, self.beta, (at - self.origin) / CENTIMETRE)

    def __call__(self, at: Float64) -> Float64:
        """Return the displacement (n, 3) with full intensity, metres (equation 4.1)."""
        lengths, moves = self.density(at), np.zeros(at.shape)
        # Where the density is zero, the polynomials of the direction are large and meaningless.
        near = np.flatnonzero(np.abs(lengths) > 1e-7)
        moves[near] = lengths[near, None] * self.direction(at[near])
        return moves


@dataclass(frozen=True, eq=False)
class Mouth:
    """The bent plane between upper and lower face, through the corners of the mouth and along the lips."""

    x: Float64  # (k,) metres from the middle, from 0 to the corner
    y: Float64  # (k,) metres, where the lips meet in front
    z: Float64  # (k,) metres, where the lips meet in front
    slope: Float64  # (k,) dy / dz of the plane there

    def above(self, at: Float64) -> Float64:
        """Return the height of points (n, 3) above the plane, (n,) metres."""
        across = np.abs(at[:, 0])
        y, z, slope = (np.interp(across, self.x, line) for line in (self.y, self.z, self.slope))
        # Deep in the mouth and on the cheeks the plane is level.
        return np.asarray(at[:, 1] - y - slope * np.clip(at[:, 2] - z, -BEND_DEPTH, BEND_DEPTH))

    def upper(self, at: Float64) -> Float64:
        """Return 1 above and 0 below the plane, (n,), with a smooth step in the cheeks."""
        fade = np.maximum(np.abs(at[:, 0]) - self.x[-1], 0) + 1e-9
        share = np.clip(self.above(at) / fade / 2 + 0.5, 0, 1)
        return np.asarray(share * share * (3 - 2 * share))


@dataclass(frozen=True, eq=False)
class UnitModel:
    """The model of one action unit: one motion, or one for each half of the face."""

    au: int
    motions: Mapping[str, Motion]  # "whole", or "upper" and "lower"
    jaw_degrees: float = 0.0  # rotation of the lower teeth and the tongue with full intensity

    def displacement(self, at: Float64, mouth: Mouth, upper: Float64 | None = None) -> Float64:
        """Return the displacement (n, 3) of points (n, 3) of the face with full intensity, metres.

        Args:
            upper: (n,) 0..1, membership in the upper half, if the topology of the mesh shows it.
        """
        if "whole" in self.motions:
            return self.motions["whole"](at)
        share = mouth.upper(at) if upper is None else upper
        moves = np.zeros(at.shape)
        for half, part in (("upper", share), ("lower", 1 - share)):
            index = np.flatnonzero(part)
            moves[index] += part[index, None] * self.motions[half](at[index])
        return moves


@dataclass(frozen=True)
class HeadTurn:
    """The rotation of the head, which fades out between chin and collar (4.2.3)."""

    pivot: tuple[float, float, float]  # (3,) metres, centre of the rotation
    top: float  # metres, height from which on the density is 1
    end: float  # metres, height below which it is 0
    tilt: float  # metres of height per metre of z

    def density(self, at: Float64) -> Float64:
        """Return the part of the head's rotation at points, (n,) 0..1."""
        share = np.clip((at[:, 1] + self.tilt * at[:, 2] - self.end) / (self.top - self.end), 0, 1)
        return np.asarray(share * share * (3 - 2 * share))


@dataclass(frozen=True, eq=False)
class Model:
    """The action units of a person's face."""

    form: str  # "published" (one or two Gaussians) or "extended" (up to four)
    source: str  # of the data that the model was fitted to
    licence: str  # of the data that the model was fitted to
    mouth: Mouth
    head: HeadTurn
    # (3,) metres, centres of the left and the right eyeball.
    eyes: tuple[tuple[float, float, float], tuple[float, float, float]]
    jaw: tuple[float, float, float]  # (3,) metres, the jaw's joint
    units: Mapping[int, UnitModel]  # number -> displacement unit
    # Number of an action unit that turns head or eyes -> degrees with full intensity.
    degrees: Mapping[int, float] = field(default_factory=dict)

    def displacement(self, au: int, at: Float64, side: str = "", upper: Float64 | None = None) -> Float64:
        """Return the displacements of points (n, 3) by an action unit with full intensity, (n, 3) metres.

        Args:
            side: "L" or "R" for the character's left or right side alone.
            upper: (n,) 0..1, membership of each point in the upper half; None: by the mouth's plane.
        """
        moves = self.units[au].displacement(at, self.mouth, upper)
        if not side:
            return moves
        return np.asarray(moves * half(at, side)[:, None])

    def gap(self, au: int) -> float:
        """Return the gap between the lips in the middle by an action unit with full intensity, metres."""
        between = np.array([[0.0, self.mouth.y[0], self.mouth.z[0]]])
        upper, lower = (self.displacement(au, between, upper=np.array([half]))[0, 1] for half in (1.0, 0.0))
        return float(upper - lower)


def half(at: Float64, side: str) -> Float64:
    """Return the membership (n,) of points (n, 3) in side "L" or "R", 0..1; the sum of both is 1."""
    share = np.clip((at[:, 0] * (1 if side == "L" else -1) / FADE_WIDTH + 1) / 2, 0, 1)
    return np.asarray(share * share * (3 - 2 * share))


def rotation(axis: tuple[float, float, float], radians: float) -> Float64:
    """Return a right-handed rotation (3, 3) about a unit vector."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], np.float64)
    return np.asarray(np.eye(3) + np.sin(radians) * cross + (1 - np.cos(radians)) * cross @ cross)
