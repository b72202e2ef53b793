"""The sliders of a recipe, and the poses of the cameras, that two photographs show: least squares."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.core.errors import FaceError
from realizer_studio.faces.eyeball import LIMBUS
from realizer_studio.faces.photo.shape import DISTANCE, Places, Pose, Sliders
from realizer_studio.faces.photo.views import View
from realizer_studio.tracking.region import Region

if TYPE_CHECKING:
    from PIL.Image import Image

ERROR = 0.006  # m, standard deviation of a landmark
# Standard deviation of a head's pitch and roll beside the camera, and of a profile's turn.
TILT = np.radians(4)
RULER = 0.001  # standard deviation of the size that irises tell: those of all people are about as large
HUBER = 2.0  # standard deviations; what is further off counts less
ROUNDS, STEP = 14, 0.05  # of Gauss and Newton; differences in standard deviations, radians and shares
IRIS = 0.012  # m that irises lie before the middle of the eyes
SEEN = 0.989  # of their diameter, as the network sees it in pictures of our six faces (0.973 to 1.008)
CENTRE = 0.0015  # m; landmarks of the middle line are not further from it
SCALES, ROLLS = np.linspace(0.55, 1.5, 39), np.radians(np.arange(-16, 17, 4))  # of a profile
LOST = 0.004  # m; an outline further off, at the median, is not that of the face


@dataclass(frozen=True, eq=False)
class Sight:
    """What a photograph says of places on the mesh."""

    view: View  # the photograph, mirrored so that its pose is right
    places: Places  # what is seen in it
    points: Float64  # (k, 2) pixels of the places; or an outline (n, 2), on which they lie somewhere

    def off(self, pose: Pose, at: Float64) -> tuple[Float64, Float64]:
        """Return how wrong a mesh (n, 3) and a pose are: directions (k, j, 2), metres along them (k, j)."""
        seen, _ = pose(self.places.on(at))
        if self.view.points is not None:
            return np.tile(np.eye(2), (len(seen), 1, 1)), (self.points - seen) / pose.size
        from scipy.spatial import cKDTree

        near = np.clip(cKDTree(self.points).query(seen)[1], 2, len(self.points) - 3)
        along = self.points[near + 2] - self.points[near - 2]
        across = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
        away = ((self.points[near] - seen) * across).sum(axis=1) / pose.size
        return across[:, None], away[:, None]


@dataclass(frozen=True, eq=False)
class Fit:
    """A person as two photographs show them."""

    person: dict[str, Any]  # the table [person] of the recipe
    sights: tuple[Sight, Sight]  # what is seen in the pictures, and `poses`: of the cameras; the front first
    poses: tuple[Pose, Pose]


def fit_person(front: View, side: View, data: Path, told: Mapping[str, Any]) -> Fit:
    """Return the sliders and poses that fit the landmarks of two photographs.

    Args:
        data: the folder of shape targets.
        told: sliders that are known, such as {"age": 40}.

    Raises:
        FaceError: the outline of a face in profile is not found.
    """
    places = Places.of("front"), Places.of("side")
    sliders = Sliders(data, told, np.concatenate([part.corners for part in places]))
    at = sliders.mesh(sliders.person(np.zeros(len(sliders.names))))
    assert front.points is not None
    first = Sight(front, places[0], front.points[places[0].numbers])
    ruled = replace(
        _start(first, at, 0.0), size=front.iris / (SEEN * 2 * LIMBUS) * (DISTANCE - IRIS) / DISTANCE
    )
    values, poses = _solved(sliders, [first], [ruled])
    if side.points is not None:
        second = Sight(side, places[1], side.points[places[1].numbers])
        start = _start(second, sliders.mesh(sliders.person(values)), np.radians(side.turn))
    else:
        second, start = _profile(side, places[0], sliders.mesh(sliders.person(values)))
    values, poses = _solved(sliders, [first, second], [ruled, start], values)
    person = sliders.person(values)
    if side.points is None:
        away = float(np.median(np.abs(second.off(poses[1], sliders.mesh(person))[1])))
        if away > LOST:
            raise FaceError(_unknown(away))
    return Fit(person, (first, second), (poses[0], poses[1]))


def _unknown(away: float) -> str:
    return (
        "the picture from the side: wanted a face in profile before a plain background, or one turned by "
        f"30 to 60 degrees; found an outline that is {1000 * away:.0f} mm off a face's"
    )


def _start(sight: Sight, at: Float64, turn: float) -> Pose:
    """Return a pose that takes places about to the landmarks, for a turn to the face's left in radians."""
    pose = Pose(np.array([0.0, turn, 0.0]), 1.0, np.zeros(2))
    seen, wanted = pose(sight.places.on(at))[0], sight.points
    size = float(np.linalg.norm(wanted - wanted.mean(axis=0)) / np.linalg.norm(seen - seen.mean(axis=0)))
    return replace(pose, size=size, middle=wanted.mean(axis=0) - size * seen.mean(axis=0))


