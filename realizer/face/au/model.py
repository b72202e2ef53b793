"""The model of a face's action units: functions that displace any point (Wojdel 2005, chapter 4)."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.au.functions import heading, height

CENTIMETRE = 0.01  # m; the unit of the functions' coordinates, in which their parameters are near 1
BENT = 0.008  # m before and behind the line between the lips; beyond it the mouth's plane is level
SIDES = 0.008  # m; the halves of an action unit shown on one side fade into each other over twice this


@dataclass(frozen=True, eq=False)
class Motion:
    """A density and a direction function.

    Attributes:
        origin: (3,) metres, where their coordinates begin.
        gaussians: (k, 10): height in metres, the rest in centimetres from the origin (`functions.density`).
        alpha, beta: (19,) each (`functions.angle`), radians.
    """

    origin: Float64
    gaussians: Float64
    alpha: Float64
    beta: Float64

    def density(self, at: Float64) -> Float64:
        """Return the length (n,) of the displacement of points (n, 3) with full intensity, metres."""
        return height(self.gaussians, (at - self.origin) / CENTIMETRE)

    def direction(self, at: Float64) -> Float64:
        """Return the unit vectors (n, 3) that points are moved along."""
        return heading(self.alpha, self.beta, (at - self.origin) / CENTIMETRE)

    def __call__(self, at: Float64) -> Float64:
        """Return the displacement (n, 3) with full intensity, metres (equation 4.1)."""
        far, moves = self.density(at), np.zeros(at.shape)
        # Far off, polynomials are large and mean nothing; the density is nought there.
        near = np.flatnonzero(np.abs(far) > 1e-7)
        moves[near] = far[near, None] * self.direction(at[near])
        return moves


@dataclass(frozen=True, eq=False)
class Mouth:
    """The plane that ends the upper half of the face: through the corners of the mouth, bent along the lips.

    Attributes:
        x: (k,) metres from the middle, from 0 to the corner.
        y, z: (k,) metres, where the lips meet in front; slope: (k,) how the plane rises from there with z.
    """

    x: Float64
    y: Float64
    z: Float64
    slope: Float64

    def above(self, at: Float64) -> Float64:
        """Return how far points (n, 3) lie above the plane, (n,) metres."""
        across = np.abs(at[:, 0])
        y, z, slope = (np.interp(across, self.x, line) for line in (self.y, self.z, self.slope))
        # Deep in the mouth and on the bulge of the cheeks, the plane continues level.
        return np.asarray(at[:, 1] - y - slope * np.clip(at[:, 2] - z, -BENT, BENT))

    def upper(self, at: Float64) -> Float64:
        """Return 1 above and 0 below, (n,); beyond the corners the halves fade, or the cheek would tear."""
        fade = np.maximum(np.abs(at[:, 0]) - self.x[-1], 0) + 1e-9
        share = np.clip(self.above(at) / fade / 2 + 0.5, 0, 1)
        return np.asarray(share * share * (3 - 2 * share))


@dataclass(frozen=True, eq=False)
class UnitModel:
    """A displacement unit: one motion, or one for each half of the face.

    Attributes:
        motions: "whole", or "upper" and "lower".
        jaw_degrees: how far the lower jaw (teeth and tongue) turns with full intensity.
    """

    au: int
    motions: Mapping[str, Motion]
    jaw_degrees: float = 0.0

    def displacement(self, at: Float64, mouth: Mouth, upper: Float64 | None = None) -> Float64:
        """Return the displacement (n, 3) of points (n, 3) of the face with full intensity, metres.

        Args:
            upper: (n,) share in the upper half, if the mesh's topology shows it.
        """
        if "whole" in self.motions:
            return self.motions["whole"](at)
        share = mouth.upper(at) if upper is None else upper
        moves = np.zeros(at.shape)
        for half, part in (("upper", share), ("lower", 1 - share)):
            mine = np.flatnonzero(part)
            moves[mine] += part[mine, None] * self.motions[half](at[mine])
        return moves


@dataclass(frozen=True)
class HeadTurn:
    """The head's turns: the density is a smooth step between chin and collar, in a plane that tilts (4.2.3).

    Attributes:
        pivot: (3,) metres; top, end: metres, where the step is 1 and 0; tilt: how much z counts as height.
    """

    pivot: tuple[float, float, float]
    top: float
    end: float
    tilt: float

    def density(self, at: Float64) -> Float64:
        """Return how far points turn with the head, (n,) 0..1."""
        share = np.clip((at[:, 1] + self.tilt * at[:, 2] - self.end) / (self.top - self.end), 0, 1)
        return np.asarray(share * share * (3 - 2 * share))


@dataclass(frozen=True, eq=False)
class Model:
    """A person's face by action units.

    Attributes:
        form: "published" (one or two Gaussians) or "extended" (up to four).
        source, licence: of the data that the model was fitted to.
        units: number -> displacement unit.
        degrees: number -> degrees that a unit of turning turns with full intensity.
        eyes: (3,) metres, centres of the left and the right eyeball; jaw: (3,) metres, the jaw's joint.
    """

    form: str
    source: str
    licence: str
    mouth: Mouth
    head: HeadTurn
    eyes: tuple[tuple[float, float, float], tuple[float, float, float]]
    jaw: tuple[float, float, float]
    units: Mapping[int, UnitModel]
    degrees: Mapping[int, float] = field(default_factory=dict)

    def displacement(self, au: int, at: Float64, side: str = "", upper: Float64 | None = None) -> Float64:
        """Return how far a displacement unit moves points (n, 3) with full intensity, (n, 3) metres.

        Args:
            side: "L" or "R" for one side alone, as the character has it.
            upper: (n,) how far each point belongs to the upper half; None: by the mouth's plane.
        """
        moves = self.units[au].displacement(at, self.mouth, upper)
        if not side:
            return moves
        return np.asarray(moves * half(at, side)[:, None])

    def gap(self, au: int) -> float:
        """Return how far a displacement unit parts the lips in the middle with full intensity, metres."""
        between = np.array([[0.0, self.mouth.y[0], self.mouth.z[0]]])
        upper, lower = (self.displacement(au, between, upper=np.array([half]))[0, 1] for half in (1.0, 0.0))
        return float(upper - lower)


def half(at: Float64, side: str) -> Float64:
    """Return how far points (n, 3) belong to the character's side "L" or "R", (n,); the sum of both is 1."""
    share = np.clip((at[:, 0] * (1 if side == "L" else -1) / SIDES + 1) / 2, 0, 1)
    return np.asarray(share * share * (3 - 2 * share))


def rotation(axis: tuple[float, float, float], radians: float) -> Float64:
    """Return a right-handed rotation (3, 3) about a unit vector."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], np.float64)
    return np.asarray(np.eye(3) + np.sin(radians) * cross + (1 - np.cos(radians)) * cross @ cross)
