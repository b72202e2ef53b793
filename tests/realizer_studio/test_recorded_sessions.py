"""The replay of recordings: feedback, frames and sound."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from random import Random

import numpy as np
import pytest
from click.testing import CliRunner

from realizer.animation.axis import AU_NAMES
from realizer.cli import cli
from realizer.core.array_types import Int32
from realizer.core.settings import Settings
from realizer.outputs.output import RenderSettings
from realizer.protocol.wire import ClipPiece, pack_clip, unpack
from realizer.server.journal import JournalError
from realizer.server.journal.entry import SavedSession
from realizer.server.journal.recordings import RecordingFolder, read_recording, recording_head
from realizer.server.session.effects import Send, Speak
from realizer.server.session.session import Session
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.silent import SilentVoice
from realizer_studio import recorded_sessions
from realizer_studio.recorded_sessions import replay_recording
from tests.pictures import drawn_here
from tests.wake_times import next_wake

SETTINGS = Settings(voice="silent", seed=3)
SPEECH = """<bml id="a"><speech id="s"><text>Hello, how are <sync id="m"/>you?</text></speech>
<head id="n" lexeme="NOD" stroke="s:m"/><gaze id="g" target="cup" start="0.4" end="1.4"/></bml>"""
SMILE = '<bml id="b" composition="APPEND"><faceLexeme id="f" lexeme="SMILE" end="1"/></bml>'
SCENE = '{"type": "scene", "objects": {"cup": {"x": 0.2, "y": -0.1, "z": 0.5}}}'


def recorded(folder: Path) -> tuple[Path, list[str]]:
    """A session that was played with a slow voice: its recording, and its feedback."""
    session = Session("s", SETTINGS, 100.0, named=True, epoch=1e9)
    session.journal.open(recorder=RecordingFolder(folder, recording_head(SETTINGS, None)))
    session.journal.begin(1e9)
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
    session.journal.end()
    return next(folder.glob("*.jsonl")), feedback


def test_replay_recording_repeats_the_feedback_to_the_last_digit(tmp_path: Path) -> None:
    path, feedback = recorded(tmp_path)
    realization, again = replay_recording(read_recording(path))
    assert again == recorded_sessions.replay_feedback(read_recording(path)) == feedback
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
    session.journal.open(recorder=record)
    session.journal.begin(1e9)
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


OPENED = 100.0  # s, on the clock of the host
WATCH = '{"type": "subscribe", "stream": "fap", "encoding": "binary"}'
BROW = AU_NAMES().index("4L")
PLAYED = [
    '<speech id="s"><text>Hello, how are <sync id="m"/>you today?</text></speech>'
    '<head id="n" lexeme="NOD" stroke="s:m"/>',
    '<faceLexeme id="f" lexeme="SMILE" end="1"/>',
    '<gaze id="g" target="cup" start="0.4" end="1.4"/>',
    '<faceShift id="f"><faceLexeme id="l" lexeme="SMILE" amount="0.5"/></faceShift>',
    '<head id="h" lexeme="SHAKE" repetition="2"/>',
]


def setting(**what: object) -> str:
    return json.dumps({"type": "set", **what})


def random_recording(
    folder: Path,
    doings: Sequence[tuple[float, str | bytes]],
    seconds: float,
    late: Random | None = None,
    watch: str = WATCH,
) -> tuple[SavedSession, list[bytes]]:
    """Return the recording of a session with that input, and what a client received of its stream.

    Args:
        doings: seconds on its clock, and the message.
        late: draws how late it is woken; None: never.
    """
    session = Session("s", SETTINGS, OPENED, named=True, epoch=1e9)
    session.journal.open(recorder=RecordingFolder(folder, recording_head(SETTINGS, None)))
    session.journal.begin(1e9)
    session.connect(1, OPENED)
    got: list[bytes] = []
    answers: list[tuple[float, Speak]] = []
    coming: list[tuple[float, str | bytes]] = [(OPENED, watch), *((OPENED + t, doing) for t, doing in doings)]
    now = OPENED
    while now < OPENED + seconds:
        due = next_wake(session)
        soonest = [when for when, _ in (*coming[:1], *answers)]
        now = max(now, min([OPENED + seconds, *soonest, due]))
        now += 0.0 if late is None else late.uniform(0, 0.03)
        if coming and coming[0][0] <= now:
            session.receive(1, coming.pop(0)[1], now)
        elif answers and answers[0][0] <= now:
            order = answers.pop(0)[1]
            session.on_speech(order.id, speak_to_length(SilentVoice(), order.request), now)
        else:
            session.tick(now)
        for effect in session.take_effects():
            if isinstance(effect, Speak):
                answers.append((now + 0.2, effect))
            elif isinstance(effect, Send) and isinstance(effect.data, bytes):
                got.append(effect.data)
    session.disconnect(1, now)
    session.journal.end()
    return read_recording(folder), got


def faps(got: list[bytes]) -> dict[int, Int32]:
    """Frame -> (68,) its FAPs."""
    return {unpack(one).frame: np.frombuffer(unpack(one).payload, "<i4") for one in got}


def some(random: Random, seconds: float) -> list[tuple[float, str]]:
    """Anything, in any order, about twice a second."""
    doings: list[tuple[float, str]] = []
    t = 0.1
    while (t := t + random.expovariate(2.0)) < seconds:
        value = random.choice([None, 0.3, 0.8])
        doings.append(
            (
                t,
                random.choice(
                    [
                        setting(aus={random.choice(["1", "12L", "26", "4"]): value}),
                        setting(faps={"open_jaw": random.choice([None, 100, 50])}),
                        setting(emotion=random.choice([None, {"type": "anger", "intensity": 0.7}])),
                        '{"type": "stop"}',
                        '{"type": "speech", "id": "turn", "append": "One two three. And so on. "}',
                        '{"type": "speech", "id": "turn", "close": true}',
                        *(
                            f'<bml id="b{len(doings)}" composition="{composition}">'
                            f"{random.choice(PLAYED)}</bml>"
                            for composition in ("MERGE", "APPEND", "REPLACE")
                        ),
                    ]
                ),
            )
        )
    return doings


@pytest.mark.parametrize("seed", range(8))
def test_viewer_has_the_frames_of_a_session_woken_late(seed: int, tmp_path: Path) -> None:
    random = Random(seed)
    record, got = random_recording(tmp_path, some(random, 6.0), 8.0, random if seed % 2 else None)
    live = faps(got)
    again = replay_recording(record)[0].faps.integers()
    assert len(live) > 190
    for number, row in live.items():
        assert np.array_equal(again[number], row), number


def test_viewer_frames_last_until_set_values_are_reached(tmp_path: Path) -> None:
    doings = [(0.5, setting(aus={"4": 1})), (1.0, '{"type": "stop"}')]
    record, _ = random_recording(tmp_path / "held", doings, 3.0)
    assert replay_recording(record)[0].duration == record.entries[-1].at == pytest.approx(3.0)
    record, _ = random_recording(tmp_path / "let go of", [*doings, (2.999, setting(aus=None))], 3.0)
    faded = replay_recording(record)[0]
    assert 3.2 < faded.duration < 3.5
    brow = faded.aus.aus[:, BROW]
    assert brow[40] > 0.9
    assert brow[-1] < 0.05


def test_viewer_frames_last_until_a_shift_is_complete(tmp_path: Path) -> None:
    smile = '<faceShift id="f" {}><faceLexeme id="l" lexeme="SMILE"/></faceShift>'
    for name, timing in (("begun", 'start="0" end="3"'), ("not begun", 'start="2" end="3"')):
        doings = [(0.5, f'<bml id="b">{smile.format(timing)}</bml>'), (1.5, '{"type": "stop"}')]
        record, _ = random_recording(tmp_path / name, doings, 2.0)
        duration = replay_recording(record)[0].duration
        assert duration == pytest.approx(3.5 if name == "begun" else 2.0, abs=0.1), name


def test_viewer_frames_last_until_the_last_block_that_begins(tmp_path: Path) -> None:
    bmla = 'xmlns:bmla="http://www.asap-project.org/bmla"'
    never = f'<bml id="n" {bmla} bmla:preplan="true"><head id="h" lexeme="NOD"/></bml>'
    smile = '<bml id="b"><faceLexeme id="f" lexeme="SMILE" end="3"/></bml>'
    record, _ = random_recording(tmp_path, [(0.5, never), (0.6, smile)], 1.5)
    assert replay_recording(record)[0].duration == pytest.approx(3.6, abs=0.1)


def test_viewer_hears_a_speech_until_it_was_cut_off(tmp_path: Path) -> None:
    rate = 8000
    pcm = np.random.default_rng(1).integers(-9000, 9000, 3 * rate).astype("<i2")
    clip = pack_clip(ClipPiece("c", 0, rate, pcm.tobytes(), final=True))
    says = (
        '<bml xmlns:bmlt="http://hmi.ewi.utwente.nl/bmlt" id="b{}" composition="REPLACE"><speech id="s">'
        '<text>Hello</text><description priority="1" type="audio/x-clip"><bmlt:audiofile fileName="clip:c"/>'
        "</description></speech></bml>"
    )
    doings: list[tuple[float, str | bytes]] = [
        (0.1, clip),
        (0.2, says.format(1)),
        (1.31, says.format(2)),
        (2.77, '{"type": "stop"}'),
    ]
    hear = json.dumps({"type": "subscribe", "stream": "audio", "rate": rate})
    record, got = random_recording(tmp_path, doings, 4.0, watch=hear)
    again = replay_recording(record)[0].sound(rate)
    live = np.zeros_like(again)
    for packet in map(unpack, got):
        first = packet.frame * rate // 50
        if packet.flush:
            live[first:] = 0
        else:
            live[first : first + rate // 50] = np.frombuffer(packet.payload, "<i2")
    assert len(again) == 4 * rate
    assert 2.4 < np.count_nonzero(again) / rate < 2.7
    assert np.array_equal(again, live)


def test_viewer_sees_set_values_at_their_time_only(tmp_path: Path) -> None:
    doings = [(at, setting(faps={"open_jaw": value})) for at, value in ((0.5, 100), (1.5, None), (2.5, 60))]
    record, _ = random_recording(tmp_path, doings, 3.5)
    jaw = replay_recording(record)[0].faps.integers()[:, 2]
    assert [int(jaw[round(25 * at)]) for at in (0.4, 1.2, 2.3, 3.2)] == [0, 100, 0, 60]


@pytest.mark.slow
def test_viewer_sees_the_face_of_the_time(tmp_path: Path) -> None:
    doings = [(0.2, setting(aus={"12": 1})), (1.01, '{"type": "character", "face": "ben"}')]
    record, got = random_recording(tmp_path, doings, 2.0)
    realization, _ = replay_recording(record)
    again = realization.faps.integers()
    assert all(np.array_equal(again[number], row) for number, row in faps(got).items())
    (_, before), (changed, after) = realization.faces
    assert (before.face_name, changed, after.face_name) == ("ada", 26, "ben")
    assert (before.frames, after.frames) == (26, realization.frames - 26)
    size = (48, 48)
    pictures = list(RenderSettings(size=size).pictures(realization, size, [25, 26]))
    assert len(pictures) == 2
    shown = drawn_here("ben", size, realization.poses[[25, 26]])
    assert np.array_equal(pictures[1], shown[1])
    assert np.abs(pictures[0].astype(int) - shown[0]).mean() > 5


def test_viewer_has_later_characters_from_the_first_frame(tmp_path: Path) -> None:
    doings = [(0.5, setting(character="a", aus={"1": 1})), (1.0, setting(character="b", aus={"4": 1}))]
    record, _ = random_recording(tmp_path, doings, 2.0)
    realization, _ = replay_recording(record)
    first, second = realization.characters.values()
    assert first.faps.values.shape == second.faps.values.shape
    assert second.aus.aus[:24, BROW].max() < 0.15  # no more than an idle face shows
    assert second.aus.aus[40, BROW] == pytest.approx(1)
