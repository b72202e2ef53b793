"""Fields that turn triangles over are stiffened until none does; feature points keep their moves."""

import numpy as np

from realizer.face.parts import grid
from realizer.face.untangle import turned, untangled

SIDE = 15
X, Y = np.meshgrid(np.linspace(-7, 7, SIDE), np.linspace(-7, 7, SIDE))
AT = np.stack([X.ravel(), Y.ravel(), np.zeros(SIDE * SIDE)], 1)
TRIANGLES = grid(SIDE, SIDE)
MIDDLE = SIDE * SIDE // 2


def bump(width: float) -> np.ndarray:
    size = np.clip(1 - np.hypot(*AT[:, :2].T) / width, 0, 1)
    return size[:, None] * [1.0, 0, 0]


def test_a_narrow_bump_that_is_pushed_through_its_neighbours_is_widened() -> None:
    field = bump(1.6)
    assert turned(AT, AT + 2.5 * field, TRIANGLES).any()
    mended = untangled(field, AT, TRIANGLES, [(2.5, 0.0, 0.0)], [MIDDLE])
    assert not turned(AT, AT + 2.5 * mended, TRIANGLES).any()
    assert np.array_equal(mended[MIDDLE], field[MIDDLE])


def test_a_field_that_turns_nothing_over_stays_as_it_is() -> None:
    field = bump(6)
    assert np.array_equal(untangled(field, AT, TRIANGLES, [(2.0, 0.0, 0.0), (-2.0, 0.0, 0.0)], []), field)


def test_what_moves_along_counts() -> None:
    field = bump(1.6)
    together = [(2.5, 2.5 * (bump(7) - field), 0.0)]
    assert np.array_equal(untangled(field, AT, TRIANGLES, together, [MIDDLE]), field)
