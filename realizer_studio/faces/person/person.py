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
from realizer_studio.faces.person.makehuman import Figure

MIRROR = np.array([-1.0, 1.0, 1.0])
# Lengths of the bust, in faces (from the hairline 11.1 to the chin 2.1: 15 to 18 cm).
FLOOR = 0.61  # from the collarbones down to the end of the bust
NECK_TOP, NECK_LENGTH = 0.092, 0.433  # from the chin down to where the head's rotation fades, and its length
NECK_TILT = 0.30  # slope of the plane along which it fades, parallel to the jaw
NOD = np.array([0.0, -0.082, -0.012])  # from the head's joint to the pivot of nods
# m from the joint to the effective axis of the jaw: the joint slides forwards while it turns
# (Ostry, Vatikiotis-Bateson & Gribble 1997, JSLHR 40), so the axis lies below and behind it.
JAW_AXIS = np.array([0, -0.028, -0.004])
CORNER = (0.007, 0.006, 0.009)  # m; half axes of the region that is smoothed at a corner of the mouth
RELAXED = 5  # smoothing passes there
ROUNDED = 4  # smoothing passes along the lower lip, which shape targets bend like a polygon
TAUBIN = 0.5, -0.52  # the steps of a pass, which keep its size (Taubin 1995)
ENDS = 0.95, 0.65  # u between which that smoothing grows
ARCH = 0.74, 0.80  # half axes of the teeth's arch, relative to those of the data's arches


@dataclass(frozen=True, eq=False)
class Person:
    """The base mesh as one person."""

    # Vertices (metres, origin between the eyes, lips closed), landmarks and expression shapes.
    figure: Figure
    balls: tuple[tuple[Float64, float], ...]  # centre (3,) and radius of the left and the right eyeball
    face: float  # metres from hairline to chin
    jaw_pivot: Float64  # (3,) rotation centre of the jaw
    head_pivot: Float64  # (3,) rotation centre of the head
    floor: float  # y of the plane where the bust ends
    arch: tuple[float, float]  # half width and depth of the upper teeth's arch, metres

    def turns(self) -> Float64:
        """Return the share of the head's rotation for each vertex (n,), 1 above the jaw, 0 below the neck."""
        at, chin = self.figure.at, self.figure.point("2.1")
        top = chin[1] + NECK_TILT * chin[2] - NECK_TOP * self.face
        level = at[:, 1] + NECK_TILT * at[:, 2]
        return np.asarray(smooth(level, top - NECK_LENGTH * self.face, top))


def person_of(
    data: Path, targets: Mapping[str, float], warp: Callable[[Float64], Float64] | None = None
) -> Person:
    """Return the person with the base mesh and weighted shape targets.

    Args:
        warp: a symmetric map of vertices (n, 3) in metres, applied after the shape targets.
    """
    mesh = makehuman.read_base(data)
    at = identity(mesh, data, targets)
    at = at if warp is None else warp(at)
    points = _landmarks(mesh, at)
    twin = mesh.mirror()

    @cache
    def shape(unit: str) -> Float64:
        # The data are rounded to a tenth of a millimetre on each side: the mean of both is symmetric.
        sides = [makehuman.read_target(data, name, len(at)) for name in (unit, other_side(unit))]
        return np.asarray((sides[0] + sides[1][twin] * MIRROR) / 2 * makehuman.DECIMETRE)

    at = _relaxed(Figure(mesh, at, points, shape))
    figure = Figure(mesh, close_lips(Figure(mesh, at, points, shape)), points, shape)
    eyes = balls(figure)
    figure = Figure(mesh, cleared(figure, eyes), points, shape)
    face = float(figure.point("11.1")[1] - figure.point("2.1")[1])
    arch = np.ptp(at[np.unique(mesh.quads["helper-upper-teeth"])], axis=0)
    return Person(
        figure=figure,
        balls=eyes,
        face=face,
        jaw_pivot=_joint(mesh, at, "joint-mouth") + JAW_AXIS,
        head_pivot=_joint(mesh, at, "joint-head") + NOD * face,
        floor=float(_joint(mesh, at, "joint-l-clavicle")[1]) - FLOOR * face,
        arch=(ARCH[0] * float(arch[0]) / 2, ARCH[1] * float(arch[2])),
    )


def identity(mesh: makehuman.BaseMesh, data: Path, targets: Mapping[str, float]) -> Float64:
    """Return the base mesh with shape targets, (n, 3) metres: symmetric, origin between the eyes."""
    at = mesh.vertices.copy()
    for target, weight in targets.items():
        for side in ("l-", "r-") if "*" in target else ("",):
            at += weight * makehuman.read_target(data, target.replace("*", side), len(at))
    at = (at + at[mesh.mirror()] * MIRROR) / 2
    eyes = [at[np.unique(mesh.quads[f"helper-{side}-eye"])].mean(axis=0) for side in "lr"]
    return np.asarray((at - (eyes[0] + eyes[1]) / 2) * makehuman.DECIMETRE)


