"""Tests of `realizer_studio.editors.design.documents`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from bml_schema import CORE
from realizer.cli import cli
from realizer.core.errors import TableError
from realizer.core.settings import Settings
from realizer.expressions.timeline import Entry, Timeline, Track
from realizer.expressions.timeline_file import read_timeline, timeline_json, write_timeline
from realizer.outputs.wav import RATE
from realizer_studio.editors.design.documents import enrich_text, export, open_file, sound

SETTINGS = Settings(voice="silent")
TIMELINE = Timeline(
    (
        Track(
            "brows", (Entry("template:surprise", 0.8, 1.2), Entry("neutral", duration=0.4), Entry("smile"))
        ),
        Track(
            "mood", (Entry("template:anger", 0.5, 2.0, 0.2, 0.7, "an exclamation"),), "onset", "smooth", 0.5
        ),
    ),
    "additive",
)


def read(opened) -> Timeline:  # type: ignore[no-untyped-def]
    return read_timeline(json.dumps(opened.timeline).encode())


@pytest.mark.parametrize("form", ["fap", "csv"])
def test_export_gives_the_faps_of_realizer_timeline_to_the_bit(tmp_path: Path, form: str) -> None:
    file, out = tmp_path / "timeline.toml", tmp_path / f"out.{form}"
    file.write_text(export(TIMELINE, "toml", SETTINGS), "utf-8")
    done = CliRunner().invoke(cli, ["timeline", str(file), "-o", str(out), "--voice", "silent"])
    assert done.exit_code == 0, done.output
    assert export(TIMELINE, form, SETTINGS) == out.read_text("utf-8")


def test_open_file_reads_what_export_wrote() -> None:
    assert read(open_file(export(TIMELINE, "toml", SETTINGS), SETTINGS)) == TIMELINE
    assert read(open_file(json.dumps(timeline_json(TIMELINE)), SETTINGS)) == TIMELINE


def test_open_file_keeps_an_unknown_expression_and_says_so() -> None:
    timeline = Timeline((Track("a", (Entry("smile"), Entry("wry"))),))
    opened = open_file(write_timeline(timeline), SETTINGS)
    assert read(opened) == timeline
    assert opened.left_out == ["wry: unknown here"]


def test_open_file_reads_expressions_of_bml_and_says_what_is_left_out() -> None:
    bml = export(TIMELINE, "bml", SETTINGS, [(0.5, "Hello there.")]).replace(
        "</bml>", '<head id="h" lexeme="NOD"/><faceLexeme id="f" lexeme="SMILE" start="6" end="8"/></bml>'
    )
    opened = open_file(bml, SETTINGS)
    assert opened.left_out == ["h: a timeline holds expressions, got <head>"]
    assert opened.says == [(0.5, "Hello there.")]
    assert opened.words[0][0] == pytest.approx(0.5, abs=0.1)
    assert [word for _, _, word in opened.words] == ["Hello", "there"]
    first, second = read(opened).tracks
    assert [entry.expression for entry in first.entries] == [
        "template:surprise", "neutral", "smile", "neutral", "SMILE",
    ]  # fmt: skip
    (anger,) = second.entries
    assert (anger.intensity, anger.duration, anger.because) == (0.5, 2.0, "an exclamation")
    assert (anger.onset, anger.offset, second.start) == (0.2, 0.7, 0.5)


def test_open_file_returns_the_sync_points_of_a_speech() -> None:
    text = "<text>Hello <sync id='here'/>there.</text>"
    bml = f"<bml xmlns='{CORE}' id='b'><speech id='s' start='1'>{text}</speech></bml>"
    opened = open_file(bml, SETTINGS)
    ((time, name),) = opened.syncs
    assert name == "here"
    assert time == pytest.approx(opened.words[1][0], abs=0.1)


def test_open_file_refuses_what_is_neither() -> None:
    with pytest.raises(TableError, match="wanted a timeline in TOML or JSON"):
        open_file("words", SETTINGS)
    with pytest.raises(TableError, match="line 1: not well-formed"):
        open_file("<bml><nothing", SETTINGS)


def test_enrich_text_fills_lanes_with_reasons() -> None:
    opened = enrich_text("Are you sure? That is nonsense!", SETTINGS)
    entries = [entry for track in read(opened).tracks for entry in track.entries if entry.is_expression]
    assert {entry.expression for entry in entries} == {"template:surprise", "template:anger"}
    assert all(entry.because and "Wojdel" in entry.because for entry in entries)
    assert opened.words[0][2] == "Are"
    assert opened.left_out == []
    assert opened.peaks == []


def test_enrich_text_shows_a_listener() -> None:
    opened = enrich_text("It is terrible!", SETTINGS, listener=True)
    assert "template:astonishment" in {entry.expression for t in read(opened).tracks for entry in t.entries}


def test_sound_has_each_speech_at_its_start() -> None:
    settings = Settings(voice="espeak")
    heard = sound([(0.0, "Hello."), (3.0, "There.")], settings)
    alone = sound([(0.0, "Hello.")], settings)
    assert np.array_equal(heard[: len(alone)], alone)
    assert not heard[len(alone) : round(2.99 * RATE)].any()
    assert heard[round(2.99 * RATE) :].any()


def test_sound_of_a_silent_voice_is_empty() -> None:
    assert len(sound([(0.0, "Hello.")], SETTINGS)) == 0
