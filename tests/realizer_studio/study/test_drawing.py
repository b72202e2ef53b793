"""Tests of `realizer_studio.study.drawing`."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from realizer.animation.axis import au, fap
from realizer_studio.study.drawing import LARGEST, Drawer, Variant, differs, opaque, row, webp


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
