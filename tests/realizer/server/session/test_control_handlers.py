"""Control messages: emotions, AUs and FAPs set in any order, stops, scenes, voices."""

from __future__ import annotations

import json
from itertools import permutations

import numpy as np
import pytest

from bml_schema.feedback import WarningFeedback
from realizer.animation.axis import axis
from realizer.playback.player import Player
from realizer.protocol.wire import ClipPiece, pack_clip
from realizer.server.journal.checkpoint import Checkpoint
from realizer.server.speech import speech_streams
from realizer.tables.emotions import emotion_faces
from tests.realizer.server.conftest import Driver, spoken

NOD = '<bml id="{}"><head id="n" lexeme="NOD"/></bml>'
TALK = '<bml id="{}"><speech id="s"><text>Hello there</text></speech></bml>'
SETS = (
    {"emotion": {"angle": 45, "activation": 6}},
    {"aus": {"12": 0.3, "1L": 0.9, "25": 0}},
    {"faps": {"open_jaw": 120, "raise_l_i_eyebrow": -80}},
)
BLOCKS = (
    '<bml id="a"><mood xmlns="urn:bml-realizer:1" id="m" name="sad" intensity="0.4" end="1"/></bml>',
    '<bml id="b"><faceFacs id="f" au="4" amount="0.5" start="0" attackPeak="0.5" relax="9" end="9.5"/></bml>',
    '<bml id="c"><faceLexeme id="l" lexeme="SMILE" start="0" attackPeak="0.5" relax="9" end="9.5"/></bml>',
)


class Face:
    """A session with a subscription to AUs."""

    def __init__(self, drive) -> None:
        self.driver = drive(idle=False)
        client = self.driver.send({"type": "subscribe", "stream": "au", "fps": 25})
        self.names = client.of("subscribed")[0]["names"]

    def set(self, seconds: float = 0.5, **fields) -> dict[str, float]:
        """Set something and return the AUs so many seconds later."""
        self.driver.send({"type": "set", **fields})
        return self.after(seconds)

    def after(self, seconds: float) -> dict[str, float]:
        frames = self.driver.run(self.driver.now + seconds).frames
        return dict(zip(self.names, map(float, frames[-1].values), strict=True))

    @property
    def whole(self) -> np.ndarray:
        """Every target there is, AUs before the rules, FAPs that did not come from them."""
        return self.driver.session.player.frames(np.array([self.driver.now])).values[0]


@pytest.fixture
def face(drive) -> Face:
    return Face(drive)


@pytest.mark.parametrize("pause", [0, 1])
def test_set_gives_the_same_face_in_any_order(drive, pause: float) -> None:
    faces = []
    for messages in permutations(SETS):
        face = Face(drive)
        for message in messages:
            face.set(pause, **message)
        face.after(1)
        faces.append(face.whole)
    together = Face(drive)
    together.set(1, **{key: value for message in SETS for key, value in message.items()})
    faces.append(together.whole)
    assert np.abs(faces[0]).sum() > 1
    for other in faces[1:]:
        assert other == pytest.approx(faces[0], abs=1e-5)


def test_set_gives_the_same_face_before_and_after_documents(drive) -> None:
    faces = []
    for chosen in list(permutations((*BLOCKS, SETS[0], SETS[1])))[::3]:
        face = Face(drive)
        for one in chosen:
            if isinstance(one, str):
                face.driver.send(one)
            else:
                face.set(0, **one)
        face.after(3)
        faces.append(face.whole)
    for other in faces[1:]:
        assert other == pytest.approx(faces[0], abs=1e-5)


def test_set_replaces_aus_of_an_emotion_until_they_are_released(face) -> None:
    joy = face.set(emotion={"name": "happiness"})
    wanted = emotion_faces()["joy"].aus
    assert joy["12L"] == pytest.approx(min(1.0, wanted[12, "BOTH"]), abs=0.02)
    less = face.set(aus={"12R": 0.2})
    assert less["12R"] == pytest.approx(0.2, abs=0.02)
    assert less["12L"] == pytest.approx(joy["12L"])
    again = face.set(aus={"12R": None})
    assert again["12R"] == pytest.approx(joy["12R"], abs=0.01)


def test_set_changes_and_releases_an_emotion_smoothly(face) -> None:
    face.set(emotion={"name": "happiness"})
    count = len(face.driver.clients[1].frames)
    fear = face.set(emotion={"name": "fear"})
    assert fear["12L"] == pytest.approx(0, abs=0.01)
    assert fear["20L"] > 0.5
    course = np.array([frame.values for frame in face.driver.clients[1].frames[count - 1 :]], float)
    assert np.abs(np.diff(course, axis=0)).max() < 0.5  # a frame; it takes 0.3 s
    rest = face.set(emotion=None)
    assert max(rest.values()) < 0.01


