"""Tests of `realizer faces import` and `realizer faces check`."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from realizer.core.errors import FaceError
from tests.commands import run

IMPORTER = "realizer.facebuild.arkit.importer"


@pytest.fixture
def head(tmp_path: Path) -> Path:
    path = tmp_path / "anna.glb"
    path.write_bytes(b"glTF")
    return path


def test_import_names_the_face_after_the_option_the_folder_or_the_file(
    head: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = []

    def import_head(path: Path, folder: Path, name: str) -> SimpleNamespace:
        calls.append((folder, name))
        return SimpleNamespace(lines=("52 shapes",))

    monkeypatch.setattr(f"{IMPORTER}.import_head", import_head)
    done = run("faces", "import", str(head))
    assert (done.returncode, done.stdout) == (0, "52 shapes\n")
    assert "realizer faces sheet anna -o anna.png" in done.stderr
    run("faces", "import", str(head), "-o", str(tmp_path / "eve"))
    run("faces", "import", str(head), "--name", "mia")
    assert calls == [(Path("faces/anna"), "anna"), (tmp_path / "eve", "eve"), (Path("faces/mia"), "mia")]


def test_import_of_a_file_that_is_no_head_exits_with_3(head: Path, tmp_path: Path) -> None:
    done = run("faces", "import", str(head), "-o", str(tmp_path / "x"))
    assert done.returncode == 3
    assert "anna.glb" in done.stderr
    assert not (tmp_path / "x").exists()


def test_check_of_a_head_prints_what_an_import_would_find(
    head: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(f"{IMPORTER}.inspect_head", lambda path: SimpleNamespace(lines=("no jawOpen",)))
    done = run("faces", "check", str(head))
    assert (done.returncode, done.stdout) == (0, "no jawOpen\n")


def test_check_exits_with_1_if_one_of_several_has_faults(head: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def inspect_head(path: Path) -> SimpleNamespace:
        raise FaceError(f"{path}: wanted shapes")

    monkeypatch.setattr(f"{IMPORTER}.inspect_head", inspect_head)
    monkeypatch.setattr("realizer.facebuild.check.check_face", lambda name: ())
    done = run("faces", "check", str(head), "default")
    assert (done.returncode, done.stdout) == (1, f"{head}: wanted shapes\n")
    assert done.stderr == "default: sound\n"
    assert run("faces", "check", "-q", "default").stderr == ""