def _relaxed(figure: Figure) -> Float64:
    """Return the base mesh (n, 3) with smoothed corners of the mouth and a round border of the lower lip.

    Shape targets bunch vertices there.
    """
    at, lips = figure.at.copy(), Lips(figure)
    rings = np.array(lips.rings)
    share = smooth(np.abs(lips.u[rings]), *ENDS) * ~lips.is_upper[rings]
    for step in TAUBIN * ROUNDED:
        line = at[rings]
        beside = (np.roll(line, 1, axis=1) + np.roll(line, -1, axis=1)) / 2
        at[rings] += step * share[..., None] * (beside - line)
    near = np.maximum(*(figure.ellipsoid(figure.point(name), CORNER) for name in ("2.4", "2.5")))[:, None]
    for _ in range(RELAXED):
        at = at + near * (figure.smoothed(at) - at)
    return at


def _joint(mesh: makehuman.BaseMesh, at: Float64, name: str) -> Float64:
    return np.asarray(at[np.unique(mesh.quads[name])].mean(axis=0))


def _landmarks(mesh: makehuman.BaseMesh, at: Float64) -> dict[str, int]:
    """Return feature point -> base vertex, from a table and, for the tongue, from its shape."""
    table = csv_rows("hm08_landmarks.csv", _Landmark, __package__)
    points = {row.feature_point: row.vertex for row in table}
    vertices = np.unique(mesh.quads["helper-tongue"])
    tongue = at[vertices]
    top = vertices[tongue[:, 1] > np.median(tongue[:, 1])]
    points["6.1"] = int(vertices[np.argmax(tongue[:, 2] - np.abs(tongue[:, 0]))])
    back, front = tongue[:, 2].min(), tongue[:, 2].max()
    middle = np.array([0, tongue[:, 1].max(), back + 0.60 * (front - back)])
    points["6.2"] = int(top[np.argmin(np.linalg.norm((at[top] - middle) * [3, 0.3, 1], axis=1))])
    band = np.abs(tongue[:, 2] - (back + 0.72 * (front - back))) < 0.09 * (front - back)
    points["6.3"] = int(vertices[band][np.argmax(tongue[band, 0])])
    points["6.4"] = int(vertices[band][np.argmin(tongue[band, 0])])
    return points


@dataclass(frozen=True, slots=True)
class _Landmark:
    feature_point: str
    vertex: int


Ball = tuple[Float64, float]  # centre (3,) and radius, metres
INSET = 0.00015  # m by which the ball is smaller than the ball that fits the socket
RISE = 0.085  # height of pupils above the middle of the opening, relative to the opening's height
CLEAR = 0.00030, 0.00065, 0.0008, 0.0008, 0.0008, 0.0008  # m from the ball to the rings of the lid, outwards
AROUND = 0.0008, 0.0002  # m from the ball to other skin; depth in the ball up to which skin is moved


def balls(figure: Figure) -> tuple[Ball, Ball]:
    """Return the left and the right eyeball, which fit the sockets and the height of the lids."""
    eyeballs = []
    for side, upper, lower in (("l", "3.1", "3.3"), ("r", "3.2", "3.4")):
        centre, radius = fit_ball(figure.at[np.unique(figure.mesh.quads[f"helper-{side}-eye"])])
        high, low = figure.point(upper)[1], figure.point(lower)[1]
        centre[1] = (high + low) / 2 + RISE * (high - low)
        eyeballs.append((centre, radius - INSET))
    return eyeballs[0], eyeballs[1]


def cleared(figure: Figure, eyes: tuple[Ball, Ball]) -> Float64:
    """Return the base mesh (n, 3) with lids and nearby skin moved out of the eyeballs and corneas."""
    at = figure.at.copy()
    for side, (centre, radius) in zip((1, -1), eyes, strict=True):
        before, _ = cornea(radius)
        lid = Lid(figure, side)
        rings = [*lid.rings, [vertex for vertex, _, _ in lid.followers(figure)[1]]]
        out = figure.body & (np.linalg.norm(at - centre, axis=1) > radius - AROUND[1])
        remaining = np.setdiff1d(np.flatnonzero(out), np.concatenate(rings)).tolist()
        for ring, room in zip((*lid.rings, remaining), (*CLEAR, AROUND[0]), strict=True):
            for middle, size in ((centre, radius), (centre + np.array([0, 0, before]), CORNEA)):
                offset = at[ring] - middle
                depth_squared = (size + room) ** 2 - offset[:, 0] ** 2 - offset[:, 1] ** 2
                push = np.sqrt(np.maximum(depth_squared, 0)) - offset[:, 2]
                at[ring, 2] += np.where((depth_squared > 0) & (offset[:, 2] > 0), np.maximum(push, 0), 0)
    return at
