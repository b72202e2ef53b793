"""Tests of the removal of triangle flips."""

from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.mesh_geometry import grid
from realizer_studio.faces.fix_flipped import JAW, _groups, flipped_triangles, soften_flips

SIDE = 15
X, Y = np.meshgrid(np.linspace(-7, 7, SIDE), np.linspace(-7, 7, SIDE))
AT = np.stack([X.ravel(), Y.ravel(), np.zeros(SIDE * SIDE)], 1)
TRIANGLES = grid(SIDE, SIDE)
MIDDLE = SIDE * SIDE // 2


def bump(width: float) -> Float64:
    size = np.clip(1 - np.hypot(*AT[:, :2].T) / width, 0, 1)
    return np.asarray(size[:, None] * [1.0, 0, 0])


def mended(fields: list[Float64], plays: list[tuple[Float64, Any, float]], fixed: list[int]) -> Float64:
    return soften_flips(np.stack(fields), AT, TRIANGLES, plays, fixed)


def test_soften_flips_widens_a_bump_pushed_through_its_sides() -> None:
    field = bump(1.6)
    assert flipped_triangles(AT, AT + 2.5 * field, TRIANGLES).any()
    (wide,) = mended([field], [(np.array([2.5]), 0.0, 0.0)], [MIDDLE])
    assert not flipped_triangles(AT, AT + 2.5 * wide, TRIANGLES).any()
    assert np.array_equal(wide[MIDDLE], field[MIDDLE])


def test_soften_flips_leaves_a_field_that_flips_nothing() -> None:
    field = bump(6)
    plays = [(np.array([way]), 0.0, 0.0) for way in (2.0, -2.0)]
    assert np.array_equal(mended([field], plays, [])[0], field)


def test_soften_flips_counts_accompanying_movement() -> None:
    field = bump(1.6)
    together = [(np.array([2.5]), 2.5 * (bump(7) - field), 0.0)]
    assert np.array_equal(mended([field], together, [MIDDLE])[0], field)


def test_soften_flips_keeps_sums_of_fields() -> None:
    field = bump(1.6)
    rest = [1.0, 0, 0] - field
    one, other = mended([field, rest], [(np.array([2.5, 0.0]), 0.0, 0.0)], [MIDDLE])
    assert not np.array_equal(one, field)
    assert np.allclose(one + other, [1.0, 0, 0])


def test_soften_flips_leaves_fields_that_stand_in_the_way_of_one_another() -> None:
    field = bump(1.6)
    needs_it = [(np.array([10.0]), 10 * (bump(11) - field), 0.0)]
    wants_less = [(np.array([2.5]), 0.0, 0.0)]
    assert not np.array_equal(mended([field], wants_less, [MIDDLE])[0], field)
    assert np.array_equal(mended([field], wants_less + needs_it, [MIDDLE])[0], field)


def test_without_flips_mends_twins_all_lips_and_the_jaw_together() -> None:
    rows = {number: np.zeros((1, 3)) for number in (*JAW, 4, 8, 19, 20, 31, 48)}
    assert _groups(rows) == [
        ([3], [69, 70, 73]),
        ([19, 20], [19, 20]),
        ([31, 32], [31, 32]),
        ([48], [48]),
        ([4, 8], [4, 8]),
    ]
