"""Tests of `realizer align`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from realizer.cli import cli
from realizer.speech.espeak.voice import EspeakVoice, install_hint
from realizer.speech.utterance import SpeechRequest
from tests.realizer.behaviours.conftest import wav

pytestmark = pytest.mark.skipif(bool(install_hint()), reason=str(install_hint()))


def test_align_writes_words_with_their_times(tmp_path: Path) -> None:
    voice = EspeakVoice()
    said = voice.say(SpeechRequest("Guten Morgen, wie geht es Ihnen?", language="de", voice="de+m3"))
    voice.close()
    audio = tmp_path / "a.wav"
    audio.write_bytes(wav(said.pcm.tobytes(), rate=said.sample_rate))
    (tmp_path / "text").write_text("Guten Morgen, wie geht es Ihnen?", "utf-8")
    for name in ("out.json", "out.vtt"):
        run = ["align", str(audio), f"@{tmp_path / 'text'}", "--language", "de", "-o", str(tmp_path / name)]
        assert CliRunner().invoke(cli, run, catch_exceptions=False).exit_code == 0
    found = json.loads((tmp_path / "out.json").read_text("utf-8"))
    assert [w["text"] for w in found["words"]] == [w.text for w in said.words]
    assert found["words"][1]["start"] == pytest.approx(said.words[1].start, abs=0.06)
    assert found["confidence"] > 0.5
    assert (tmp_path / "out.vtt").read_text("utf-8").startswith("WEBVTT\n\n00:00:00.")
    shown = CliRunner().invoke(cli, ["align", str(audio), "Guten Morgen", "--language", "de"])
    assert "Morgen" in shown.output


def test_align_refuses_an_unknown_suffix(tmp_path: Path) -> None:
    (tmp_path / "a.wav").write_bytes(b"")
    run = CliRunner().invoke(cli, ["align", str(tmp_path / "a.wav"), "x", "-o", "x.txt"])
    assert run.exit_code == 2
    assert "x.txt: wanted a name that ends in .json or .vtt" in run.output
