"""Tests of the zones of the MPEG-4 deformer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer_studio.faces.mpeg4.zones import (
    FALLOFFS,
    Setup,
    Zone,
    mirror_mask,
    mirrorable,
    smooth_curve,
    synchronised,
)


@pytest.mark.parametrize("falloff", FALLOFFS)
def test_zone_influence_is_1_in_the_middle_and_0_at_the_edge(falloff: str) -> None:
    zone = Zone(31, falloff, 0.01)  # type: ignore[arg-type]
    found = zone.influence(np.linspace(0, 1, 9))
    assert found[[0, -1]] == pytest.approx([1, 0], abs=1e-9)
    assert (np.diff(found) <= 1e-12).all()
    assert not zone.influence(np.array([1.5])).any()


@pytest.mark.parametrize(("amount", "power"), [(0, 1), (-50, 0.5), (-80, 0.2), (20, 2), (50, 3.5), (80, 5)])
def test_zone_with_ease_is_one_less_the_distance_to_a_power(amount: float, power: float) -> None:
    distance = np.linspace(0, 1, 101)
    assert np.allclose(Zone(31, "ease", 0.01, ease=amount).influence(distance), 1 - distance**power)


def test_smooth_curve_without_smoothing_is_a_straight_line() -> None:
    distance = np.linspace(0, 1, 101)
    assert np.allclose(smooth_curve(distance, 0, 0), 1 - distance, atol=1e-6)


def test_smooth_curve_levels_the_middle_and_widens_the_edge() -> None:
    level = smooth_curve(np.array([0, 0.01]), 0.5, 0)
    assert 1 - level[1] < 0.001
    past = smooth_curve(np.array([1.0, 1.49, 1.51]), 0, 0.5)
    assert past[0] > 0.05
    assert 0 < past[1] < 0.001
    assert past[2] == 0


def test_zone_radii_are_size_times_scale() -> None:
    assert Zone(31, "linear", 0.02, (1, 0.5, 2)).radii == pytest.approx([0.02, 0.01, 0.04])


def test_zone_mirrored_has_its_pivot_on_the_other_side() -> None:
    zone = Zone(31, "ease", 0.02, ease=30, radial=1, pivot=(0.01, 0.02, 0.03))
    assert zone.mirrored(32) == replace(zone, fap=32, pivot=(-0.01, 0.02, 0.03))


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"fap": 2}, "zone of FAP 2: wanted a FAP from 3 to 68"),
        ({"falloff": "cubic"}, "falloff: wanted one of ease, smooth, cosine, linear, got 'cubic'"),
        ({"scale": (1, 0, 1)}, "wanted a size and scales above 0"),
        ({"radial": 1.5}, r"radial: wanted 0\.\.1, got 1\.5"),
        ({"pivot": (0, float("inf"), 0)}, "wanted finite numbers"),
    ],
)
def test_zone_refuses_values_out_of_range(wrong: dict[str, object], words: str) -> None:
    with pytest.raises(FaceError, match=words):
        replace(Zone(31, "linear", 0.01), **wrong)


def test_synchronised_copies_the_left_side() -> None:
    left, right = Zone(31, "linear", 0.01), Zone(32, "cosine", 0.03)
    setup = Setup({}, {31: left, 32: right})
    assert synchronised(setup).zones[32] == right
    assert synchronised(replace(setup, synced=frozenset({31, 32}))).zones[32] == left.mirrored(32)


def test_mirror_mask_needs_a_twin_of_each_vertex() -> None:
    at = np.array([[1, 0, 0], [-1, 0, 0], [2, 5, 0.0]])
    assert mirror_mask(np.array([0], np.int32), at, 31).tolist() == [1]
    with pytest.raises(FaceError, match="has no twin"):
        mirror_mask(np.array([2], np.int32), at, 31)


def test_mirrorable_lets_go_of_both_sides_of_a_mask_without_twins() -> None:
    at = np.array([[1, 0, 0], [-1, 0, 0], [2, 5, 0.0]])
    masks = {31: np.array([0], np.int32), 33: np.array([2], np.int32)}
    setup = Setup({}, {}, masks, frozenset({31, 32, 33, 34}))
    assert mirrorable(setup, at).synced == {31, 32}
