"""Tests of `realizer_studio.study.drawing`."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from realizer.animation.axis import au, fap
from realizer_studio.study.drawing import (
    LARGEST,
    MAX_DIFFERENCE,
    PAPER,
    Drawer,
    Variant,
    difference,
    differs,
    faint,
    flatten,
    opaque,
    ramp,
    row,
    webp,
)


def plain(value: int = 90) -> np.ndarray:  # type: ignore[type-arg]
    return np.full((60, 50, 4), value, np.uint8)


def test_row_holds_action_units_of_a_side_and_faps() -> None:
    values = row({(12, "LEFT"): 0.5}, {3: 100.0})
    (column,) = [target.column for target in au(12, "LEFT")]
    assert (values[column], values[fap(3).column]) == (0.5, 100.0)
    assert np.count_nonzero(values) == 2


def test_variants_have_names_that_differ() -> None:
    assert Variant("ada").name == "ada"
    assert Variant("faces/ada", "au", Path("x/mine.csv")).name == "ada au mine.csv"


def test_differs_needs_some_area_and_some_strength() -> None:
    other = plain()
    other[..., 3] = 255
    same = other.copy()
    same[:2, :2, 0] += 100
    assert not differs(other, same)
    same[:20, :20, 0] += 15
    assert not differs(other, same)
    same[:20, :20, 0] += 15
    assert differs(other, same)


def test_webp_is_small_and_without_metadata() -> None:
    large = np.zeros((900, 600, 4), np.uint8)
    content = webp(large)
    image = Image.open(io.BytesIO(content))
    assert (image.format, image.height, image.mode) == ("WEBP", LARGEST, "RGB")
    assert not image.info.get("exif")
    assert b"EXIF" not in content
    # What is transparent has the plain colour of the light.
    assert np.abs(np.asarray(image)[5, 5] - opaque(large)[0, 0].astype(int)).max() <= 3


@pytest.mark.gl
@pytest.mark.slow
def test_drawer_draws_variants_differently() -> None:
    steps: list[int] = []
    with Drawer(steps.append) as draw:
        smile = row({(12, "BOTH"): 1.0})
        rest, one = draw(Variant("ada"), [row(), smile])
        (other,) = draw(Variant("ada", "au"), [smile])
    assert rest.shape == (300, 240, 4)
    assert differs(rest, one)
    assert differs(one, other)
    assert steps == [1, 1, 1]


@pytest.fixture
def neutral():
    """A bright square without a background."""
    pixels = np.zeros((240, 240, 4), np.uint8)
    pixels[80:160, 80:160] = (200, 160, 140, 255)
    return pixels


def test_difference_of_equal_pictures_is_the_faint_neutral(neutral):
    flat = flatten(neutral, (90, 90, 90))
    out = difference(flat, flat, faint(neutral))
    assert out[120, 120] == pytest.approx(PAPER * 0.75 + np.array([200, 160, 140]) * 0.25, abs=2)
    assert out[2, 2] == pytest.approx(PAPER, abs=1)


def test_faint_blurs_the_neutral_without_background(neutral):
    below = faint(neutral)
    steps = np.abs(np.diff(below[120, :, 0]))
    assert steps.max() < 0.5 * (below[120, 120, 0] - below[120, 2, 0])
    assert below[5, 5] == pytest.approx(PAPER, abs=1)


def test_difference_is_lighter_where_it_is_larger(neutral):
    flat = flatten(neutral, (90, 90, 90))
    brightness = []
    for apart in (0.05, 0.12, 0.2, MAX_DIFFERENCE, 2 * MAX_DIFFERENCE):
        other = flat.copy()
        other[100:110, 100:110] = flat[100:110, 100:110] - np.uint8(np.ceil(255 * apart))
        out = difference(other, flat, faint(neutral))
        brightness.append(float(out[105, 105].mean()))
        assert np.array_equal(out[112:], difference(flat, flat, faint(neutral))[112:])
    assert brightness[:4] == sorted(brightness[:4])
    assert brightness[3] == brightness[4]


def test_difference_counts_darker_as_brighter(neutral):
    flat = np.full((8, 8, 3), 128, np.uint8)
    below = np.zeros((8, 8, 3), np.float32)
    assert np.array_equal(
        difference(flat + np.uint8(40), flat, below), difference(flat - np.uint8(40), flat, below)
    )


def test_ramp_rises_in_brightness():
    light = ramp(np.linspace(0, 1, 50, dtype=np.float32)) @ [0.30, 0.59, 0.11]
    assert (np.diff(light) > 0).all()


def test_flatten_fills_the_background(neutral):
    neutral[120, 120, 3] = 128
    flat = flatten(neutral, (0, 100, 0))
    assert flat[2, 2].tolist() == [0, 100, 0]
    assert flat[100, 100].tolist() == [200, 160, 140]
    assert flat[120, 120] == pytest.approx([100, 130, 70], abs=1)
