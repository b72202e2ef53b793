"""A least-squares fit of a recipe's sliders, and of the camera poses, to two photographs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.ndimage import gaussian_filter, median_filter
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from realizer.core.array_types import Float64
from realizer.core.errors import FaceError
from realizer_studio.faces.eyeball import LIMBUS
from realizer_studio.faces.photo.shape import DISTANCE, LandmarkAnchors, Pose, Sliders
from realizer_studio.faces.photo.views import View
from realizer_studio.tracking.network import Region

if TYPE_CHECKING:
    from PIL.Image import Image

ERROR = 0.006  # m, standard deviation of a landmark
# Standard deviation of a head's pitch and roll beside the camera, and of a profile's turn.
TILT = np.radians(4)
RULER = 0.001  # standard deviation of the scale from the irises, which have one size in all people
HUBER = 2.0  # standard deviations; larger residuals have less weight
ROUNDS, STEP = 14, 0.05  # Gauss-Newton iterations; differences in standard deviations, radians, shares
IRIS = 0.012  # m from the middle of the eyes forward to the irises
VISIBLE_IRIS = (
    0.989  # of their diameter, as the network sees it in pictures of our six faces (0.973 to 1.008)
)
CENTRE = 0.0015  # m; largest distance of the middle line's landmarks from it
SCALES, ROLLS = np.linspace(0.55, 1.5, 39), np.radians(np.arange(-16, 17, 4))  # of a profile
LOST = 0.004  # m; largest median residual of an outline


@dataclass(frozen=True, eq=False)
class Observation:
    """The observation of landmarks or an outline in a photograph."""

    view: View  # the photograph, mirrored if that makes its pose match
    anchors: LandmarkAnchors  # the landmarks in it
    points: Float64  # (k, 2) pixels of the landmarks; or of an outline (n, 2) on which they lie

    def residuals(self, pose: Pose, at: Float64) -> tuple[Float64, Float64]:
        """Return the residuals of a mesh (n, 3) and a pose: directions (k, j, 2), and metres (k, j)."""
        projected, _ = pose(self.anchors.positions(at))
        if self.view.points is not None:
            return np.tile(np.eye(2), (len(projected), 1, 1)), (self.points - projected) / pose.size
        nearest = np.clip(cKDTree(self.points).query(projected)[1], 2, len(self.points) - 3)
        tangent = self.points[nearest + 2] - self.points[nearest - 2]
        normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1) / np.linalg.norm(tangent, axis=1)[:, None]
        distances = ((self.points[nearest] - projected) * normal).sum(axis=1) / pose.size
        return normal[:, None], distances[:, None]


@dataclass(frozen=True, eq=False)
class Fit:
    """The person fitted to two photographs."""

    person: dict[str, Any]  # the table [person] of the recipe
    observations: tuple[Observation, Observation]  # front, then side; `poses` likewise
    poses: tuple[Pose, Pose]


def fit_person(front: View, side: View, data: Path, fixed: Mapping[str, Any]) -> Fit:
    """Return the sliders and poses that fit the landmarks of two photographs.

    Args:
        data: the folder of shape targets.
        fixed: sliders with fixed values, such as {"age": 40}.

    Raises:
        FaceError: the outline of a face in profile is not found.
    """
    anchors = LandmarkAnchors.of("front"), LandmarkAnchors.of("side")
    sliders = Sliders(data, fixed, np.concatenate([part.corners for part in anchors]))
    at = sliders.mesh(sliders.person(np.zeros(len(sliders.names))))
    assert front.points is not None
    first = Observation(front, anchors[0], front.points[anchors[0].numbers])
    scaled = replace(
        _start(first, at, 0.0), size=front.iris / (VISIBLE_IRIS * 2 * LIMBUS) * (DISTANCE - IRIS) / DISTANCE
    )
    values, poses = _solved(sliders, [first], [scaled])
    if side.points is not None:
        second = Observation(side, anchors[1], side.points[anchors[1].numbers])
        start = _start(second, sliders.mesh(sliders.person(values)), np.radians(side.turn))
    else:
        second, start = _profile(side, anchors[0], sliders.mesh(sliders.person(values)))
    values, poses = _solved(sliders, [first, second], [scaled, start], values)
    person = sliders.person(values)
    if side.points is None:
        error = float(np.median(np.abs(second.residuals(poses[1], sliders.mesh(person))[1])))
        if error > LOST:
            raise FaceError(_no_profile(error))
    return Fit(person, (first, second), (poses[0], poses[1]))


def _no_profile(error: float) -> str:
    return (
        "the picture from the side: wanted a face in profile before a plain background, or one turned by "
        f"30 to 60 degrees; found an outline that is {1000 * error:.0f} mm off a face's"
    )


def _start(sight: Observation, at: Float64, turn: float) -> Pose:
    """Return an approximate pose for a face turned to its left by `turn` radians."""
    pose = Pose(np.array([0.0, turn, 0.0]), 1.0, np.zeros(2))
    projected, target = pose(sight.anchors.positions(at))[0], sight.points
    size = float(
        np.linalg.norm(target - target.mean(axis=0)) / np.linalg.norm(projected - projected.mean(axis=0))
    )
    return replace(pose, size=size, middle=target.mean(axis=0) - size * projected.mean(axis=0))


def _profile(side: View, anchors: LandmarkAnchors, at: Float64) -> tuple[Observation, Pose]:
    """Return the observation of the middle line in a profile, and its pose: the best of a grid of poses."""
    from PIL import ImageOps

    middle = anchors.subset(np.abs(anchors.positions(at)[:, 0]) < CENTRE)
    mirrored = replace(
        side,
        image=ImageOps.mirror(side.image),
        region=replace(side.region, x=side.image.width - side.region.x),
    )
    best: tuple[float, Observation, Pose] | None = None
    for view in (side, mirrored):
        line = outline(view.image, view.region)
        near = line[np.abs(line[:, 1] - view.region.y) < view.region.side / 4]
        if len(near) < 20:
            continue
        sight, tip = Observation(view, middle, line), near[np.argmax(near[:, 0])]
        for scale in SCALES * view.region.side * 3:
            for roll in ROLLS:
                pose = Pose(_turned(roll), scale, np.zeros(2))
                projected, _ = pose(middle.positions(at))
                pose = replace(pose, middle=tip - projected[np.argmax(projected[:, 0])])
                error = float(np.abs(sight.residuals(pose, at)[1]).mean())
                if best is None or error < best[0]:
                    best = error, sight, pose
    if best is None:
        raise FaceError(_no_profile(float("nan")))
    return best[1:]


def _turned(roll: float) -> Float64:
    turns = Rotation.from_euler("z", roll) * Rotation.from_euler("y", np.pi / 2)
    return np.asarray(turns.as_rotvec())


def _solved(
    sliders: Sliders, observations: Sequence[Observation], poses: Sequence[Pose], start: Float64 | None = None
) -> tuple[Float64, list[Pose]]:
    """Return the best-fitting values of the sliders, and poses (Gauss-Newton with Huber weights)."""
    count = len(sliders.names)
    values = np.concatenate([np.zeros(count) if start is None else start, np.zeros(6 * len(observations))])

    def posed(values: Float64) -> list[Pose]:
        rows = values[count:].reshape(-1, 6)
        return [
            Pose(pose.turn + row[:3], pose.size * np.exp(row[3]), pose.middle + pose.size * 0.1 * row[4:])
            for pose, row in zip(poses, rows, strict=True)
        ]

    def errors(values: Float64) -> Float64:
        at = sliders.mesh(sliders.person(values[:count]))
        parts = [
            observation.residuals(pose, at)[1].ravel()
            for observation, pose in zip(observations, posed(values), strict=True)
        ]
        return np.concatenate(parts) / ERROR

    # The prior: sliders near their means, heads near upright, and the scale from the irises.
    turn = [
        np.r_[1, 0 if observation.view.points is not None else 1, 1, 0, 0, 0] / TILT**2
        for observation in observations
    ]
    prior = np.diag(np.r_[np.ones(count), np.concatenate(turn) + 1e-4])
    prior[count + 3, count + 3] = RULER**-2
    for _ in range(ROUNDS):
        now = errors(values)
        slopes = np.stack(
            [(errors(values + step) - now) / STEP for step in STEP * np.eye(len(values))], axis=1
        )
        weights = np.minimum(1, HUBER / np.maximum(np.abs(now), 1e-9))
        normal_matrix = slopes.T @ (weights[:, None] * slopes) + prior
        update = np.linalg.solve(normal_matrix, -slopes.T @ (weights * now) - prior @ values)
        values = values + update
        values[:count] = np.clip(values[:count], sliders.low, sliders.high)
        if np.abs(update).max() < 0.01:
            break
    return values[:count], posed(values)


EDGE = 0.01  # of the width: the columns that give the first estimate of the background
FORGET = 0.04  # weight of a new column in the running mean of the background
APART = 26.0  # distance of colours, 0..441, beyond which a pixel is not background
RUN = 4  # successive columns of the foreground that end a row
REACH = 0.6  # sides of the region, upwards and downwards


def outline(image: Image, region: Region) -> Float64:
    """Return the outermost points (n, 2) of a face that looks to the picture's right, from above downwards.

    Each row of the picture is searched from its right edge for the end of the background.
    """
    reach = REACH * region.side
    top, bottom = (int(np.clip(region.y + sign * reach, 0, image.height - 1)) for sign in (-1, 1))
    pixels = np.asarray(image, np.float32)[top : bottom + 1]
    pixels = gaussian_filter(pixels, (1, 1, 0))
    width = pixels.shape[1]
    background = pixels[:, -max(RUN, round(EDGE * width)) :].mean(axis=1)
    run, found = np.zeros(len(pixels), int), np.full(len(pixels), -1)
    for column in range(width - 1, -1, -1):
        column_colours = pixels[:, column]
        differs = np.linalg.norm(column_colours - background, axis=1) > APART
        run = np.where(differs, run + 1, 0)
        found = np.where((found < 0) & (run == RUN), column + RUN - 1, found)
        background += FORGET * ~differs[:, None] * (column_colours - background)
    rows = np.flatnonzero(found >= 0)
    across = median_filter(found[rows].astype(float), 7, mode="nearest")
    return np.stack([across + 0.5, rows + top + 0.5], axis=1)
