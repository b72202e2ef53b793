"""Tests of FAPs whose points follow one another."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import realizer
from realizer.animation.lips.visemes import lip_shapes, mouth_faps, shape_table
from realizer.face.basis import LIMITS
from realizer.face.coupling import (
    CONTOURS,
    FAR,
    NEIGHBOURS,
    Contours,
    contours_of,
    couple_lips,
    join_neighbours,
)
from realizer.face.load import load_face
from realizer.tables import au_to_fap, faps
from tests.shipped import FACES


@pytest.fixture(params=FACES)
def kept(request: pytest.FixtureRequest) -> Contours:
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


def test_couple_lips_leaves_small_differences(kept: Contours) -> None:
    asked = rows({4: 60, 51: -30, 12: 40})
    assert couple_lips(kept, asked) is asked


def test_couple_lips_drags_the_other_contour(kept: Contours) -> None:
    for inner, outer in CONTOURS.items():
        for one, other in ((inner, outer), (outer, inner)):
            for value in (1000.0, -1000.0):
                got = couple_lips(kept, rows({one: value}))[0]
                assert got[one - 1] == value
                assert 0 < got[other - 1] / value < 1


def test_couple_lips_keeps_equal_requests(kept: Contours) -> None:
    asked = rows({4: 900, 51: 900, 6: -500, 53: -500})
    assert np.array_equal(couple_lips(kept, asked), asked)


def test_couple_lips_meets_opposite_requests_half_way(kept: Contours) -> None:
    got = couple_lips(kept, rows({5: 800, 52: -800}))[0]
    assert got[4] == pytest.approx(-got[51])
    assert got[4] - got[51] == pytest.approx(kept.max_difference[1], rel=1e-4)


def test_join_neighbours_leaves_what_action_units_and_visemes_ask_for() -> None:
    units = {row.au for row in au_to_fap()}
    asked = np.zeros((len(units), 68), np.float32)
    for row, unit in zip(asked, sorted(units), strict=True):
        for one in au_to_fap():
            if one.au == unit and abs(one.fap_to) > abs(row[one.fap - 1]):
                row[one.fap - 1] = one.fap_to
    assert join_neighbours(asked) is asked
    visemes = np.zeros((len(lip_shapes()), 68), np.float32)
    for number, values in mouth_faps(shape_table()[0]).items():
        visemes[:, number - 1] = values
    assert join_neighbours(visemes) is visemes


def test_join_neighbours_takes_neighbours_along_with_a_point_that_goes_far() -> None:
    got = join_neighbours(rows({33: 512}))[0]
    assert got[[30, 32, 34]].tolist() == [512 - 180, 512, 512 - 100]
    assert got[31] == 512 - 180 - 250
    assert join_neighbours(rows({37: 512}))[0][37] == 260 - 512
    assert join_neighbours(rows({33: -512}))[0][30] == 250 - 512
    for fap in range(3, 69):
        assert join_neighbours(rows({fap: -512}))[0, fap - 1] == -512


def test_join_neighbours_takes_a_corner_along_with_half_a_lip() -> None:
    got = join_neighbours(rows({8: 512}))[0]
    assert got[[3, 7, 11]].tolist() == [512 - 200, 512, 400 - 512]
    assert not join_neighbours(rows({8: -512}))[0, 11]


def test_join_neighbours_lets_opposite_brows_meet_half_way() -> None:
    got = join_neighbours(rows({37: 300, 38: 300}))[0]
    assert got[[36, 37]].tolist() == [130, 130]


def test_join_neighbours_treats_both_sides_alike() -> None:
    for fap in (31, 33, 35, 37, 8, 10, 55, 57):
        here, there = (join_neighbours(rows({n: 512}))[0] for n in (fap, faps()[fap - 1].mirror))
        assert all(here[row.fap - 1] == there[row.mirror - 1] for row in faps())


def test_neighbours_and_limits_are_those_of_the_page() -> None:
    text = (Path(realizer.__file__).parent / "server/web/src/face/deform.js").read_text("utf-8")
    found = re.search(r"NEIGHBOURS = (\[.*?\]);", text, re.DOTALL)
    limits = re.search(r"LIMITS = {(.*?)}", text)
    assert found
    assert limits
    pairs = json.loads(found[1].replace("Infinity", str(FAR)).replace(",\n]", "]"))
    assert {tuple(pair) for pair in pairs} == set(NEIGHBOURS)
    assert {int(key): int(most) for key, most in re.findall(r"(\d+): (\d+)", limits[1])} == LIMITS
