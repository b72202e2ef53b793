"""Tests of colours and hair that a photograph tells."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image, ImageDraw

from realizer_studio.faces.photo.looks import recipe_of
from realizer_studio.faces.photo.views import View
from realizer_studio.tracking.region import Region
from realizer_studio.tracking.regressor import stored


def pictured(skin: str, hair: str, iris: str, long: bool = False) -> View:
    """Return a drawing of a face in plain colours."""
    points = np.asarray(stored()["head"], float)[:, :2] * (150, -150)
    points = points - points.mean(axis=0) + 250
    image = Image.new("RGB", (500, 500), (60, 64, 70))
    draw = ImageDraw.Draw(image)
    (left, top), (right, bottom) = points.min(axis=0) - 6, points.max(axis=0) + 6
    draw.ellipse((left - 20, top - 90, right + 20, bottom - 60), fill=hair)
    if long:
        draw.rectangle((left - 90, 200, right + 90, bottom), fill=hair)
    draw.rectangle((left, top, right, bottom), fill=skin)
    irises = np.array([points[[362, 263]].mean(axis=0), points[[33, 133]].mean(axis=0)])
    for x, y in irises:
        draw.ellipse((x - 9, y - 9, x + 9, y + 9), fill=iris)
    return View(image, points, Region(250, 250, 300), 0.0, irises, 18.0)


def test_recipe_has_the_colours_of_the_picture() -> None:
    fair = recipe_of(pictured("#e8c0a0", "#2a2422", "#5a7898"), {"sex": 1.0}, {}, None)
    deep = recipe_of(pictured("#7a5238", "#2a2422", "#382010"), {"sex": 1.0}, {}, None)
    assert fair["person"]["skin"] < deep["person"]["skin"]
    assert (fair["person"]["eyes"], deep["person"]["eyes"]) == ("blue", "darkbrown")
    assert fair["person"]["hair"] in ("black", "darkbrown")
    assert fair["hair"]["style"] == "short"
    assert np.mean(fair["colours"]["skin"]) > np.mean(deep["colours"]["skin"]) + 40


@pytest.mark.parametrize(
    ("hair", "long", "sex", "style"),
    [("#c0bdb8", True, 0.0, "bob"), ("#50301c", False, 0.0, "bun"), ("#e0ba9c", False, 1.0, "buzz")],
)
def test_recipe_has_the_likeliest_hair(hair: str, long: bool, sex: float, style: str) -> None:
    tables = recipe_of(pictured("#e8c0a0", hair, "#382010", long), {"sex": sex}, {}, None)
    assert tables["hair"] == {"style": style, "grey": 0.0}


def test_recipe_of_a_bald_head_has_the_hair_beside_its_temples() -> None:
    view = pictured("#e8c0a0", "#e0ba9c", "#382010")
    assert view.points is not None
    draw = ImageDraw.Draw(view.image)
    for x, y in view.points[[127, 356]]:
        draw.rectangle((x - 14, y - 60, x + 14, y + 10), fill="#6e6a68")
    tables = recipe_of(view, {"sex": 1.0}, {}, None)
    assert (tables["hair"]["style"], tables["person"]["hair"]) == ("rim", "grey")


def test_recipe_keeps_what_is_told() -> None:
    told = {"hair": "red", "eyes": "green", "age": 30}
    tables = recipe_of(pictured("#e8c0a0", "#2a2422", "#382010"), {"age": 50.0, "sex": 0.2}, told, "long")
    assert told.items() <= tables["person"].items()
    assert tables["hair"]["style"] == "long"
