"""Tests of places on the skin."""

import numpy as np
import pytest

from realizer.facebuild.hair.skin_places import seen_from_front

AT = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [0, 1, 1.0]]) * 0.01
TRIANGLES = np.array([[0, 1, 2], [3, 4, 5]])


def test_seen_from_front_takes_the_foremost_triangle() -> None:
    corners, shares = seen_from_front(AT, TRIANGLES, np.array([[0.0025, 0.005]]))
    assert corners.tolist() == [[3, 4, 5]]
    assert shares == pytest.approx(np.array([[0.25, 0.25, 0.5]]))


def test_seen_from_front_continues_a_triangle_beyond_its_sides() -> None:
    place = np.array([[-0.001, 0.002]])
    corners, shares = seen_from_front(AT, TRIANGLES, place)
    assert (AT[corners] * shares[..., None]).sum(axis=1)[:, :2] == pytest.approx(place)
