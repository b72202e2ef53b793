"""Tests of `realizer faces`."""

from __future__ import annotations

from pathlib import Path

import pytest

from realizer.face.load import list_faces
from tests.commands import run


def test_faces_list_has_a_line_for_each_face_with_its_licence() -> None:
    lines = run("faces", "list").stdout.splitlines()
    assert [line.split()[0] for line in lines] == [face.name for face in list_faces()]
    assert all(f"[{face.licence}]" in line for face, line in zip(list_faces(), lines, strict=True))


def test_faces_list_names_what_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "face.toml").write_text("name = 3\n")
    monkeypatch.setenv("REALIZER_FACES", str(tmp_path))
    done = run("faces", "list")
    assert done.returncode == 0
    assert "broken: cannot be read; run realizer faces check broken" in done.stderr


def test_faces_zones_of_an_unknown_face_exits_with_3(tmp_path: Path) -> None:
    done = run("faces", "zones", "nobody", "-o", str(tmp_path / "x"))
    assert done.returncode == 3
    assert "nobody" in done.stderr
    assert not (tmp_path / "x").exists()


def test_faces_build_without_its_data_exits_with_3(tmp_path: Path) -> None:
    done = run("faces", "build", "ada", "--data", str(tmp_path), "-o", str(tmp_path / "ada"))
    assert done.returncode == 3
    assert str(tmp_path) in done.stderr
