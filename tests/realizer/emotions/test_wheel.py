"""Tests of `realizer.emotions.wheel`."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.emotions.archetypes import archetypes
from realizer.emotions.profile import Profile
from realizer.emotions.wheel import Anchor, affect, between, blend_weights, wheel
from realizer.tables.emotions import ring as places
from realizer.tables.emotions import whissell_words

FEAR, SAD = archetypes("raw")["fear"][8], archetypes("raw")["sadness"][0]

# Raouzaiou et al. 2002, tables 7 and 8; the printed F19..F22 of guilty run backwards and are ordered here.
TERRIFIED = """F3 [520, 730], F5 [-310, -210], F19 [-820, -740], F20 [-820, -740], F21 [-820, -740],
    F22 [-820, -740], F31 [340, 440], F32 [340, 440], F33 [210, 310], F34 [210, 310], F35 [80, 180],
    F36 [80, 180]"""
WORRIED = """F3 [320, 450], F5 [-190, -130], F19 [-500, -450], F20 [-500, -450], F21 [-500, -450],
    F22 [-500, -450], F31 [210, 270], F32 [210, 270], F33 [130, 190], F34 [130, 190], F35 [50, 110],
    F36 [50, 110]"""
GUILTY = """F3 [160, 230], F5 [-100, -65], F19 [-310, -110], F20 [-315, -120], F21 [-310, -110],
    F22 [-315, -120], F31 [61, 167], F32 [57, 160], F33 [65, 100], F34 [65, 100],
    F35 [25, 60], F36 [25, 60]"""


def agree(got: Profile, printed: str, within: float) -> None:
    wanted = Profile.parse(" ".join(printed.split())).ranges
    assert got.ranges.keys() == wanted.keys()
    for fap, ends in wanted.items():
        assert got.ranges[fap] == pytest.approx(ends, abs=within + 1e-9), fap


@pytest.mark.parametrize(("activation", "within"), [(1.3 * 4.9, 5), (6.3, 10)])
def test_scaled_fear_is_terrified_of_table_7(activation: float, within: float) -> None:
    # The print has used the ratio rounded to 1.3.
    agree(FEAR.scaled(activation / 4.9), TERRIFIED, within)


def test_scaled_fear_is_worried_of_table_7() -> None:
    words = whissell_words()
    agree(FEAR.scaled(words["worried"].activation / words["afraid"].activation), WORRIED, 5)


def test_scaled_surprise_is_the_smaller_one_of_paul() -> None:
    surprise = archetypes("raw")["surprise"][0]
    assert surprise.scaled(4.0 / 6.5).ranges[3] == pytest.approx((350, 739), abs=0.5)  # eq. 6.1


def test_between_gives_guilty_of_table_8() -> None:
    words = whissell_words()
    afraid, sad, guilty = (words[word] for word in ("afraid", "sad", "guilty"))
    made = between(
        Anchor(FEAR, afraid.activation, afraid.angle),
        Anchor(SAD, sad.activation, sad.angle),
        guilty.angle,
        guilty.activation,
    )
    agree(made, GUILTY, 5)
    low, high = made.ranges[19]
    assert (low + high) / 2 == pytest.approx(-209, abs=3)  # eq. 13, worked with rounded numbers
    assert high - low == pytest.approx(199, abs=3)


def test_between_gives_the_example_of_paul() -> None:
    # Paul 2010, 6.2, with the slips of his arithmetic put right (anger 4.2, both ends translated).
    anger = Profile.parse("F20 [-335, -205]")
    joy = Profile.parse("F3 [195, 205], F20 [-426, -302]")
    assert archetypes("raw")["anger"][1].ranges[20] == anger.ranges[20]
    assert archetypes("raw")["joy"][3].ranges[20] == joy.ranges[20]
    made = between(Anchor(anger, 4.2, 225), Anchor(joy, 5.4, 315), 261, 3.8)
    assert made.ranges[3] == pytest.approx((68.6, 72.1), abs=0.05)
    assert made.ranges[20] == pytest.approx((-301.8, -196.3), abs=0.1)


def test_between_intersects_contradicting_ranges() -> None:
    one = Profile.parse("F4 [-100, 20], F31 [10, 50]")
    two = Profile.parse("F4 [-10, 100], F31 [-50, -10]")
    made = between(Anchor(one, 4, 0), Anchor(two, 4, 90), 30, 4)
    assert dict(made.ranges) == {4: (-10, 20)}


def test_between_crosses_angle_0() -> None:
    one, two = Profile.parse("F31 [90, 110]"), Profile.parse("F31 [190, 210]")
    made = between(Anchor(one, 4, 315), Anchor(two, 4, 45), 0, 4)
    assert made.ranges[31] == (140, 160)


@pytest.mark.parametrize("angle", [200, 60, float("nan")])
def test_between_refuses_an_angle_outside(angle: float) -> None:
    with pytest.raises(ValueError, match=r"wanted one from 70\.3 to 108\.5 degrees"):
        between(Anchor(FEAR, 4.9, 70.3), Anchor(SAD, 3.9, 108.5), angle, 4)


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
