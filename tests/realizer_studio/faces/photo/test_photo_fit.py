"""Tests of the fit of sliders and poses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageDraw

from realizer.core.errors import FaceError
from realizer_studio.faces.eyeball import LIMBUS
from realizer_studio.faces.photo.photo_fit import IRIS, VISIBLE_IRIS, fit_person, outline
from realizer_studio.faces.photo.shape import DISTANCE, LandmarkAnchors, Pose, Sliders
from realizer_studio.faces.photo.views import View
from realizer_studio.tracking.network import Region

SCALE = 3000.0  # pixels a metre


def view(points: np.ndarray | None, turn: float, image: Image.Image | None = None) -> View:
    iris = VISIBLE_IRIS * 2 * LIMBUS * SCALE * DISTANCE / (DISTANCE - IRIS)
    shown = image or Image.new("RGB", (1000, 1000))
    return View(shown, points, Region(500, 500, 600), turn, np.zeros((2, 2)), iris)


def person(data: Path) -> tuple[dict[str, float], np.ndarray]:
    """Return sliders of somebody, and the mesh."""
    places = LandmarkAnchors.of("front"), LandmarkAnchors.of("side")
    sliders = Sliders(data, {}, np.concatenate([part.corners for part in places]))
    told = sliders.person(np.zeros(len(sliders.names))) | {"nose_width": 0.4, "jaw": -0.3}
    return told, sliders.mesh(told)


def seen(at: np.ndarray, view: str, pose: Pose) -> np.ndarray:
    """Return the pixels (468, 2) of the landmarks; those that the view does not have are far off."""
    places = LandmarkAnchors.of(view)
    points = np.full((468, 2), 1e4)
    points[places.numbers] = pose(places.positions(at))[0]
    return points


@pytest.mark.slow
def test_fit_finds_poses_and_places_again(data: Path) -> None:
    _, at = person(data)
    poses = [
        Pose(np.array([0.0, 0.02, 0]), SCALE, np.array([500.0, 450])),
        Pose(np.array([0, 0.7, 0]), SCALE, np.array([600.0, 450])),
    ]
    front, side = (
        view(seen(at, name, pose), 40 * k)
        for k, (name, pose) in enumerate(zip(("front", "side"), poses, strict=True))
    )
    fit = fit_person(front, side, data, {"age": 42})
    assert fit.person["age"] == 42
    for found, true in zip(fit.poses, poses, strict=True):
        assert np.degrees(found.turn - true.turn) == pytest.approx(np.zeros(3), abs=4)
        assert found.size == pytest.approx(true.size, rel=0.02)


def drawn(at: np.ndarray) -> Image.Image:
    """Return a picture of a head in profile: what lies behind the middle line of its face."""
    places = LandmarkAnchors.of("front")
    flat, _ = Pose(np.array([0, np.pi / 2, 0]), SCALE, np.array([600.0, 450.0]))(places.positions(at))
    line = flat[np.abs(places.positions(at)[:, 0]) < 0.0015]
    line = line[np.argsort(line[:, 1])]
    image = Image.new("RGB", (1000, 1000), (90, 100, 110))
    corners = [(300, 0), (line[0, 0], 0), *map(tuple, line), (line[-1, 0] - 60, 1000), (300, 1000)]
    ImageDraw.Draw(image).polygon([(float(x), float(y)) for x, y in corners], fill=(210, 160, 130))
    return image


@pytest.mark.slow
@pytest.mark.long
def test_fit_follows_the_outline_of_a_profile_to_either_side(data: Path) -> None:
    _, at = person(data)
    pose = Pose(np.zeros(3), SCALE, np.array([500.0, 450.0]))
    front, image = view(seen(at, "front", pose), 0), drawn(at)
    for shown in (image, image.transpose(Image.Transpose.FLIP_LEFT_RIGHT)):
        fit = fit_person(front, view(None, 90, shown), data, {})
        turn = fit.poses[1].rotation
        assert turn[0, 2] > 0.95  # forward is to the right of the picture
        assert fit.poses[1].size == pytest.approx(SCALE, rel=0.1)


@pytest.mark.long
@pytest.mark.slow
def test_fit_says_that_there_is_no_outline(data: Path) -> None:
    _, at = person(data)
    front = view(seen(at, "front", Pose(np.zeros(3), SCALE, np.array([500.0, 450.0]))), 0)
    noise = np.random.default_rng(1).integers(0, 255, (1000, 1000, 3)).astype(np.uint8)
    for image in (
        Image.new("RGB", (1000, 1000), "grey"),
        Image.fromarray(np.kron(noise[:50, :50], np.ones((20, 20, 1), np.uint8))),
    ):
        with pytest.raises(FaceError, match="wanted a face in profile before a plain background"):
            fit_person(front, view(None, 90, image), data, {})


def test_outline_is_where_a_background_ends_that_changes_slowly() -> None:
    ramp = np.linspace(60, 140, 400)[None, :, None] + np.linspace(0, 20, 300)[:, None, None]
    image = Image.fromarray(np.repeat(ramp, 3, axis=2).astype(np.uint8))
    ImageDraw.Draw(image).ellipse((50, 50, 250, 250), fill=(220, 170, 150))
    line = outline(image, Region(150, 150, 160))
    wanted = 150 + np.sqrt(np.maximum(100**2 - (line[:, 1] - 150.5) ** 2, 0))
    assert len(line) > 150
    assert np.abs(line[:, 0] - wanted).max() < 6
    assert np.median(np.abs(line[:, 0] - wanted)) < 2


def test_outline_of_an_empty_wall_is_empty() -> None:
    assert outline(Image.new("RGB", (200, 200), "grey"), Region(100, 100, 100)).shape == (0, 2)
