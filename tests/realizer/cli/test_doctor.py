"""Tests of `realizer doctor`."""

from __future__ import annotations

import json
import shutil
import sys

import numpy as np
import pytest

from realizer.cli.doctor import _fix
from realizer.outputs.registry import OUTPUTS
from realizer.speech.registry import voices
from tests.commands import run


@pytest.mark.slow
def test_doctor_names_every_part_and_exits_with_0() -> None:
    done = run("doctor")
    assert done.returncode == 0
    for part in ("pictures", "FFmpeg", "silent", "node", "face", "page"):
        assert part in done.stdout
    assert {line.split()[0] for line in done.stdout.splitlines()} <= {"ok", "missing"}


def test_doctor_says_how_to_fix_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
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


def test_doctor_shows_the_first_fault_of_a_face(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("realizer.facebuild.check.check_face", lambda name: ("mesh.npz: torn", "more"))
    monkeypatch.setattr("realizer.render.drawing_process.available_backend", lambda: ("gl", None))
    lines = [line for line in run("doctor").stdout.splitlines() if "torn" in line]
    assert lines
    assert all(line.startswith("missing") and "more" not in line for line in lines)


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
    monkeypatch.setattr("realizer.facebuild.check.check_face", lambda name: ())
    monkeypatch.setattr("realizer.render.drawing_process.available_backend", lambda: ("gl", None))
    found = json.loads(run("doctor", "--json").stdout)
    assert found["versions"]["numpy"] == np.__version__
    parts = {part["part"]: part for part in found["parts"]}
    assert {"pictures", "FFmpeg", "silent", "node", "face", "page"} <= set(parts)
    assert parts["pictures"] == {"part": "pictures", "works": True, "text": "drawn by OpenGL"}
