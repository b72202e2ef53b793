"""Tests of the lines of the skin."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.mesh_geometry import vertex_normals
from realizer.tables import toml_table
from realizer_studio.faces.skin.lines import SIDES, engrave, groove, lines_of, regions, weights
from realizer_studio.faces.skin.skin import Skin

pytestmark = pytest.mark.xdist_group("mask")


def test_lines_of_draws_both_sides_with_their_own_irregularities(skin: Skin) -> None:
    lines = lines_of(skin)
    left, right = ([line for line in lines if line.side == side] for side in SIDES)
    assert len(left) == len(right) > 20
    assert not np.allclose(left[0].path[-1] - left[0].path[0], right[0].path[-1] - right[0].path[0])


def test_groove_is_deepest_in_the_middle_with_ridges_beside() -> None:
    deep = groove(np.array([0, 0.001, 0.0022, 0.005]), 0.001)
    assert deep[0] == pytest.approx(1, abs=0.01)
    assert deep[0] > deep[1] > 0 > deep[2]
    assert deep[3] == pytest.approx(0, abs=0.01)


def test_engrave_makes_age_a_part_of_the_folds(skin: Skin) -> None:
    rest, folds = engrave(skin, lines_of(skin))
    assert folds.min() < -0.0001
    assert folds.min() < rest.min() < 0


def test_regions_are_driven_by_drives_of_the_table(skin: Skin) -> None:
    names = regions(lines_of(skin))
    drives = toml_table("wrinkles.toml")["drives"]
    assert {name.rsplit("_", 1)[0] for name in names} <= set(drives)


def test_weights_show_a_region_at_its_lines_only(skin: Skin) -> None:
    lines = lines_of(skin)
    part = skin.part
    shown = weights(skin, lines, vertex_normals(part.vertices, part.triangles))
    frown = shown[:, regions(lines).index("frown_left")]
    assert frown.max() > 0.5
    chin = np.linalg.norm(part.vertices - skin.person.figure.point("2.1"), axis=1) < 0.03
    assert frown[chin].max() == 0
    assert shown.sum(axis=1).max() <= 1.0001
