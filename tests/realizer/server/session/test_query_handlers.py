"""Tests of the answers to hello, save, state and ping."""

from __future__ import annotations

import json

from realizer.protocol.messages.common import MAX_CONTROL
from realizer.server.runtime.edit_folder import save
from tests.realizer.server.conftest import NOD, TALK, Driver


def test_hello_sends_missed_feedback(driver) -> None:
    driver.send(NOD.format("b"))
    driver.run(10)
    viewer = driver.join(2)
    assert not viewer.feedback
    driver.send({"type": "hello", "session": "test", "seen": 1}, 2)
    assert viewer.of("welcome")[0]["session"] == "test"
    assert [f.seq for f in viewer.feedback] == list(range(2, 14))


def test_hello_refuses_another_version(driver) -> None:
    (error,) = driver.send({"type": "hello", "version": 7}).of("error")
    assert (error["where"], "got 7" in error["message"]) == ("hello.version", True)


def test_ping_returns_the_time_of_the_session(driver) -> None:
    driver.run(2.5)
    assert driver.send({"type": "ping", "id": 9}).of("pong") == [{"type": "pong", "id": 9, "time": 2.5}]


def test_state_lists_playing_and_waiting_blocks() -> None:
    driver = Driver(mute=True)
    driver.send(NOD.format("nod"))
    driver.send(TALK.format("talk"))
    driver.run(0.2)
    (state,) = driver.send({"type": "state"}).of("state")
    assert {b["id"]: b["status"] for b in state["blocks"]} == {"nod": "IN_EXEC", "talk": "IN_PREP"}
    assert state["connections"] == 1


def test_state_says_what_a_block_waits_for() -> None:
    driver = Driver(mute=True)
    driver.send(NOD.format("nod"))
    driver.send('<bml id="next" composition="APPEND"><wait id="w" duration="1"/></bml>')
    driver.send(TALK.format("talk"))
    driver.send('<bml id="tied"><wait id="w" start="talk:bml:end" duration="1"/></bml>')
    (state,) = driver.send({"type": "state"}).of("state")
    waits = {b["id"]: b.get("waits_for") for b in state["blocks"]}
    assert waits == {"nod": None, "next": ["nod"], "talk": ["talk:s"], "tied": ["talk"]}


def test_state_lists_the_layers_of_the_face(drive) -> None:
    driver = drive(idle=False)
    mood = '<mood xmlns="urn:bml-realizer:1" id="s" name="joy" end="1"/>'
    driver.send(f'<bml id="m">{mood}</bml>')
    driver.send('<bml id="b"><faceFacs id="f" au="4" amount="0.5" attackPeak="0.2" relax="8" end="9"/></bml>')
    gaze = '<gaze id="g" target="cup" offsetAngle="20" offsetDirection="LEFT" start="0" ready="0.5" end="9"/>'
    driver.send(f'<bml id="g">{gaze}</bml>')
    driver.send({"type": "set", "aus": {"2L": 0.25}, "faps": {"open_jaw": 120}})
    driver.run(3.0)
    state = driver.send({"type": "state"}).of("state")[-1]
    (face,) = state["characters"]
    layers = face["layers"]
    assert layers["expression"] == {"aus": {"4L": 0.5, "4R": 0.5}, "faps": {}}
    assert layers["direct"] == {"aus": {"2L": 0.25}, "faps": {"open_jaw": 120}}
    assert layers["base"]["aus"]["12L"] == layers["base"]["aus"]["12R"] > 0.1
    assert layers["gaze"]["aus"]
    assert "idle" not in layers
    assert face["aus"]["4L"] > 0
    assert face["face"] == driver.session.faces.name(0)
    assert {(b["id"], *b["behaviours"]) for b in state["blocks"]} >= {("b", "f"), ("g", "g")}


def test_replies_round_times_to_microseconds(drive) -> None:
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


SAVE = {"type": "save", "kind": "expression", "name": "smirk", "content": "aus = { 12L = 0.6 }"}


def test_save_is_refused_where_the_service_or_the_token_does_not_allow_it(drive, tmp_path) -> None:
    for folder, may_edit, says in ((None, True, "--edit DIR"), (tmp_path, False, "a token for all sessions")):
        driver = drive(edit=folder)
        driver.session.connect(2, driver.opened, may_edit=may_edit)
        client = driver.send(SAVE, 2)
        (error,) = client.of("error")
        assert (error["code"], says in error["message"]) == ("edit", True)
        (welcome,) = driver.send({"type": "hello"}, 2).of("welcome")
        assert welcome["capabilities"]["edit"] is False
    assert list(tmp_path.iterdir()) == []


def test_save_becomes_an_effect_whose_answer_the_client_gets(drive, tmp_path) -> None:
    driver = drive(edit=tmp_path)
    driver.session.connect(2, driver.opened, may_edit=True)
    driver.session.receive(2, json.dumps(SAVE), driver.opened)
    (effect,) = driver.session.take_effects()
    assert (effect.id, effect.message.name, effect.folder) == (2, "smirk", tmp_path)
    driver.session.connections.reply(2, save(effect))
    driver.collect()
    (saved,) = driver.clients[2].of("saved")
    assert saved["file"] == "expressions/smirk.toml"
    (welcome,) = driver.send({"type": "hello"}, 2).of("welcome")
    assert welcome["capabilities"]["edit"]
    assert "smirk" in welcome["capabilities"]["expressions"]


def test_save_may_be_longer_than_other_messages_where_it_is_allowed(drive, tmp_path) -> None:
    long = SAVE | {"content": "# " + MAX_CONTROL * "x"}
    driver = drive(edit=tmp_path)
    driver.session.connect(2, driver.opened, may_edit=True)
    assert driver.send(long).of("error")[0]["code"] == "too-large"
    driver.session.receive(2, json.dumps(long), driver.opened)
    (effect,) = driver.session.take_effects()
    assert effect.message.content == long["content"]
    driver.session.receive(2, json.dumps({"type": "ping", "id": MAX_CONTROL * "x"}), driver.opened)
    driver.collect()
    assert driver.clients[2].of("error")[0]["code"] == "too-large"


def test_welcome_has_capabilities_and_limits(driver) -> None:
    (welcome,) = driver.send({"type": "hello"}).of("welcome")
    assert welcome["session"] == "test"
    assert "mesh" in welcome["capabilities"]["streams"]
    assert welcome["limits"]["document"] == 2**20


def test_welcome_has_the_limits_of_the_settings(drive) -> None:
    limits = {"max_elements": 7, "max_duration": 8, "max_speech": 9, "max_rate": 10, "max_pixels": 1000}
    (welcome,) = drive(**limits).send({"type": "hello"}).of("welcome")
    announced = {f"max_{name}": value for name, value in welcome["limits"].items()}
    assert limits.items() <= announced.items()
