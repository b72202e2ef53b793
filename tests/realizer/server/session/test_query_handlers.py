"""Tests of the answers to hello, state and ping."""

from __future__ import annotations

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
