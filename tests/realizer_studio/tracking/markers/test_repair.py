"""Tests of `realizer_studio.tracking.markers.repair`."""

from __future__ import annotations

import numpy as np
import pytest

from realizer_studio.tracking.markers.layout import numbered, wojdel
from realizer_studio.tracking.markers.repair import filled, normalised, repaired
from tests.painted import acted, layout_in_pixels, truth


def test_repaired_interpolates_missing_points() -> None:
    way = np.linspace(0, 9, 10)[:, None, None] * [1.0, 2.0] + np.array([[[0.0, 0], [50, 0], [0, 50]]])
    holes = way.copy()
    holes[3:5, 0] = holes[0, 1] = np.nan
    assert repaired(holes)[1:] == pytest.approx(way[1:])
    assert repaired(holes)[0, 1] == pytest.approx(way[1, 1])  # the nearest known place


def test_repaired_gives_a_blob_back_that_a_neighbour_took() -> None:
    way = np.repeat(np.array([[[0.0, 0], [10, 0], [60, 0]]]), 7, axis=0)
    wrong = way.copy()
    wrong[3, 0] = np.nan  # point 2 is hidden, and its number went to point 1
    wrong[3, 1] = way[3, 0] + (0.5, 0)
    found = repaired(wrong)
    assert found[3, 0] == pytest.approx([0.5, 0])
    assert found[3, 1] == pytest.approx([10, 0])


def test_filled_leaves_a_point_that_is_never_seen() -> None:
    way = np.zeros((4, 2, 2))
    way[:, 1] = np.nan
    assert np.isnan(filled(way)[:, 1]).all()


def test_normalised_takes_place_size_and_roll_of_the_head_out() -> None:
    rest = layout_in_pixels("ada")
    way = truth("ada", acted(12)) * (1, -1)
    straight = normalised(rest, way)
    at = {name: k for k, name in enumerate(rest.names)}
    assert np.abs(straight[:, at["2"], 0] - straight[:, at["3"], 0]).mean() == pytest.approx(1, abs=1e-6)
    assert straight[:, [at["14"], at["15"]], 1].mean(axis=1) == pytest.approx(np.zeros(12), abs=1e-9)
    assert straight[:, at["1"], 0] == pytest.approx(straight[:, at["31"], 0])
    turns = np.radians(np.linspace(-15, 15, 12))
    turned = (way @ np.array([1, 1j])) * np.exp(1j * turns)[:, None] * 0.8
    moved = np.stack([turned.real, turned.imag], axis=-1) + np.arange(12)[:, None, None] * 3.0
    assert normalised(rest, moved) == pytest.approx(straight, abs=0.03)


def test_normalised_turns_other_layouts_as_at_rest() -> None:
    rest = numbered(np.column_stack([wojdel().positions[:9] * (1, -1), np.zeros(9)]))
    way = np.stack([rest.positions * 5 + k for k in range(3)])
    assert normalised(rest, way) == pytest.approx(
        np.repeat(normalised(rest, rest.positions[None]), 3, axis=0), abs=1e-9
    )
