"""Tests of the assembly of a bust."""

from __future__ import annotations

import numpy as np
import pytest

from realizer_studio.faces.parts import Part
from realizer_studio.faces.person.bust import ORDER
from realizer_studio.faces.person.makehuman import Figure

pytestmark = pytest.mark.xdist_group("mask")


def test_assemble_makes_every_part_in_order(parts: list[Part]) -> None:
    names = [part.name for part in parts]
    assert list(dict.fromkeys(names)) == [name for name in ORDER if name != "glasses"]
    assert names == sorted(names, key=ORDER.index)


def test_assemble_gives_each_vertex_finite_values_in_range(parts: list[Part]) -> None:
    for part in parts:
        n = len(part.vertices)
        assert part.occlusion is not None
        assert len(part.colours) == len(part.gloss) == len(part.occlusion) == n
        assert set(np.unique(part.triangles)) == set(range(n)), part.name
        assert np.isfinite(part.vertices).all()
        for values, most in ((part.colours, 255), (part.gloss, 1), (part.occlusion, 1)):
            assert np.min(values) >= 0
            assert np.max(values) <= most


def test_assemble_cuts_the_skin_under_the_shirt(parts: list[Part]) -> None:
    lowest = {part.name: part.vertices[:, 1].min() for part in parts}
    assert lowest["shirt"] < lowest["skin"]


def test_assemble_keeps_the_feature_points_on_the_skin(figure: Figure, parts: list[Part]) -> None:
    skin = parts[0]
    for name in ("2.1", "2.2", "2.3", "8.3", "3.1", "4.3", "9.3"):
        off = np.linalg.norm(skin.vertices - figure.point(name), axis=1)
        assert off.min() < 1e-9, name


def test_assemble_puts_teeth_behind_the_lips(figure: Figure, parts: list[Part]) -> None:
    for part in parts:
        if part.name.endswith("teeth"):
            assert part.vertices[:, 2].max() < figure.point("2.2")[2]


def test_assemble_puts_the_lower_teeth_inside_the_upper_ones(parts: list[Part]) -> None:
    upper, lower = (next(p.vertices for p in parts if p.name == f"{row}_teeth") for row in ("upper", "lower"))
    assert np.ptp(lower[:, 0]) < np.ptp(upper[:, 0])
    assert lower[:, 2].max() < upper[:, 2].max()
    assert lower[:, 1].min() < upper[:, 1].min()