def test_set_releases_all_aus_or_all_faps_by_null(face) -> None:
    names = list(axis())
    face.set(aus={"12": 0.5, "4": 0.5}, faps={"open_jaw": 200})
    jaw, smile = names.index("open_jaw"), names.index("12L")
    face.set(1, aus=None)
    assert face.whole[smile] == 0
    assert face.whole[jaw] == 200
    face.set(1, aus={"12": 0.5}, faps=None)
    assert face.whole[jaw] == 0
    assert face.whole[smile] == 0.5


def test_set_without_an_emotion_leaves_it(face) -> None:
    before = face.set(emotion={"name": "anger", "intensity": 0.5})
    after = face.set(faps={"open_jaw": 50})
    assert after["4L"] == pytest.approx(before["4L"], abs=1e-3)
    assert before["4L"] == pytest.approx(0.5 * emotion_faces()["anger"].aus[4, "BOTH"], abs=0.02)


def test_set_accepts_valence_and_arousal(face) -> None:
    good = face.set(emotion={"valence": 0.9, "arousal": 0.3})
    assert good["12L"] > 0.4
    assert good["15L"] == pytest.approx(0, abs=0.01)
    rest = face.set(emotion={"valence": 0, "arousal": 0})
    assert max(rest.values()) < 0.01


def test_set_lies_below_expressions(face) -> None:
    face.set(emotion={"name": "sadness", "intensity": 0.3})
    face.driver.send(BLOCKS[1])
    shown = face.after(2)
    assert shown["4L"] == pytest.approx(0.5, abs=0.02)
    assert shown["15L"] > 0.1


def test_set_ignores_whole_turns_of_the_wheel(face) -> None:
    near = face.set(emotion={"angle": 20})
    assert max(near.values()) > 0.1
    assert face.set(emotion={"angle": -700}) == pytest.approx(near, abs=1e-3)


@pytest.mark.parametrize(
    ("emotion", "where"),
    [
        ({}, "set.emotion"),
        ({"name": "joy", "angle": 3}, "set.emotion"),
        ({"valence": 0.5}, "set.emotion"),
        ({"name": "joy", "activation": 3}, "set.emotion.activation"),
        ({"name": "jjoyy"}, "set.emotion.name"),
        ({"valence": 2, "arousal": 0}, "set.emotion.valence"),
        ({"angle": 7, "activation": 40}, "set.emotion.activation"),
    ],
)
def test_set_refuses_an_invalid_emotion_as_a_whole(face, emotion, where: str) -> None:
    face.driver.send({"type": "set", "emotion": emotion, "aus": {"12": 1}})
    (error,) = face.driver.clients[1].of("error")
    assert error["where"] == where
    assert max(face.after(1).values()) == 0


def test_stop_names_unknown_blocks_and_ends_the_others(drive) -> None:
    driver = drive()
    driver.send(NOD.format("a"))
    client = driver.send({"type": "stop", "blocks": ["x", "a", "y"]})
    (error,) = client.of("error")
    assert (error["code"], error["where"]) == ("invalid", "stop.blocks")
    assert error["message"] == "wanted blocks that play or wait, got 'x', 'y'; the others were stopped"
    driver.run(0.1)
    assert "a:end" in client.ids


def test_stop_of_unknown_blocks_alone_stops_nothing(drive) -> None:
    driver = drive()
    driver.send(NOD.format("a"))
    client = driver.send({"type": "stop", "blocks": ["x"]})
    (error,) = client.of("error")
    assert error["message"] == "wanted blocks that play or wait, got 'x'"
    assert "a:end" not in driver.run(0.1).ids


@pytest.mark.parametrize("blocks", [["b", "s"], None])
def test_stop_cancels_unread_documents(drive, blocks) -> None:
    driver = drive()
    for message in (
        NOD.format("a") + NOD.format("b") + NOD.format("c"),
        json.dumps({"type": "speech", "id": "s", "append": "One. "}),
        json.dumps({"type": "stop", "blocks": blocks}),
        NOD.format("d"),
    ):
        driver.session.receive(1, message, driver.opened)  # as if they came at once: one document is read
    driver.collect()
    client = driver.run(10.0)
    assert not client.of("error")
    ends = {f.id: f.status for f in client.feedback if getattr(f, "id", "").count(":") == 1}
    stopped = {"b", "s"} if blocks else {"b", "c", "s"}
    for name in "bcds":  # the first one had been read
        assert ends[f"{name}:end"] == ("REVOKED" if name in stopped else "DONE")
        assert (f"{name}:start" in ends) == (name not in stopped)


