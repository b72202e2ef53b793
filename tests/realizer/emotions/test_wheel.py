"""Tests of `realizer.emotions.wheel`."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.emotions.archetypes import archetypes
from realizer.emotions.wheel import affect, blend_weights, wheel
from realizer.tables.wheel_words import ring as places

SETS = st.sampled_from(["own", "published", "raw"])
RINGS = st.sampled_from(["paul", "plutchik", "affect"])


@pytest.mark.parametrize("profiles", ["own", "published", "raw"])
@pytest.mark.parametrize("ring", ["paul", "plutchik"])
def test_wheel_has_each_archetype_at_its_place(profiles: str, ring: str) -> None:
    known = archetypes(profiles)
    for place in places(ring).values():
        if place.name not in known:
            continue
        own = 7.0 if profiles == "own" else place.activation
        for made in (wheel(place.angle, None, profiles, ring), wheel(place.angle, own, profiles, ring)):
            assert made.name.rpartition(" ")[0] == place.name
            number = int(made.name.rpartition(" ")[2])
            for fap, ends in known[place.name][number].ranges.items():
                assert made.ranges[fap] == pytest.approx(ends)


@given(st.floats(-720, 720), st.floats(0, 7), SETS, RINGS)
def test_wheel_is_continuous(angle: float, activation: float, profiles: str, ring: str) -> None:
    here = wheel(angle, activation, profiles, ring).frame()
    for there in (
        wheel(angle + 1e-4, activation, profiles, ring),
        wheel(angle, max(activation - 1e-5, 0), profiles, ring),
    ):
        assert np.abs(there.frame() - here).max() < 0.05


@given(st.floats(-1, 1), st.floats(-1, 1), SETS)
def test_affect_is_continuous(valence: float, arousal: float, profiles: str) -> None:
    here = affect(valence, arousal, profiles).frame()
    nearby = [max(min(valence + step, 1), -1) for step in (1e-5, -1e-5)]
    for there in nearby:
        assert np.abs(affect(there, arousal, profiles).frame() - here).max() < 0.5


@pytest.mark.slow
def test_wheel_is_continuous_in_the_width_of_ranges() -> None:
    widths = [wheel(angle, 5, "published").ranges.get(3, (0.0, 0.0)) for angle in np.arange(0, 360, 0.01)]
    assert np.abs(np.diff(np.array(widths), axis=0)).max() < 1


def test_wheel_is_neutral_in_the_middle_and_strongest_at_the_rim() -> None:
    for place in places("paul").values():
        assert not wheel(place.angle, 0).frame().any()
        low, high = wheel(place.angle, 3).frame(), wheel(place.angle, 7).frame()
        assert np.allclose(low * 7 / 3, high, rtol=1e-4, atol=1e-3)
        assert high.any()


def test_wheel_takes_angles_modulo_360() -> None:
    assert np.allclose(wheel(-700, 5).frame(), wheel(20, 5).frame())


def test_wheel_between_two_archetypes_shows_half_of_each() -> None:
    assert blend_weights(67.5) == {"fear": 0.5, "surprise": 0.5}
    assert blend_weights(270) == {"anticipation": 1}
    assert blend_weights(270, "published") == {
        "anger": 0.5,
        "joy": 0.5,
    }  # nobody published a face of anticipation
    awe, fear, surprise = wheel(67.5, 7), archetypes("own")["fear"][0], archetypes("own")["surprise"][0]
    assert np.allclose(awe.frame(), (fear.frame() + surprise.frame()) / 2, atol=1e-3)


def test_affect_finds_the_words_rated_by_whissell() -> None:
    assert affect(0.7, 0.467).name.startswith("joy 0")
    joy = archetypes("own")["joy"][0]
    assert affect(0.9, 0.6).ranges[12] == pytest.approx(joy.ranges[12], rel=0.02)
    assert not affect(0, 0).frame().any()
    assert not affect(0, -1).frame().any()
    assert affect(-0.9, -0.1).midpoint()[12] < -50  # corners of the lips go down
    assert affect(0.5, 0.9).midpoint()[31] > 100  # brows go up


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((45, 40), "activation: wanted 0..7, got 40"),
        ((45, -1), "activation: wanted 0..7, got -1"),
        ((45, float("nan")), "activation: wanted 0..7, got nan"),
        ((float("nan"), 4), "angle: wanted a number of degrees, got nan"),
        ((float("inf"), 4), "angle: wanted a number of degrees, got inf"),
        ((45, 4, "ekman"), "wanted own, published, raw or a file FILE.txt, got 'ekman'"),
        ((45, 4, "own", "geneva"), "ring: wanted paul, plutchik or affect, got 'geneva'"),
    ],
)
def test_wheel_refuses_places_outside(arguments: tuple[float, ...], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        wheel(*arguments)


@pytest.mark.parametrize(("valence", "arousal"), [(1.1, 0), (0, -2), (float("nan"), 0)])
def test_affect_refuses_places_outside(valence: float, arousal: float) -> None:
    with pytest.raises(ValueError, match=r"(valence|arousal): wanted -1\.\.1"):
        affect(valence, arousal)


def test_wheel_takes_a_huge_angle() -> None:
    assert wheel(1e308).ranges == wheel(1e308 % 360).ranges
    assert sum(blend_weights(-1e300).values()) == pytest.approx(1)
