"""Tests of the networks that find faces."""

from __future__ import annotations

import math
import sys

import numpy as np
import pytest
from PIL import Image

from realizer.core.errors import RealizerError
from realizer_studio.tracking.network import Network, Region
from tests.portraits import LITERT


@LITERT
def test_network_takes_a_square_picture() -> None:
    model = Network("face_landmark")
    outputs = model(Image.new("RGB", (model.size, model.size)))
    assert sorted(value.size for value in outputs.values()) == [1, 1404]


def test_network_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ai_edge_litert", None)
    with pytest.raises(RealizerError, match=r"pip install 'bml-realizer\[track\]'"):
        Network("face_landmark")


def spot(x: int, y: int) -> Image.Image:
    pixels = np.zeros((200, 300, 3), np.uint8)
    pixels[y - 3 : y + 4, x - 3 : x + 4] = 255
    return Image.fromarray(pixels)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize(("side", "angle"), [(80.0, 0.0), (80.0, 0.6), (150.0, -1.0), (500.0, 0.3)])
def test_region_places_what_it_cuts(side: float, angle: float, mirrored: bool) -> None:
    region = Region(140, 90, side, angle, mirrored)
    seen = np.asarray(region.cut(spot(150, 80), 64)).sum(axis=2)
    y, x = (np.mgrid[:64, :64] * seen).sum(axis=(1, 2)) / seen.sum()
    (place,) = region.to_picture([[(x + 0.5) / 64, (y + 0.5) / 64]])
    assert place == pytest.approx((150.5, 80.5), abs=side / 64)


def test_region_around_points_is_parallel_to_their_line() -> None:
    turn = np.array([[math.cos(0.5), -math.sin(0.5)], [math.sin(0.5), math.cos(0.5)]])
    points = np.array([[-20, -10], [20, -10], [20, 10], [-20, 10]]) @ turn.T + (100, 60)
    region = Region.around(points, points[0], points[1], 1.5)
    assert (region.x, region.y, region.side, region.angle) == pytest.approx((100, 60, 60, 0.5))
