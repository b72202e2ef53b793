"""Tests of `realizer.emotions.intermediate`."""

from __future__ import annotations

import pytest

from realizer.emotions.archetypes import archetypes
from realizer.emotions.intermediate import Anchor, between
from realizer.emotions.profile import Profile
from realizer.tables.wheel_words import whissell_words

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
