"""Tests of `realizer plugins`; tests/test_plugins.py installs some."""

from __future__ import annotations

import json
from importlib.metadata import EntryPoint, EntryPoints

import pytest

from realizer.core import registry
from realizer.speech.registry import VOICES
from tests.commands import run


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
    assert "cannot be imported: ModuleNotFoundError" in lines["torn"]


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
