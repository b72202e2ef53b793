"""Tests of the picture of an eye."""

import numpy as np
import pytest

from realizer.core.array_types import UInt8
from realizer_studio.faces.person.recipe import Recipe
from realizer_studio.faces.skin.eye_picture import eye_picture

pytestmark = pytest.mark.xdist_group("mask")
SIZE = 64


@pytest.fixture(scope="module")
def looks(recipe: Recipe) -> tuple[UInt8, UInt8]:
    return eye_picture(SIZE, recipe.colours, 3)


def test_eye_picture_has_a_dark_pupil_an_iris_and_a_white(looks: tuple[UInt8, UInt8], recipe: Recipe) -> None:
    albedo = looks[0].astype(float)
    middle = SIZE // 2
    assert albedo[middle - 3 : middle + 3, middle - 3 : middle + 3] == pytest.approx(
        np.broadcast_to(recipe.colours["pupil"], (6, 6, 3)), abs=2
    )
    iris = albedo[middle - 2 : middle + 2, middle + 9].mean(axis=0)
    assert iris == pytest.approx(recipe.colours["iris_middle"], abs=40)
    white = albedo[middle - 2 : middle + 2, middle + 18].mean(axis=0)
    assert white == pytest.approx(np.array(recipe.colours["white"]) * 0.79, abs=30)
    assert white.min() > iris.max()


def test_eye_picture_is_redder_at_the_nose_than_at_the_temple(looks: tuple[UInt8, UInt8]) -> None:
    red = looks[0][..., 0].astype(float) - looks[0][..., 2]
    rows = slice(SIZE // 2 - 8, SIZE // 2 + 8)
    assert red[rows, :3].mean() > red[rows, -3:].mean() > red[rows, SIZE // 2 + 17].mean()


def test_eye_picture_is_deepest_behind_the_middle_of_the_cornea(looks: tuple[UInt8, UInt8]) -> None:
    near = looks[1][SIZE // 2, :, 2]
    assert near.argmin() in (SIZE // 2 - 1, SIZE // 2)
    assert (near[: SIZE // 4 - 1] == 255).all()
    assert near.min() < 90


def test_eye_picture_is_another_with_another_seed(looks: tuple[UInt8, UInt8], recipe: Recipe) -> None:
    again, other = (eye_picture(SIZE, recipe.colours, seed)[0] for seed in (3, 4))
    assert (again == looks[0]).all()
    assert (other != looks[0]).any()
