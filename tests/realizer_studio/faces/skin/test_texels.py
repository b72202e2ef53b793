"""Tests of the texels of a map that lie on a surface."""

from __future__ import annotations

import numpy as np
import pytest

from realizer_studio.faces.skin.texels import PAD, Texels

AT = np.array([[0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0.0]])
QUAD = np.array([[0, 1, 2], [0, 2, 3]], np.int32)


@pytest.fixture(scope="module")
def texels() -> Texels:
    """A square of 10 cm that fills the middle 40 x 40 texels of 64 x 64."""
    return Texels(AT, QUAD, (AT * 6.25 + 0.1875)[QUAD][..., :2], 64)


def test_texels_know_where_they_are(texels: Texels) -> None:
    assert len(texels.at) == 40 * 40
    assert texels.at[0] == pytest.approx([0.00125, 0.00125, 0], abs=1e-6)
    assert texels.width == pytest.approx(0.0025)
    assert texels.spread(AT[:, 0]) == pytest.approx(texels.at[:, 0])


def test_picture_repeats_the_edge_around_an_island(texels: Texels) -> None:
    picture = texels.picture(texels.at[:, 0], -1)
    assert picture[32, 12 - PAD] == pytest.approx(texels.at[:, 0].min())
    assert picture[32, 12 - PAD - 2] == -1


def test_broad_gives_about_the_field_itself(texels: Texels) -> None:
    assert texels.broad(lambda at: at[:, 0]) == pytest.approx(texels.at[:, 0], abs=0.008)


def test_blurred_keeps_what_is_even(texels: Texels) -> None:
    assert texels.blurred(np.full(1600, 3, np.float32), 4) == pytest.approx(3)


def test_stamp_marks_a_disc(texels: Texels) -> None:
    marks = texels.stamp(np.array([820]), np.float32([0.01]), lambda away: 1 - away)
    away = np.linalg.norm(texels.at - texels.at[820], axis=1)
    assert marks[820] == 1
    assert (marks[away > 0.0101] == 0).all()
    assert (marks[away < 0.0099] > 0).all()


def test_scatter_keeps_places_apart_and_their_number(texels: Texels) -> None:
    found = texels.scatter(np.full(1600, 10_000, np.float32), 0.004, np.random.default_rng(1))
    off = np.linalg.norm(texels.at[found][:, None] - texels.at[found], axis=2)
    assert off[off > 0].min() >= 0.004
    assert 30 < len(found) <= 120
