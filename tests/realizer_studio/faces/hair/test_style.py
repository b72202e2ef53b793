"""Tests of styles."""

from dataclasses import fields, replace

import pytest

from realizer.core.errors import FaceError
from realizer.tables import read_toml, text_of
from realizer_studio.faces.hair.style import Style, colour_of, style_of


def test_style_of_changes_single_figures() -> None:
    style = style_of({"style": "short", "grey": 0.9, "sides": 0.2})
    assert (style.grey, style.sides) == (0.9, 0.2)
    plain = style_of({"style": "short"})
    assert replace(style, grey=plain.grey, sides=plain.sides) == plain


@pytest.mark.parametrize(
    ("table", "says"), [({"style": "mohican"}, "wanted one of buzz"), ({"styl": "bun"}, "got 'styl'")]
)
def test_style_of_refuses_unknown_styles_and_figures(table: dict[str, str], says: str) -> None:
    with pytest.raises(FaceError, match=says):
        style_of(table)


def test_style_has_every_figure_of_the_table() -> None:
    table = read_toml(text_of("hair.toml"), "hair.toml")
    assert {field.name for field in fields(Style)} == set(table["plain"])


def test_colour_of_lies_between_that_of_hair_and_white() -> None:
    dark, mixed, white = (
        colour_of(style_of({"style": "bob", "grey": grey}), [70, 50, 40]) for grey in (0.0, 0.5, 1.0)
    )
    assert dark.tolist() == [70, 50, 40]
    assert white.min() > 180
    assert mixed == pytest.approx((dark + white) / 2)
