"""A person: the base mesh morphed to a recipe, and the measurements on it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.mesh_geometry import fit_ball
from realizer.tables import csv_rows
from realizer.tables.arkit_names import other_side
from realizer_studio.faces.eyeball import CORNEA, cornea
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.person import makehuman
from realizer_studio.faces.person.lids import Lid
from realizer_studio.faces.person.lips import Lips, close_lips
from realizer_studio.faces.person.makehuman import Ground

MIRROR = np.array([-1.0, 1.0, 1.0])
# Lengths of the bust, in faces (from the hairline 11.1 to the chin 2.1: 15 to 18 cm).
FLOOR = 0.61  # the bust ends that far below the collarbones
NECK_TOP, NECK_LENGTH = 0.092, 0.433  # below the chin the head's turn fades out, over that length,
NECK_TILT = 0.30  # along a plane that falls with the jaw by that much
NOD = np.array([0.0, -0.082, -0.012])  # the head nods about a point below and behind the head's joint
# m from the joint to the axis that the jaw turns about in effect: the joint slides forwards while it turns
# (Ostry, Vatikiotis-Bateson & Gribble 1997, JSLHR 40), so that the axis lies below and behind it.
JAW_AXIS = np.array([0, -0.028, -0.004])
CORNER = (0.007, 0.006, 0.009)  # m; half axes of the region smoothed at a corner of the mouth,
RELAXED = 5  # and how many times
ROUNDED = 4  # times that the lower lip is smoothed along itself: shape targets bend it like a polygon;
TAUBIN = 0.5, -0.52  # the steps of a time, which keep its size (Taubin 1995),
ENDS = 0.95, 0.65  # between these u, less towards the corners
ARCH = 0.74, 0.80  # half axes of the teeth's arch, in half widths and depths of the data's arches


@dataclass(frozen=True, eq=False)
class Person:
    """The base mesh as one person."""

    # Its vertices (metres, origin between the eyes, lips closed), landmarks and expression shapes.
    ground: Ground
    balls: tuple[tuple[Float64, float], ...]  # centre (3,) and radius of the left and the right eyeball
    face: float  # metres from hairline to chin
    jaw_pivot: Float64  # (3,) rotation centre of the jaw
    head_pivot: Float64  # (3,) rotation centre of the head
    floor: float  # y of the plane that the bust ends in
    arch: tuple[float, float]  # half width and depth of the upper teeth's arch, metres

    def turns(self) -> Float64:
        """Return how far each base vertex turns with the head, (n,): 1 above the jaw, 0 below the neck."""
        at, chin = self.ground.at, self.ground.point("2.1")
        top = chin[1] + NECK_TILT * chin[2] - NECK_TOP * self.face
        level = at[:, 1] + NECK_TILT * at[:, 2]
        return np.asarray(smooth(level, top - NECK_LENGTH * self.face, top))


def person_of(
    data: Path, targets: Mapping[str, float], warp: Callable[[Float64], Float64] | None = None
) -> Person:
    """Make a person of the base mesh and weighted shape targets.

    Args:
        warp: takes vertices (n, 3) in metres to where they go; left and right alike.
    """
    mesh = makehuman.read_base(data)
    at = identity(mesh, data, targets)
    at = at if warp is None else warp(at)
    points = _landmarks(mesh, at)
    twin = mesh.mirror()

    @cache
    def shape(unit: str) -> Float64:
        # The data are rounded to a tenth of a millimetre, each side on its own: take the mean of both.
        sides = [makehuman.read_target(data, name, len(at)) for name in (unit, other_side(unit))]
        return np.asarray((sides[0] + sides[1][twin] * MIRROR) / 2 * makehuman.DECIMETRE)

    at = _relaxed(Ground(mesh, at, points, shape))
    ground = Ground(mesh, close_lips(Ground(mesh, at, points, shape)), points, shape)
    eyes = balls(ground)
    ground = Ground(mesh, cleared(ground, eyes), points, shape)
    face = float(ground.point("11.1")[1] - ground.point("2.1")[1])
    arch = np.ptp(at[np.unique(mesh.quads["helper-upper-teeth"])], axis=0)
    return Person(
        ground=ground,
        balls=eyes,
        face=face,
        jaw_pivot=_joint(mesh, at, "joint-mouth") + JAW_AXIS,
        head_pivot=_joint(mesh, at, "joint-head") + NOD * face,
        floor=float(_joint(mesh, at, "joint-l-clavicle")[1]) - FLOOR * face,
        arch=(ARCH[0] * float(arch[0]) / 2, ARCH[1] * float(arch[2])),
    )


def identity(mesh: makehuman.BaseMesh, data: Path, targets: Mapping[str, float]) -> Float64:
    """Return the base mesh mixed to a person, (n, 3) metres: symmetric, origin between the eyes."""
    at = mesh.vertices.copy()
    for target, weight in targets.items():
        for side in ("l-", "r-") if "*" in target else ("",):
            at += weight * makehuman.read_target(data, target.replace("*", side), len(at))
    at = (at + at[mesh.mirror()] * MIRROR) / 2
    eyes = [at[np.unique(mesh.quads[f"helper-{side}-eye"])].mean(axis=0) for side in "lr"]
    return np.asarray((at - (eyes[0] + eyes[1]) / 2) * makehuman.DECIMETRE)


def _relaxed(ground: Ground) -> Float64:
    """Return the base mesh (n, 3) with smooth corners of the mouth, where shape targets bunch vertices.

    The lower lip gets a round border.
    """
    at, lips = ground.at.copy(), Lips(ground)
    rings = np.array(lips.rings)
    share = smooth(np.abs(lips.u[rings]), *ENDS) * ~lips.is_upper[rings]
    for step in TAUBIN * ROUNDED:
        line = at[rings]
        beside = (np.roll(line, 1, axis=1) + np.roll(line, -1, axis=1)) / 2
        at[rings] += step * share[..., None] * (beside - line)
    near = np.maximum(*(ground.ellipsoid(ground.point(name), CORNER) for name in ("2.4", "2.5")))[:, None]
    for _ in range(RELAXED):
        at = at + near * (ground.smoothed(at) - at)
    return at


def _joint(mesh: makehuman.BaseMesh, at: Float64, name: str) -> Float64:
    return np.asarray(at[np.unique(mesh.quads[name])].mean(axis=0))


def _landmarks(mesh: makehuman.BaseMesh, at: Float64) -> dict[str, int]:
    """Return feature point -> base vertex; those on the tongue are located."""
    table = csv_rows("hm08_landmarks.csv", _Landmark, __package__)
    points = {row.feature_point: row.vertex for row in table}
    mine = np.unique(mesh.quads["helper-tongue"])
    tongue = at[mine]
    top = mine[tongue[:, 1] > np.median(tongue[:, 1])]
    points["6.1"] = int(mine[np.argmax(tongue[:, 2] - np.abs(tongue[:, 0]))])
    back, front = tongue[:, 2].min(), tongue[:, 2].max()
    middle = np.array([0, tongue[:, 1].max(), back + 0.60 * (front - back)])
    points["6.2"] = int(top[np.argmin(np.linalg.norm((at[top] - middle) * [3, 0.3, 1], axis=1))])
    band = np.abs(tongue[:, 2] - (back + 0.72 * (front - back))) < 0.09 * (front - back)
    points["6.3"] = int(mine[band][np.argmax(tongue[band, 0])])
    points["6.4"] = int(mine[band][np.argmin(tongue[band, 0])])
    return points


@dataclass(frozen=True, slots=True)
class _Landmark:
    feature_point: str
    vertex: int


Ball = tuple[Float64, float]  # centre (3,) and radius, metres
INSET = 0.00015  # m; how much deeper the ball lies than the socket's fit
RISE = 0.085  # of the distance between the lids: how far pupils are above the middle, as people's are
CLEAR = 0.00030, 0.00065, 0.0008, 0.0008, 0.0008, 0.0008  # m from the ball to the rings of the lid, outwards,
AROUND = 0.0008, 0.0002  # and to other skin, of which no more is in the ball by now


def balls(ground: Ground) -> tuple[Ball, Ball]:
    """Return the left and the right eyeball: they fit the sockets, at a height that suits the lids."""
    made = []
    for side, upper, lower in (("l", "3.1", "3.3"), ("r", "3.2", "3.4")):
        centre, radius = fit_ball(ground.at[np.unique(ground.mesh.quads[f"helper-{side}-eye"])])
        high, low = ground.point(upper)[1], ground.point(lower)[1]
        centre[1] = (high + low) / 2 + RISE * (high - low)
        made.append((centre, radius - INSET))
    return made[0], made[1]


def cleared(ground: Ground, eyes: tuple[Ball, Ball]) -> Float64:
    """Return the base mesh (n, 3) with lids and the skin around them outside balls and corneas."""
    at = ground.at.copy()
    for side, (centre, radius) in zip((1, -1), eyes, strict=True):
        before, _ = cornea(radius)
        lid = Lid(ground, side)
        known = [*lid.rings, [vertex for vertex, _, _ in lid.followers(ground)[1]]]
        out = ground.body & (np.linalg.norm(at - centre, axis=1) > radius - AROUND[1])
        others = np.setdiff1d(np.flatnonzero(out), np.concatenate(known)).tolist()
        for ring, room in zip((*lid.rings, others), (*CLEAR, AROUND[0]), strict=True):
            for middle, size in ((centre, radius), (centre + np.array([0, 0, before]), CORNEA)):
                away = at[ring] - middle
                left = (size + room) ** 2 - away[:, 0] ** 2 - away[:, 1] ** 2
                push = np.sqrt(np.maximum(left, 0)) - away[:, 2]
                at[ring, 2] += np.where((left > 0) & (away[:, 2] > 0), np.maximum(push, 0), 0)
    return at
