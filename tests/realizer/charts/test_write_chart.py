"""Tests of writing charts to files."""

import io
from pathlib import Path

import numpy as np
import pytest

from realizer.charts.shapes import Box, Picture, Text
from realizer.charts.shapes import Path as Line
from realizer.charts.write_chart import png, write_timeline, writer_for
from realizer.core.errors import RealizerError


def pixels(*shapes) -> np.ndarray:
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(png(Picture(60, 30, shapes=list(shapes))))))


def test_png_has_twice_the_picture_s_size_and_its_paper() -> None:
    drawn = pixels()
    assert drawn.shape == (60, 120, 3)
    assert (drawn == 255).all()


def test_png_fills_a_box_and_nothing_else() -> None:
    drawn = pixels(Box(10, 5, 20, 10, "#205080"))
    inside = drawn[10:30, 20:60]
    assert (inside == (0x20, 0x50, 0x80)).all()
    assert (drawn != 255).any(axis=2).sum() == inside.shape[0] * inside.shape[1]


def test_png_draws_lines_and_text_in_their_colour() -> None:
    drawn = pixels(Line(((5, 20), (50, 20)), "#ff0000", 2), Text(5, 12, "start", 10, "#0000ff"))
    assert (drawn[40, 20:90] == (255, 0, 0)).all()
    assert (drawn[:26, :, 0] < 128).any()


def test_png_puts_text_at_its_anchor() -> None:
    columns = {}
    for anchor in ("start", "middle", "end"):
        drawn = pixels(Text(30, 20, "mm", 10, "#000000", anchor))
        columns[anchor] = np.flatnonzero((drawn < 128).any(axis=(0, 2)))
    assert columns["start"].min() >= 58
    assert columns["end"].max() <= 62
    assert columns["middle"].mean() == pytest.approx(60, abs=3)


def test_png_draws_text_above_shapes() -> None:
    drawn = pixels(Text(5, 20, "mm", 12, "#ffffff"), Box(0, 0, 60, 30, "#000000"))
    assert (drawn > 200).any()


def test_png_refuses_too_large_pictures_and_suggests_svg() -> None:
    with pytest.raises(RealizerError, match=r"wanted a picture of at most .* draw it as \.svg"):
        png(Picture(4000, 100_000))


@pytest.mark.parametrize(("name", "begins"), [("x.svg", b"<svg"), ("x.PNG", b"\x89PNG")])
def test_write_timeline_selects_the_format_by_suffix(lines, tmp_path: Path, name: str, begins: bytes) -> None:
    write_timeline(lines('<bml id="b"><wait id="w" duration="1"/></bml>'), tmp_path / name)
    assert (tmp_path / name).read_bytes().startswith(begins)


@pytest.mark.parametrize("name", ["x.gif", "svg", "x"])
def test_writer_for_lists_the_known_suffixes(name: str) -> None:
    with pytest.raises(ValueError, match=r"wanted a suffix of \.svg \.png"):
        writer_for(name)
