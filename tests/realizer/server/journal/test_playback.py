"""The replay of recordings: feedback, frames and sound."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from realizer.cli import cli
from realizer.core.settings import Settings
from realizer.server.journal import JournalError, playback
from realizer.server.journal.playback import replay_recording
from realizer.server.journal.recordings import RecordingFolder, read_recording, recording_head
from realizer.server.journal.session_journal import JournalWriter
from realizer.server.session.effects import Send, Speak
from realizer.server.session.session import Session
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.silent import SilentVoice

SETTINGS = Settings(voice="silent", seed=3)
SPEECH = """<bml id="a"><speech id="s"><text>Hello, how are <sync id="m"/>you?</text></speech>
<head id="n" lexeme="NOD" stroke="s:m"/><gaze id="g" target="cup" start="0.4" end="1.4"/></bml>"""
SMILE = '<bml id="b" composition="APPEND"><faceLexeme id="f" lexeme="SMILE" end="1"/></bml>'
SCENE = '{"type": "scene", "objects": {"cup": {"x": 0.2, "y": -0.1, "z": 0.5}}}'


def recorded(folder: Path) -> tuple[Path, list[str]]:
    """A session that was played with a slow voice: its recording, and its feedback."""
    session = Session("s", SETTINGS, 100.0, named=True, epoch=1e9)
    session.journal.writer = JournalWriter(
        "s", recorder=RecordingFolder(folder, recording_head(SETTINGS, None))
    )
    session.journal.writer.begin(1e9)
    session.connect(1, 100.0)
    coming = [
        (100.05, SCENE),
        (100.1, SPEECH),
        (100.7, SMILE),
        (100.9, "<bml"),
        (101.0, '{"type": "set", "aus": {"12L": 0.3}}'),
    ]
    feedback: list[str] = []
    answers: list[tuple[float, Speak]] = []
    for step in range(800):
        now = 100.0 + step * 0.0107
        while coming and coming[0][0] <= now:
            session.receive(1, coming.pop(0)[1], now)
        while answers and answers[0][0] <= now:
            order = answers.pop(0)[1]
            session.on_speech(order.id, speak_to_length(SilentVoice(), order.request), now)
        session.tick(now)
        for effect in session.take_effects():
            if isinstance(effect, Speak):
                answers.append((now + 0.2, effect))
            elif isinstance(effect, Send) and str(effect.data).startswith("<"):
                feedback.append(str(effect.data))
    session.disconnect(1, now)
    session.journal.writer.end()
    return next(folder.glob("*.jsonl")), feedback


def test_replay_recording_repeats_the_feedback_to_the_last_digit(tmp_path: Path) -> None:
    path, feedback = recorded(tmp_path)
    realization, again = replay_recording(read_recording(path))
    assert again == playback.replay_feedback(read_recording(path)) == feedback
    assert any('"b:end"' in text for text in feedback)
    last = json.loads(path.read_text().splitlines()[-1])
    assert realization.duration == pytest.approx(last["at"], abs=0.05)
    assert [w.text for w in realization.speeches[0].utterance.words] == ["Hello", "how", "are", "you"]


def test_replay_recording_plays_what_was_planned_to_its_end(tmp_path: Path) -> None:
    path, feedback = recorded(tmp_path)
    lines = path.read_text().splitlines()
    spoken = next(k for k, line in enumerate(lines) if '"spoken"' in line)
    path.write_text("\n".join(lines[: spoken + 1]) + '\n{"at": 0.9, "kind": "te')
    _, again = replay_recording(read_recording(path))
    assert any('id="a:end"' in text for text in again)
    assert not any('id="b:' in text for text in again)
    assert again[:4] == feedback[:4]


def test_replay_recording_ends_with_the_words_of_an_open_speech(tmp_path: Path) -> None:
    session = Session("s", SETTINGS, 100.0, named=True, epoch=1e9)
    record = RecordingFolder(tmp_path, recording_head(SETTINGS, None))
    session.journal.writer = JournalWriter("s", recorder=record)
    session.journal.writer.begin(1e9)
    session.connect(1, 100.0)
    session.receive(1, '{"type": "speech", "id": "turn", "append": "One two three. Four"}', 100.1)
    for step in range(100):
        now = 100.1 + step * 0.02
        session.tick(now)
        for effect in session.take_effects():
            if isinstance(effect, Speak):
                session.on_speech(effect.id, speak_to_length(SilentVoice(), effect.request), now)
    record.close()
    (path,) = tmp_path.glob("*.jsonl")
    realization, again = replay_recording(read_recording(path))
    assert any('"turn:end"' in text for text in again)
    assert 1.0 < realization.duration < 10.0


@pytest.mark.parametrize(
    ("first", "fault"),
    [
        ("", "1: wanted the head of a recording"),
        ('{"session": "s"}', "1: wanted the head of a recording"),
        ('{"session": "s", "epoch": 0, "settings": {"fps": "quick"}}', "fps"),
        ('{"session": "s", "epoch": 0, "settings": 7}', "settings: wanted an object"),
        ('{"session": "s", "epoch": 0, "scene": {"cup": 1}}', "scene: wanted positions"),
    ],
)
def test_replay_recording_refuses_a_bad_head(first: str, fault: str, tmp_path: Path) -> None:
    path = tmp_path / "x.jsonl"
    path.write_text(first + "\n")
    with pytest.raises(JournalError, match=fault):
        replay_recording(read_recording(path))


def test_replay_recording_names_the_line_that_is_no_entry(tmp_path: Path) -> None:
    path, _ = recorded(tmp_path)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:3], "?", *lines[3:], ""]))
    with pytest.raises(JournalError, match=r"jsonl:4: wanted an entry"):
        read_recording(path)


def test_replay_command_prints_feedback_and_writes_any_output(tmp_path: Path) -> None:
    path, feedback = recorded(tmp_path)
    printed = CliRunner().invoke(cli, ["replay", str(path)])
    assert printed.output.splitlines() == "\n".join(feedback).splitlines()
    out = tmp_path / "x.json"
    assert CliRunner().invoke(cli, ["replay", str(path), "-o", str(out), "--fps", "10"]).exit_code == 0
    assert json.loads(out.read_text())["fps"] == 10


def test_replay_recording_is_silent_without_its_voice(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, feedback = recorded(tmp_path)
    path.write_text(path.read_text().replace('"voice": "silent"', '"voice": "no-such-voice"'))
    assert len(replay_recording(read_recording(path), voice="silent")[1]) == len(feedback)
    again = replay_recording(read_recording(path))[1]
    assert sum("no-such-voice" in text for text in again) == 1  # in a warning
    assert any('id="b:end"' in text for text in again)
    assert "no-such-voice" in capsys.readouterr().err