def _profile(side: View, places: Places, at: Float64) -> tuple[Sight, Pose]:
    """Return what a profile says of the middle line, and about its pose: the best of many sizes and tilts."""
    from PIL import ImageOps

    middle = places.some(np.abs(places.on(at)[:, 0]) < CENTRE)
    mirrored = replace(
        side,
        image=ImageOps.mirror(side.image),
        region=replace(side.region, x=side.image.width - side.region.x),
    )
    best: tuple[float, Sight, Pose] | None = None
    for view in (side, mirrored):
        line = outline(view.image, view.region)
        near = line[np.abs(line[:, 1] - view.region.y) < view.region.side / 4]
        if len(near) < 20:
            continue
        sight, tip = Sight(view, middle, line), near[np.argmax(near[:, 0])]
        for scale in SCALES * view.region.side * 3:
            for roll in ROLLS:
                pose = Pose(_turned(roll), scale, np.zeros(2))
                seen, _ = pose(middle.on(at))
                pose = replace(pose, middle=tip - seen[np.argmax(seen[:, 0])])
                away = float(np.abs(sight.off(pose, at)[1]).mean())
                if best is None or away < best[0]:
                    best = away, sight, pose
    if best is None:
        raise FaceError(_unknown(float("nan")))
    return best[1:]


def _turned(roll: float) -> Float64:
    from scipy.spatial.transform import Rotation

    turns = Rotation.from_euler("z", roll) * Rotation.from_euler("y", np.pi / 2)
    return np.asarray(turns.as_rotvec())


def _solved(
    sliders: Sliders, sights: Sequence[Sight], poses: Sequence[Pose], start: Float64 | None = None
) -> tuple[Float64, list[Pose]]:
    """Return values of the sliders, and poses, that fit best (Gauss and Newton, with Huber's weights)."""
    count = len(sliders.names)
    values = np.concatenate([np.zeros(count) if start is None else start, np.zeros(6 * len(sights))])

    def posed(values: Float64) -> list[Pose]:
        rows = values[count:].reshape(-1, 6)
        return [
            Pose(pose.turn + row[:3], pose.size * np.exp(row[3]), pose.middle + pose.size * 0.1 * row[4:])
            for pose, row in zip(poses, rows, strict=True)
        ]

    def errors(values: Float64) -> Float64:
        at = sliders.mesh(sliders.person(values[:count]))
        parts = [sight.off(pose, at)[1].ravel() for sight, pose in zip(sights, posed(values), strict=True)]
        return np.concatenate(parts) / ERROR

    # What is likely beforehand.
    turn = [np.r_[1, 0 if sight.view.points is not None else 1, 1, 0, 0, 0] / TILT**2 for sight in sights]
    known = np.diag(np.r_[np.ones(count), np.concatenate(turn) + 1e-4])
    known[count + 3, count + 3] = RULER**-2
    for _ in range(ROUNDS):
        now = errors(values)
        slopes = np.stack(
            [(errors(values + step) - now) / STEP for step in STEP * np.eye(len(values))], axis=1
        )
        weights = np.minimum(1, HUBER / np.maximum(np.abs(now), 1e-9))
        left = slopes.T @ (weights[:, None] * slopes) + known
        move = np.linalg.solve(left, -slopes.T @ (weights * now) - known @ values)
        values = values + move
        values[:count] = np.clip(values[:count], sliders.low, sliders.high)
        if np.abs(move).max() < 0.01:
            break
    return values[:count], posed(values)


EDGE = 0.01  # of the width: the columns that the background is first measured in
FORGET = 0.04  # share of a column in the mean of the background, which may change slowly
APART = 26.0  # distance of colours, 0..441, from which on it is not the background
RUN = 4  # columns that differ one after the other
REACH = 0.6  # sides of the region, upwards and downwards


def outline(image: Image, region: Region) -> Float64:
    """Return the outermost points (n, 2) of a face that looks to the picture's right, from above downwards.

    Each row of the picture is followed from its right edge to where the background ends.
    """
    from scipy.ndimage import gaussian_filter, median_filter

    reach = REACH * region.side
    top, bottom = (int(np.clip(region.y + way * reach, 0, image.height - 1)) for way in (-1, 1))
    pixels = np.asarray(image, np.float32)[top : bottom + 1]
    pixels = gaussian_filter(pixels, (1, 1, 0))
    width = pixels.shape[1]
    background = pixels[:, -max(RUN, round(EDGE * width)) :].mean(axis=1)
    run, found = np.zeros(len(pixels), int), np.full(len(pixels), -1)
    for column in range(width - 1, -1, -1):
        here = pixels[:, column]
        differs = np.linalg.norm(here - background, axis=1) > APART
        run = np.where(differs, run + 1, 0)
        found = np.where((found < 0) & (run == RUN), column + RUN - 1, found)
        background += FORGET * ~differs[:, None] * (here - background)
    rows = np.flatnonzero(found >= 0)
    across = median_filter(found[rows].astype(float), 7, mode="nearest")
    return np.stack([across + 0.5, rows + top + 0.5], axis=1)
