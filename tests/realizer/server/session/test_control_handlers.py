"""Mixing controls: an emotion below, action units refining it, FAPs on top, in whatever order they come."""

from __future__ import annotations

import json
from itertools import permutations

import numpy as np
import pytest

from realizer.animation.axis import axis
from realizer.tables.emotions import emotion_faces

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
    """A session whose AUs are watched."""

    def __init__(self, drive) -> None:
        self.driver = drive(idle=False)
        told = self.driver.send({"type": "subscribe", "stream": "au", "fps": 25})
        self.names = told.of("subscribed")[0]["names"]

    def set(self, seconds: float = 0.5, **asked) -> dict[str, float]:
        """What shows that long after something was set."""
        self.driver.send({"type": "set", **asked})
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
def test_the_order_of_what_is_set_does_not_matter(drive, pause: float) -> None:
    found = []
    for messages in permutations(SETS):
        face = Face(drive)
        for message in messages:
            face.set(pause, **message)
        face.after(1)
        found.append(face.whole)
    together = Face(drive)
    together.set(1, **{key: value for message in SETS for key, value in message.items()})
    found.append(together.whole)
    assert np.abs(found[0]).sum() > 1
    for other in found[1:]:
        assert other == pytest.approx(found[0], abs=1e-5)


def test_the_order_of_what_is_set_and_of_documents_does_not_matter(drive) -> None:
    found = []
    for chosen in permutations((*BLOCKS, SETS[0], SETS[1])):
        face = Face(drive)
        for one in chosen:
            if isinstance(one, str):
                face.driver.send(one)
            else:
                face.set(0, **one)
        face.after(3)
        found.append(face.whole)
    for other in found[1:]:
        assert other == pytest.approx(found[0], abs=1e-5)


def test_an_action_unit_refines_the_emotion_and_lets_it_show_again(face) -> None:
    joy = face.set(emotion={"name": "happiness"})
    wanted = emotion_faces()["joy"].aus
    assert joy["12L"] == pytest.approx(wanted[12, "BOTH"], abs=0.02)
    less = face.set(aus={"12R": 0.2})
    assert less["12R"] == pytest.approx(0.2, abs=0.02)
    assert less["12L"] == pytest.approx(joy["12L"])
    again = face.set(aus={"12R": None})
    assert again["12R"] == pytest.approx(joy["12R"], abs=0.01)


def test_another_emotion_takes_its_place_without_a_jump_and_null_lets_go(face) -> None:
    face.set(emotion={"name": "happiness"})
    count = len(face.driver.clients[1].frames)
    fear = face.set(emotion={"name": "fear"})
    assert fear["12L"] == pytest.approx(0, abs=0.01)
    assert fear["20L"] > 0.5
    course = np.array([frame.values for frame in face.driver.clients[1].frames[count - 1 :]], float)
    assert np.abs(np.diff(course, axis=0)).max() < 0.5  # a frame; it takes 0.3 s
    rest = face.set(emotion=None)
    assert max(rest.values()) < 0.01


def test_null_lets_go_of_all_action_units_or_of_all_faps_and_of_nothing_else(face) -> None:
    names = list(axis())
    face.set(aus={"12": 0.5, "4": 0.5}, faps={"open_jaw": 200})
    jaw, smile = names.index("open_jaw"), names.index("12L")
    face.set(1, aus=None)
    assert face.whole[smile] == 0
    assert face.whole[jaw] == 200
    face.set(1, aus={"12": 0.5}, faps=None)
    assert face.whole[jaw] == 0
    assert face.whole[smile] == 0.5


def test_what_is_said_of_other_things_leaves_the_emotion(face) -> None:
    before = face.set(emotion={"name": "anger", "intensity": 0.5})
    after = face.set(faps={"open_jaw": 50})
    assert after["4L"] == pytest.approx(before["4L"], abs=1e-3)
    assert before["4L"] == pytest.approx(0.5 * emotion_faces()["anger"].aus[4, "BOTH"], abs=0.02)


