"""Tests of the shirt."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.facebuild.parts import Part
from realizer.facebuild.person.clothing import decimate_hidden, shirt, under_collar
from realizer.facebuild.submesh import Submesh

CHIN = np.array([0, -0.11, 0.0])
lengths = st.floats(-0.2, 0.2)
Sheet = tuple[Submesh, np.ndarray]


@pytest.fixture
def sheet() -> Sheet:
    """A sheet of 11 x 11 vertices, 20 cm wide, in the plane of the chin."""
    x, y = np.meshgrid(np.linspace(-0.1, 0.1, 11), np.linspace(-0.3, -0.1, 11))
    base = np.stack([x.ravel(), y.ravel(), np.zeros(121)], 1)
    k = np.arange(121).reshape(11, 11)
    quads = np.stack([k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]], -1).reshape(-1, 4)
    return Submesh.of_quads(quads.astype(np.int32), 121), base


@given(lengths, lengths, lengths, st.floats(0.01, 0.1))
def test_under_collar_counts_metres_downwards(x: float, y: float, z: float, down: float) -> None:
    high, low = (under_collar(np.array([[x, at, z]]), CHIN, 0.17)[0] for at in (y, y - down))
    assert low - high == pytest.approx(down)


@given(lengths, lengths, st.floats(0, 0.05))
def test_under_collar_ends_lower_by_low(x: float, y: float, low: float) -> None:
    place = np.array([[x, y, 0.0]])
    assert under_collar(place, CHIN, 0.17, low) == pytest.approx(under_collar(place, CHIN, 0.17) - low)


def test_under_collar_is_pointed_in_the_middle_of_the_front_alone() -> None:
    places = np.array([[0, -0.2, 0], [0.05, -0.2, 0], [0, -0.2, -0.12]])
    change = under_collar(places, CHIN, 0.17) - under_collar(places, CHIN, 0.17, point=0.03)
    assert change == pytest.approx([0.03, 0, 0])


def test_shirt_lies_off_the_body_below_the_neckline(sheet: Sheet) -> None:
    skin, base = sheet
    low = -0.2 - skin.positions(base)[:, 1]
    part = shirt(skin, base, low, [10, 20, 30])
    assert part.name == "shirt"
    assert (np.abs(part.vertices[:, 2]) > 0.002).all()
    assert part.vertices[:, 1].max() == pytest.approx(-0.2, abs=1e-6)
    assert (part.colours <= [10, 20, 30]).all()


def test_decimate_hidden_keeps_chosen_and_lit_vertices(sheet: Sheet) -> None:
    skin, base = sheet
    at = skin.positions(base)
    dark = np.where(at[:, 1] < -0.2, 0.1, 1.0)
    part = Part("skin", skin, at, skin.triangles, np.zeros((121, 3)), np.zeros(121), dark)
    keep = np.zeros(121, bool)
    keep[24] = True
    fewer = decimate_hidden(part, keep, np.zeros(121, bool), chin=-1.0, floor=-0.3)
    left = {tuple(place) for place in fewer.vertices.tolist()}
    assert len(left) < 121
    assert tuple(at[24]) in left
    assert all(tuple(place) in left for place in at[dark == 1].tolist())


def test_decimate_hidden_leaves_the_creases_of_a_shirt_above_its_lower_end(sheet: Sheet) -> None:
    skin, base = sheet
    at = skin.positions(base)
    at[::2, 2] += 0.002
    part = Part("shirt", skin, at, skin.triangles, np.zeros((121, 3)), np.zeros(121), np.ones(121))

    def left(floor: float) -> int:
        nothing = np.zeros(121, bool)
        return len(decimate_hidden(part, nothing, nothing, chin=0.0, floor=floor).vertices)

    assert left(floor=at[:, 1].min() - 0.1) == 121
    assert left(floor=at[:, 1].max()) < 80
