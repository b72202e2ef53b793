"""Tests of `realizer outputs` and `realizer voices`."""

from __future__ import annotations

import sys

import pytest

from realizer.cli import list_commands
from realizer.outputs.registry import OUTPUTS
from realizer.speech.registry import voices
from tests.commands import run


def lines() -> dict[str, str]:
    """Suffix -> the rest of its line."""
    list_commands._fix.cache_clear()
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
    list_commands._fix.cache_clear()
    for suffix in (".mp4", ".webm"):
        assert "pip install 'bml-realizer[film]'" in found[suffix]
    assert not [suffix for suffix in (".fap", ".glb", ".wav") if "missing" in found[suffix]]


@pytest.mark.parametrize("suffix", OUTPUTS)
def test_outputs_that_draw_need_the_extra_render(suffix: str) -> None:
    assert ("render" in OUTPUTS[suffix].needs) == (OUTPUTS[suffix].picture_size is not None)


def test_voices_has_a_line_for_each_voice() -> None:
    rows = [line.split(maxsplit=1) for line in run("voices").stdout.splitlines()]
    assert rows == [[voice.name, voice.description] for voice in voices()]
