"""Tests of the coupling of the two contours of the lips."""

import numpy as np
import pytest

from realizer.face.contours import CONTOURS, contours_of, couple_lips
from realizer.face.load import load_face
from realizer.tables import faps
from tests.shipped import FACES


@pytest.fixture(params=FACES)
def kept(request: pytest.FixtureRequest):
    face = load_face(request.param)
    return contours_of(face.points, face.fapu)


def rows(values: dict[int, float]) -> np.ndarray:
    out = np.zeros((1, 68), np.float32)
    for fap, value in values.items():
        out[0, fap - 1] = value
    return out


def test_contours_pair_inner_and_outer_lip_points() -> None:
    for inner, outer in CONTOURS.items():
        a, b = faps()[inner - 1], faps()[outer - 1]
        assert (a.unit, a.direction, a.name + "_o") == (b.unit, b.direction, b.name)


def test_couple_lips_leaves_small_differences(kept) -> None:
    asked = rows({4: 60, 51: -30, 12: 40})
    assert couple_lips(kept, asked) is asked


def test_couple_lips_drags_the_other_contour(kept) -> None:
    for inner, outer in CONTOURS.items():
        for one, other in ((inner, outer), (outer, inner)):
            for value in (1000.0, -1000.0):
                got = couple_lips(kept, rows({one: value}))[0]
                assert got[one - 1] == value
                assert 0 < got[other - 1] / value < 1


def test_couple_lips_keeps_equal_requests(kept) -> None:
    asked = rows({4: 900, 51: 900, 6: -500, 53: -500})
    assert np.array_equal(couple_lips(kept, asked), asked)


def test_couple_lips_meets_opposite_requests_half_way(kept) -> None:
    got = couple_lips(kept, rows({5: 800, 52: -800}))[0]
    assert got[4] == pytest.approx(-got[51])
    assert got[4] - got[51] == pytest.approx(kept.max_difference[1], rel=1e-4)
