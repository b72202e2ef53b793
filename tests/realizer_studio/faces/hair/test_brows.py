"""Tests of brows."""

import numpy as np
import pytest

from realizer_studio.faces.hair.brows import Brow, brow, project_to_front, tint_of
from realizer_studio.faces.person.recipe import appearance_of

Skin = tuple[np.ndarray, np.ndarray]


def brow_places(skin: Skin, points: dict[str, np.ndarray], side: int = 1, **look: float) -> np.ndarray:
    rng = np.random.default_rng(3)
    return brow(skin, skin, points, side, [60, 40, 30], appearance_of(look), rng).positions


def test_brow_lies_on_the_skin_above_the_eye(skin: Skin, points: dict[str, np.ndarray]) -> None:
    from scipy.spatial import cKDTree

    at = brow_places(skin, points)
    assert np.max(cKDTree(skin[0]).query(at)[0]) < 0.008
    assert at[:, 1].min() > points["3.1"][1]
    assert (at[:, 0] > 0).all()
    assert np.ptp(at[:, 0]) > 2 * np.ptp(at[:, 1])


@pytest.mark.parametrize(
    ("look", "axis", "sign"),
    [({"brow_low": 0.003}, 1, -1), ({"brow_arch": 0.003}, 1, 1), ({"brow_gap": 0.004}, 0, 1)],
)
def test_brow_has_the_shape_of_the_look(
    skin: Skin, points: dict[str, np.ndarray], look: dict[str, float], axis: int, sign: int
) -> None:
    plain, other = (
        brow_places(skin, points)[:, axis].mean(),
        brow_places(skin, points, 1, **look)[:, axis].mean(),
    )
    assert sign * (other - plain) > 0.0008


def test_brow_thins_with_its_cover(skin: Skin, points: dict[str, np.ndarray]) -> None:
    assert len(brow_places(skin, points, brow_cover=0.5)) < 0.6 * len(brow_places(skin, points))


AT = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1.0]]) * 0.01
TRIANGLES = np.array([[0, 1, 2], [3, 4, 5]])


def test_project_to_front_takes_the_foremost_triangle() -> None:
    corners, shares = project_to_front(AT, TRIANGLES, np.array([[0.0025, 0.005]]))
    assert corners.tolist() == [[3, 4, 5]]
    assert shares == pytest.approx(np.array([[0.25, 0.25, 0.5]]))


def test_project_to_front_continues_a_triangle_beyond_its_sides() -> None:
    place = np.array([[-0.001, 0.002]])
    corners, shares = project_to_front(AT, TRIANGLES, place)
    assert (AT[corners] * shares[..., None]).sum(axis=1)[:, :2] == pytest.approx(place)


def test_brow_goes_with_the_skin_that_each_piece_lies_on(skin: Skin, points: dict[str, np.ndarray]) -> None:
    patch = brow(skin, skin, points, 1, [60, 40, 30], appearance_of({}), np.random.default_rng(3))
    below = (skin[0][patch.skin] * patch.shares[..., None]).sum(axis=1)
    assert below[:, :2] == pytest.approx(patch.positions[:, :2], abs=1e-9)


@pytest.mark.parametrize("side", [1, -1])
def test_brow_shades_the_skin_along_its_line(side: int, points: dict[str, np.ndarray]) -> None:
    line = Brow(points, side, appearance_of({}))
    across = np.linspace(*line.ends, 60)[6:40]
    on, above = (np.stack([across, line.middle(across) + up], 1) for up in (0.001, 0.012))
    assert line.shade(on, 7).mean() > 0.5
    assert line.shade(above, 7).max() < 0.01
    bald = Brow(points, side, appearance_of({"brow_cover": 0.5}))
    assert bald.shade(on, 7) == pytest.approx(0.5 * line.shade(on, 7))


def test_tint_of_brows_is_grey_where_they_are() -> None:
    assert tint_of([60, 40, 30], appearance_of({})) == pytest.approx([60, 40, 30])
    assert tint_of([60, 40, 30], appearance_of({"brow_grey": 1.0})).min() > 160
