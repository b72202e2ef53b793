"""Tests of the colours of gaps."""

import numpy as np
import pytest

from realizer.charts.diverging_scale import colour_of, on

STRETCHES = [0.0, 0.2, 1 / 3, 0.5, 0.8, 1.0, 1.25, 2.0, 3.0, 7.0, float("inf")]
# Linear RGB as seen without one kind of cone (Vienot, Brettel & Mollon 1999).
SIGHT = {
    "all cones": np.eye(3),
    "no long": np.array([[0.11238, 0.88762, 0], [0.11238, 0.88762, 0], [0.00401, -0.00401, 1]]),
    "no middle": np.array([[0.29275, 0.70725, 0], [0.29275, 0.70725, 0], [-0.02234, 0.02234, 1]]),
}


def linear(colour: str) -> np.ndarray:
    part = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    return np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)


def luminance(colour: str) -> float:
    return float(linear(colour) @ [0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize("sight", SIGHT.values(), ids=SIGHT)
@pytest.mark.parametrize("stretch", [1.5, 2.0, 3.0])
def test_colour_of_is_distinct_for_every_colour_vision(sight, stretch: float) -> None:
    longer, shorter, neither = (
        np.clip(sight @ linear(colour_of(s)), 0, 1) ** (1 / 2.2) for s in (stretch, 1 / stretch, 1.0)
    )
    assert np.linalg.norm(longer - shorter) > 0.25
    assert np.linalg.norm(longer - neither) > 0.1
    assert np.linalg.norm(shorter - neither) > 0.1


def test_colour_of_darkens_away_from_the_preferred_length() -> None:
    for side in (STRETCHES[5:], STRETCHES[5::-1]):
        lights = [luminance(colour_of(s)) for s in side]
        assert lights == sorted(lights, reverse=True)


def test_colour_of_is_constant_beyond_three_times() -> None:
    assert colour_of(3.0) == colour_of(50.0) == colour_of(float("inf"))
    assert colour_of(1 / 3) == colour_of(0.01) == colour_of(0.0)


@pytest.mark.parametrize("stretch", STRETCHES)
def test_on_gives_readable_ink(stretch: float) -> None:
    colour = colour_of(stretch)
    dark, light = sorted((luminance(colour), luminance(on(colour))))
    assert (light + 0.05) / (dark + 0.05) >= 4.5
