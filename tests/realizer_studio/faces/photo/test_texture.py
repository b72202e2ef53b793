"""Tests of the projection of photographs onto a skin."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from realizer.core.colours import linear, srgb
from realizer_studio.faces.photo.photo_fit import Fit, Observation
from realizer_studio.faces.photo.shape import LandmarkAnchors, Pose
from realizer_studio.faces.photo.texture import Painter, Projected, projected, unlit
from realizer_studio.faces.skin.skin import Skin
from tests.realizer_studio.faces.photo.test_photo_fit import view

pytestmark = pytest.mark.xdist_group("mask")
SCALE = 2000.0
AHEAD = Pose(np.zeros(3), SCALE, np.array([250.0, 200.0]))


def sight(image: Image.Image) -> Observation:
    return Observation(view(np.zeros((468, 2)), 0, image), LandmarkAnchors.of("front"), np.zeros((468, 2)))


def picture(spot: tuple[float, float], skin: tuple[int, int, int] = (190, 140, 110)) -> Image.Image:
    """Return a picture of plain skin with a dark spot."""
    pixels = np.tile(np.array(skin, np.uint8), (500, 500, 1))
    x, y = map(round, spot)
    pixels[y - 6 : y + 7, x - 6 : x + 7] = np.array(skin) * 0.8
    return Image.fromarray(pixels)


def near(skin: Skin, place: np.ndarray, reach: float) -> np.ndarray:
    return np.linalg.norm(skin.at - place, axis=1) < reach


def test_unlit_takes_the_light_out_and_leaves_spots() -> None:
    random = np.random.default_rng(1)
    normals = random.normal((0, 0, 2), 1, (5000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    base = np.full((5000, 3), 0.4, np.float32)
    own = base.copy()
    own[:50] *= 0.7
    light = 0.5 + 0.3 * normals[:, :1] + 0.2 * normals[:, 2:] ** 2
    seen = Projected((own * light).astype(np.float32), np.ones(5000, np.float32), normals)
    colours, odd = unlit(seen, base, random)
    assert colours[50:] == pytest.approx(own[50:], abs=0.02)
    assert colours[:50] == pytest.approx(own[:50], abs=0.03)
    assert odd[:50].min() > 0.25 > odd[50:].max()


def test_projected_counts_what_faces_the_camera_and_lies_inside(skin: Skin) -> None:
    seen = projected(skin, sight(picture((250, 250))), AHEAD, both=True)
    cheek = near(skin, skin.person.figure.point("5.3"), 0.01)
    assert seen.weight[cheek].mean() > 0.6
    aside = Pose(np.array([0, np.pi, 0]), SCALE, np.array([250.0, 200.0]))
    assert projected(skin, sight(picture((250, 250))), aside, both=True).weight[cheek].mean() < 0.1
    away = Pose(np.zeros(3), SCALE, np.array([-900.0, 200.0]))
    assert projected(skin, sight(picture((250, 250))), away, both=True).weight.max() == 0


def test_painter_paints_a_spot_where_both_pictures_show_it(skin: Skin) -> None:
    place = skin.person.figure.point("9.3")  # the tip of the nose
    shown = sight(picture(tuple(AHEAD([place])[0][0])))
    fit = Fit({}, (shown, shown), (AHEAD, AHEAD))
    albedo = np.tile(np.float32([200, 160, 130]), (len(skin.at), 1))
    painted = Painter(fit)(skin, albedo)
    plain = near(skin, place + np.array([0, 0.02, 0]), 0.006)
    spot = near(skin, place, 0.002)
    assert painted[plain].mean(axis=0) == pytest.approx([200, 160, 130], abs=12)
    ratio = linear(painted[spot]).mean() / linear(painted[plain]).mean()
    assert ratio == pytest.approx(float(linear(np.float32(0.8 * 190)) / linear(np.float32(190))), abs=0.15)
    wet = ~skin.dry
    assert painted[wet] == pytest.approx(255 * srgb(linear(albedo[wet])), abs=1)
