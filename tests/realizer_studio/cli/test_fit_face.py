"""Tests of `realizer faces fit`."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from click import BadParameter

from realizer.face.load import folder_of
from realizer_studio.cli.fit_face import _files
from tests.commands import run


def test_files_of_a_folder_are_one_for_each_form(tmp_path: Path) -> None:
    both = {"published": tmp_path / "au_published.toml", "extended": tmp_path / "au_extended.toml"}
    assert _files(tmp_path, None) == _files(tmp_path, "both") == both
    assert _files(tmp_path, "published") == {"published": both["published"]}


def test_files_of_a_name_are_the_extended_form_unless_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    assert _files(path, None) == {"extended": path}
    assert _files(path, "published") == {"published": path}


@pytest.mark.parametrize(("name", "form"), [("mine.toml", "both"), ("nowhere", None)])
def test_files_of_two_forms_want_a_folder_that_exists(tmp_path: Path, name: str, form: str | None) -> None:
    with pytest.raises(BadParameter, match="wanted a folder"):
        _files(tmp_path / name, form)


def test_fit_takes_measurements_or_data_but_not_both(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("")
    done = run("faces", "fit", "default", "--from", str(tmp_path / "points.csv"), "--data", str(tmp_path))
    assert done.returncode == 2
    assert "wanted --from or --data, got both" in done.stderr


def test_fit_of_a_face_without_shapes_says_what_to_give(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(folder_of("default"), tmp_path / "bare", ignore=shutil.ignore_patterns("au_shapes.npz"))
    monkeypatch.setenv("REALIZER_FACES", str(tmp_path))
    done = run("faces", "fit", "bare", "-o", str(tmp_path / "model.toml"))
    assert done.returncode == 3
    assert "--from" in done.stderr
    assert not (tmp_path / "model.toml").exists()
