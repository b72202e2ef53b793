"""Tests of `realizer doctor` and `realizer plugins`; tests/test_plugins.py installs some plug-ins."""

from __future__ import annotations

import json
import shutil
import sys
from importlib.metadata import EntryPoint, EntryPoints
from types import SimpleNamespace

import numpy as np
import pytest

from realizer.cli.doctor import _fix
from realizer.core import registry
from realizer.core.errors import FaceError
from realizer.face.model import Face
from realizer.outputs.registry import OUTPUTS
from realizer.speech.registry import VOICES, voices
from tests.commands import run


@pytest.mark.slow
def test_doctor_names_every_part_and_exits_with_0() -> None:
    done = run("doctor")
    assert done.returncode == 0
    for part in ("pictures", "FFmpeg", "silent", "node", "face", "page"):
        assert part in done.stdout
    assert {line.split()[0] for line in done.stdout.splitlines()} <= {"ok", "missing"}


def test_doctor_says_how_to_fix_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    _fix.cache_clear()
    monkeypatch.setitem(sys.modules, "av", None)
    monkeypatch.setattr(shutil, "which", lambda name: None)
    monkeypatch.setattr("realizer.render.drawing_process.available_backend", lambda: ("gl", "install GL"))
    monkeypatch.setattr("realizer.face.load.list_faces", lambda: ())
    found = [line.split(maxsplit=2) for line in run("doctor").stdout.splitlines()]
    missing = {part: text for mark, part, text in found if mark == "missing"}
    assert missing["FFmpeg"] == "pip install 'bml-realizer[film]'"
    assert missing["pictures"] == "install GL"
    assert missing["faces"].startswith("no face folder was found")
    assert missing["node"].startswith("not needed to run")


@pytest.mark.parametrize(
    ("python", "fix"),
    [((3, 13), "pip install 'bml-realizer[align]'"), ((3, 14), "pocketsphinx has no wheels for Python 3.14")],
)
def test_doctor_says_which_pythons_have_an_aligner(
    python: tuple[int, int], fix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pocketsphinx", None)
    monkeypatch.setattr("realizer_studio.align.sphinx.sys", SimpleNamespace(version_info=python))
    monkeypatch.setattr("realizer.render.drawing_process.available_backend", lambda: ("gl", None))
    (line,) = (line for line in run("doctor").stdout.splitlines() if line.split()[1] == "align")
    assert line.startswith("missing")
    assert fix in line


def test_doctor_shows_the_fault_of_a_face(monkeypatch: pytest.MonkeyPatch) -> None:
    def load_face(name: str) -> Face:
        raise FaceError("mesh.npz: torn")

    monkeypatch.setattr("realizer.face.load.load_face", load_face)
    monkeypatch.setattr("realizer.render.drawing_process.available_backend", lambda: ("gl", None))
    lines = [line for line in run("doctor").stdout.splitlines() if "torn" in line]
    assert lines
    assert all(line.startswith("missing") for line in lines)


def lines() -> dict[str, str]:
    """Suffix -> the rest of its line."""
    _fix.cache_clear()
    return dict(line.split(maxsplit=1) for line in run("outputs").stdout.splitlines())


def test_outputs_has_a_line_for_each_output() -> None:
    found = lines()
    assert list(found) == sorted(OUTPUTS)
    for suffix, output in OUTPUTS.items():
        assert output.media_type in found[suffix]
        assert output.description in found[suffix]


def test_outputs_says_what_to_install_for_films(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    found = lines()
    _fix.cache_clear()
    for suffix in (".mp4", ".webm"):
        assert "pip install 'bml-realizer[film]'" in found[suffix]
    assert not [suffix for suffix in (".fap", ".glb", ".wav") if "missing" in found[suffix]]


@pytest.mark.parametrize("suffix", OUTPUTS)
def test_outputs_that_draw_need_the_extra_render(suffix: str) -> None:
    assert ("render" in OUTPUTS[suffix].needs) == (OUTPUTS[suffix].picture_size is not None)


def test_voices_has_a_line_for_each_voice() -> None:
    rows = [line.split(maxsplit=1) for line in run("voices").stdout.splitlines()]
    assert rows == [[voice.name, voice.description] for voice in voices()]


def test_doctor_prints_json_with_versions(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("realizer_studio.faces.check.check_face", lambda name: ())
    monkeypatch.setattr("realizer.render.drawing_process.available_backend", lambda: ("gl", None))
    found = json.loads(run("doctor", "--json").stdout)
    assert found["versions"]["numpy"] == np.__version__
    parts = {part["part"]: part for part in found["parts"]}
    assert {"pictures", "FFmpeg", "silent", "node", "face", "page"} <= set(parts)
    assert parts["pictures"] == {"part": "pictures", "works": True, "text": "drawn by OpenGL"}


@pytest.fixture
def points(monkeypatch: pytest.MonkeyPatch) -> None:
    """Entry points: a voice that works, one that does not, and one whose name is taken."""
    rows = {"quiet": "realizer.speech.silent:SilentVoice", "torn": "no_such_module:X", "espeak": "x:Y"}
    found = EntryPoints(EntryPoint(name, value, "realizer.voices") for name, value in rows.items())
    monkeypatch.setattr(registry, "_installed", lambda: found)
    monkeypatch.delitem(VOICES.__dict__, "_plugins", raising=False)


def test_plugins_says_that_there_are_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "_installed", lambda: EntryPoints(()))
    done = run("plugins")
    assert (done.returncode, done.stdout) == (0, "")
    assert "no plug-ins are installed" in done.stderr


def test_plugins_lists_those_that_work_and_why_others_do_not(
    points: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = {line.split()[1]: line for line in run("plugins").stdout.splitlines()}
    monkeypatch.delitem(VOICES.__dict__, "_plugins")
    assert list(lines) == ["espeak", "quiet", "torn"]
    assert lines["quiet"].endswith("realizer.speech.silent:SilentVoice")
    assert "(not used: its name is taken)" in lines["espeak"]
    assert "needs the package" in lines["torn"]


def test_plugins_prints_json(points: None, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = json.loads(run("plugins", "--json").stdout)
    monkeypatch.delitem(VOICES.__dict__, "_plugins")
    assert [row["name"] for row in rows] == ["espeak", "quiet", "torn"]
    assert rows[1] == {
        "group": "realizer.voices",
        "name": "quiet",
        "package": "",
        "value": "realizer.speech.silent:SilentVoice",
        "fault": "",
    }
