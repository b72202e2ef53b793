"""Tests of `realizer_studio.cli.marker_options`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
import pytest
from PIL import Image

from realizer_studio.cli.marker_options import Numbers, follow, marker_settings
from tests.painted import acted, plain, truth

NONE = {"markers": None, "marker_colour": (), "marker_at": (), "layout": None, "region": None}


def test_numbers_are_pixels_with_commas() -> None:
    assert Numbers("X,Y").convert("12, 7", None, None) == (12, 7)
    for text in ("1", "1,2,3", "a,b", "-1,2", ""):
        with pytest.raises(click.BadParameter, match=r"wanted X,Y in pixels"):
            Numbers("X,Y").convert(text, None, None)


@pytest.mark.parametrize(
    ("chosen", "names"),
    [
        ({}, None),
        ({"markers": "green, blue"}, ["green", "blue"]),
        ({"marker_colour": ("120,50,50",)}, ["120,50,50"]),
        ({"markers": "red", "marker_at": ((5, 5),)}, ["red", "hue 239"]),
    ],
)
def test_look_of_has_the_colours(tmp_path: Path, chosen: dict[str, Any], names: list[str] | None) -> None:
    Image.new("RGB", (10, 10), (20, 20, 200)).save(tmp_path / "blue.png")
    look = marker_settings(tmp_path / "blue.png", NONE | chosen, None)
    assert (None if look is None else [colour.name for colour in look.colours]) == names


def test_follow_reads_the_film(tmp_path: Path) -> None:
    for k, picture in enumerate(plain(truth("ada", acted(3)))):
        picture.image.save(tmp_path / f"{k}.png")
    look = marker_settings(tmp_path, NONE | {"markers": "green,blue"}, 0)
    assert look is not None
    with click.Context(click.Command("track")):
        assert follow(tmp_path, look, 10).pixels.shape == (3, 31, 2)