def test_stop_accepts_waiting_and_ended_blocks(drive) -> None:
    driver = drive(mute=True)
    driver.send(TALK.format("talk"))
    driver.send(NOD.format("nod"))
    client = driver.run(5.0)
    assert "nod:end" in client.ids
    driver.send({"type": "stop", "blocks": ["talk", "nod"]})
    driver.send({"type": "stop"})
    assert not client.of("error")
    assert "talk:end" in client.ids


def test_stop_accepts_an_open_speech(drive) -> None:
    driver = drive()
    driver.send({"type": "speech", "id": "turn", "append": "Hello. "})
    client = driver.send({"type": "stop", "blocks": ["turn"]})
    assert not client.of("error")


def test_stop_ends_playing_and_waiting_blocks() -> None:
    driver = Driver(mute=True)
    driver.send(NOD.format("nod"))
    driver.send(TALK.format("talk"))
    driver.run(0.1)
    client = driver.send({"type": "stop"})
    assert {"nod:end", "talk:end"} <= set(client.ids)
    driver.say(driver.spoken[0].id, spoken())
    assert client.ids == driver.run(10).ids


def test_stop_by_id_leaves_other_blocks() -> None:
    driver = Driver()
    driver.send(NOD.format("a"))
    driver.send(NOD.format("b"))
    client = driver.send({"type": "stop", "blocks": ["a"]})
    assert "a:end" in client.ids
    assert "b:end" not in client.ids


def test_character_message_sets_the_voice() -> None:
    driver = Driver(mute=True)
    driver.send({"type": "character", "id": "Ada", "voice": "silent"})
    driver.send(TALK.format("b").replace("<bml", '<bml characterId="Ada"'))
    assert driver.spoken[0].request.voice == "silent"


def test_scene_message_makes_unknown_targets_a_warning(driver) -> None:
    gaze = '<bml id="{}"><gaze id="g" target="{}" start="0" end="0.5"/></bml>'
    driver.send(gaze.format("a", "cup"))
    driver.run(1)
    driver.send({"type": "scene", "objects": {"cup": {"x": 0.3, "y": 0, "z": 1}}})
    driver.send(gaze.format("b", "cup"))
    driver.run(2)
    driver.send(gaze.format("c", "moon"))
    warnings = [f for f in driver.run(5).feedback if isinstance(f, WarningFeedback)]
    assert [(w.id, w.type) for w in warnings] == [("c:g", "NO_SUCH_TARGET")]
    assert "c:end" in driver.clients[1].ids


def test_set_holds_an_au_until_it_is_released(driver) -> None:
    names = driver.send({"type": "subscribe", "stream": "au", "fps": 25}).of("subscribed")[0]["names"]
    driver.send({"type": "set", "aus": {"12L": 0.8}})
    client = driver.run(1)
    left, right = names.index("12L"), names.index("12R")
    assert client.frames[-1].values[left] == pytest.approx(0.8, abs=0.05)
    assert client.frames[-1].values[right] < 0.1
    driver.send({"type": "set", "aus": {"12L": None}})
    assert driver.run(2).frames[-1].values[left] < 0.1


@pytest.mark.parametrize(
    ("message", "where"),
    [
        ({"type": "set", "aus": {"99": 0.5}}, "set.aus"),
        ({"type": "set", "faps": {"nose_hair": 5}}, "set.faps"),
        ({"type": "set", "faps": {"1": 5}}, "set.faps"),
        ({"type": "subscribe", "stream": "mesh", "encoding": "json"}, "subscribe.encoding"),
        ({"type": "character", "id": "Ada", "face": "nobody"}, "character.face"),
    ],
)
def test_handle_answers_an_invalid_field_with_its_path(driver, message, where) -> None:
    (error,) = driver.send(message).of("error")
    assert error["where"] == where