def test_an_emotion_may_be_a_place_of_valence_and_arousal(face) -> None:
    good = face.set(emotion={"valence": 0.9, "arousal": 0.3})
    assert good["12L"] > 0.4
    assert good["15L"] == pytest.approx(0, abs=0.01)
    rest = face.set(emotion={"valence": 0, "arousal": 0})
    assert max(rest.values()) < 0.01


def test_expressions_play_over_what_is_set(face) -> None:
    face.set(emotion={"name": "sadness", "intensity": 0.3})
    face.driver.send(BLOCKS[1])
    shown = face.after(2)
    assert shown["4L"] == pytest.approx(0.5, abs=0.02)
    assert shown["15L"] > 0.1


def test_turns_of_the_wheel_do_not_count(face) -> None:
    near = face.set(emotion={"angle": 20})
    assert max(near.values()) > 0.1
    assert face.set(emotion={"angle": -700}) == pytest.approx(near, abs=1e-3)


@pytest.mark.parametrize(
    ("asked", "where"),
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
def test_an_emotion_that_is_none_is_refused_and_nothing_is_set(face, asked, where: str) -> None:
    face.driver.send({"type": "set", "emotion": asked, "aus": {"12": 1}})
    (error,) = face.driver.clients[1].of("error")
    assert error["where"] == where
    assert max(face.after(1).values()) == 0


@pytest.mark.parametrize("name", ["nobody", "../ada", "", "/etc"])
def test_an_unknown_face_is_told_by_the_known_ones_and_no_folders(face, name: str) -> None:
    face.driver.send({"type": "character", "face": name})
    (error,) = face.driver.clients[1].of("error")
    assert (error["code"], error["where"]) == ("face", "character.face")
    assert error["message"] == f"wanted one of ada, ben, ida, got {name!r}"


def test_blocks_to_stop_that_nobody_knows_are_named_and_the_others_end(drive) -> None:
    driver = drive()
    driver.send(NOD.format("a"))
    client = driver.send({"type": "stop", "blocks": ["x", "a", "y"]})
    (error,) = client.of("error")
    assert (error["code"], error["where"]) == ("invalid", "stop.blocks")
    assert error["message"] == "wanted blocks that play or wait, got 'x', 'y'"
    driver.run(0.1)
    assert "a:end" in client.ids


@pytest.mark.parametrize("blocks", [["b", "s"], None])
def test_what_was_sent_and_is_not_read_does_not_play_once_it_is_stopped(drive, blocks) -> None:
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


def test_a_block_that_waits_for_its_voice_is_known_and_so_is_one_that_has_just_ended(drive) -> None:
    driver = drive(mute=True)
    driver.send(TALK.format("talk"))
    driver.send(NOD.format("nod"))
    client = driver.run(5.0)
    assert "nod:end" in client.ids
    driver.send({"type": "stop", "blocks": ["talk", "nod"]})
    driver.send({"type": "stop"})
    assert not client.of("error")
    assert "talk:end" in client.ids


def test_a_speech_that_is_open_is_known_from_its_first_message_on(drive) -> None:
    driver = drive()
    driver.send({"type": "speech", "id": "turn", "append": "Hello. "})
    client = driver.send({"type": "stop", "blocks": ["turn"]})
    assert not client.of("error")


def test_times_are_told_to_the_microsecond(drive) -> None:
    driver = drive()
    driver.run(1 / 3)
    driver.send('<bml id="b"><wait id="w" duration="0.12345678"/></bml>')
    client = driver.send({"type": "ping", "id": 1})
    driver.send({"type": "state"})
    driver.send({"type": "hello"})
    (pong,), (state,), (welcome,) = (client.of(kind) for kind in ("pong", "state", "welcome"))
    assert pong["time"] == state["time"] == welcome["time"] == 0.333333
    (block,) = state["blocks"]
    assert (block["start"], block["end"]) == (0.333333, 0.45679)