def test_handle_changes_nothing_with_an_error(drive, monkeypatch) -> None:
    monkeypatch.setattr(speech_streams, "MOST", 10)
    driver = drive()
    sound, words = np.ones(800, "<i2").tobytes(), [{"start": 0, "text": "One"}]
    for id, final in (("whole", True), ("part", False)):
        driver.session.receive(1, pack_clip(ClipPiece(id, 0, 8000, sound, final=final)), driver.opened)
    driver.send({"type": "speech", "clip": "whole", "words": words})
    refused = (
        {"type": "set", "character": "Eve", "aus": {"99": 1}},
        {"type": "set", "character": "Eve", "emotion": {"name": "joy"}, "faps": {"nose_hair": 5}},
        {"type": "subscribe", "stream": "video", "character": "Eve", "camera": "nowhere"},
        {"type": "subscribe", "stream": "video", "character": "Eve", "size": [16, 9999]},
        {"type": "character", "id": "Eve", "face": "nobody", "voice": "silent"},
        {"type": "character", "id": "Eve", "face": "default", "voice": "nope"},
        {"type": "speech", "id": "turn", "character": "Eve", "append": "far too long a text"},
        {"type": "speech", "id": "turn", "clip": "part", "words": words, "final": False},
        {"type": "speech", "id": "turn", "clip": "nothing"},
        {"type": "speech", "id": "turn", "clip": "whole", "words": words, "final": False},
        {"type": "speech", "id": "turn", "clip": "whole", "visemes": [{"start": 0, "text": "PPP"}]},
        {"type": "speech", "clip": "new", "visemes": [{"start": 0, "text": "PPP"}]},
        {"type": "stop", "blocks": ["nothing"]},
        pack_clip(ClipPiece("whole", 0, 7, sound)),
        pack_clip(ClipPiece("whole", 3, 8000, sound)),
        pack_clip(ClipPiece("part", 1, 16000, sound)),
        pack_clip(ClipPiece("part", 0, 8000, sound[1:])),
        pack_clip(ClipPiece("new", 1, 8000, sound)),
    )

    def state():
        session = driver.session
        saved = Checkpoint(
            session.player, session.faces, session.clips, session.submission, session.feedback_log
        )
        return saved.write(0.0, []), session.submission.speeches.open_ids, driver.clients[1].ids

    before = state()
    for number, message in enumerate(refused, 1):
        driver.session.receive(
            1, message if isinstance(message, bytes) else json.dumps(message), driver.opened
        )
        driver.collect()
        assert len(driver.clients[1].of("error")) == number, message
        assert state() == before, message


def test_anticipate_moves_behaviours_that_refer_to_the_point(driver) -> None:
    driver.send({"type": "anticipate", "id": "clock", "syncs": {"beat": 3.0}})
    driver.send('<bml id="b"><head id="n" lexeme="NOD" stroke="anticipators:clock:beat"/></bml>')
    driver.run(1)
    driver.send({"type": "anticipate", "id": "clock", "syncs": {"beat": 2.0}})
    driver.run(9)
    strokes = [f for f in driver.clients[1].feedback if getattr(f, "id", "") == "b:n:stroke"]
    assert [f.global_time for f in strokes] == [pytest.approx(2.0)]
    predicted = [
        b.syncs["stroke"].offset for f in driver.clients[1].feedback for b in getattr(f, "behaviours", ())
    ]
    assert predicted == [pytest.approx(3.0), pytest.approx(2.0)]


def test_character_message_refuses_an_unknown_voice(driver) -> None:
    client = driver.send({"type": "character", "id": "Z", "voice": "nope"})
    (error,) = client.of("error")
    assert (error["code"], error["where"]) == ("voice", "character.voice")
    assert "nope" in error["message"]


def heard(driver, id: str, seconds: float = 3.0, rate: int = 16_000):
    """A second of noise and then silence, as pieces of 0.1 s in time."""
    noise = 3000 * np.random.default_rng(0).standard_normal(rate)
    sound = np.concatenate([noise, np.zeros(round((seconds - 1) * rate))]).astype("<i2")
    for number, piece in enumerate(np.split(sound, round(10 * seconds))):
        driver.run(driver.now + 0.1)
        driver.send(pack_clip(ClipPiece(id, number, rate, piece.tobytes(), False)))


def test_heard_sound_is_answered_by_the_character_that_it_names(drive) -> None:
    downs = []
    for id in ("heard:Bo", "heard:"):
        driver = drive()
        driver.send({"type": "character", "id": "Ada"})
        driver.send({"type": "character", "id": "Bo"})
        heard(driver, id)
        times, nod = np.arange(2.0, driver.now, 0.04), axis()["54"].column
        turned = [driver.session.player.frames(times, character).values[:, nod] for character in (0, 1)]
        still = [Player().frames(times).values[:, nod] for character in (0, 1)]
        downs.append([float(np.abs(one - other).max()) for one, other in zip(turned, still, strict=True)])
        assert not driver.session.clips.ids
    (ada, bo), (first, _) = downs
    assert min(bo, first) > 0.05
    assert ada < bo


@pytest.mark.parametrize(
    ("rate", "sound", "text"), [(0, b"RIFF", "wanted 1000"), (16_000, b"abc", "wanted samples of two bytes")]
)
def test_heard_sound_that_is_no_pcm_is_an_error(drive, rate, sound, text) -> None:
    client = drive().send(pack_clip(ClipPiece("heard:Ada", 0, rate, sound, False)))
    (error,) = client.of("error")
    assert (error["code"], error["where"]) == ("clip", "clip:heard:Ada")
    assert text in error["message"]
