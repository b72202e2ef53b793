"""The values of frames, in binary and JSON."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.animation.arkit import ARKIT_NAMES, arkit
from realizer.animation.fap.conversion import FapMapping, standard
from realizer.playback.player import Player
from realizer.server.streams.frame_windows import TURNS, FrameTimeline
from tests.realizer.server.conftest import NOD

FAP = {"type": "subscribe", "stream": "fap"}
TURN = '<bml id="b"><head id="h" lexeme="SHAKE" start="0"/><faceLexeme id="f" lexeme="SMILE" end="2"/></bml>'


def subscribe(stream: str, **fields):
    return {"type": "subscribe", "stream": stream, **fields}


def test_arkit_rows_are_weights_then_head_and_eyes(driver) -> None:
    (reply,) = driver.send(subscribe("arkit", fps=25)).of("subscribed")
    assert reply["names"] == [*ARKIT_NAMES(), *TURNS]
    driver.send(TURN)
    frames = driver.run(1.5).frames
    assert {frame.stream for frame in frames} == {"arkit"}
    times = np.array([frame.time for frame in frames])
    shown = arkit(driver.session.player.frames(times))
    values = np.stack([frame.values for frame in frames])
    assert values[:, :52] == pytest.approx(shown.weights, abs=2e-3)
    assert values[:, 52:55] == pytest.approx(shown.head, abs=2e-3)
    assert values[:, 55:] == pytest.approx(shown.eyes.reshape(-1, 4), abs=2e-3)
    assert values[:, reply["names"].index("mouthSmileLeft")].max() > 0.3
    assert np.abs(values[:, reply["names"].index("headYaw")]).max() > 0.05


def test_arkit_rows_are_the_same_in_json(driver) -> None:
    driver.join(2)
    driver.send(subscribe("arkit", encoding="json"), 1)
    driver.send(subscribe("arkit"), 2)
    driver.send(TURN)
    driver.run(1.0)
    texts, frames = driver.clients[1].of("arkit"), driver.clients[2].frames
    assert len(texts) == len(frames) > 20
    for text, frame in zip(texts, frames, strict=True):
        assert text["values"] == pytest.approx(frame.values, abs=1e-4)


def test_timeline_finds_its_mapping_again_when_the_face_has_changed() -> None:
    found: list[FapMapping] = []

    def mapping() -> FapMapping:
        found.append(standard())
        return found[-1]

    timeline = FrameTimeline(Player(), 0, 25.0, lambda: pytest.fail("no face is wanted"), mapping)
    assert timeline.window(0, 0) is not timeline.window(1000, 1000)
    assert len(found) == 1
    timeline.invalidate()
    timeline.window(1000, 1000)
    assert len(found) == 2


def test_timeline_computes_short_windows_for_arkit() -> None:
    timeline = FrameTimeline(Player(), 0, 25.0, lambda: pytest.fail("no face is wanted"))
    long = timeline.window(0, 0)
    timeline.limit_windows(["fap", "mesh"])
    assert timeline.window(0, 0) is long
    timeline.limit_windows(["fap", "arkit"])
    short = timeline.window(0, 0)
    assert short.end - short.first < (long.end - long.first) / 4
    assert timeline.window(0, 99).end == 99 + short.end - short.first, "its length follows what is asked for"


def test_message_has_the_same_values_in_json_and_binary(driver) -> None:
    driver.join(2)
    driver.send({**FAP, "encoding": "json"}, 1)
    driver.send(FAP, 2)
    driver.send(NOD.format("b"))
    driver.run(1.0)
    texts, frames = driver.clients[1].of("fap"), driver.clients[2].frames
    assert [t["values"] for t in texts] == [f.values.tolist() for f in frames]
    assert [t["time"] for t in texts] == pytest.approx([f.time for f in frames])


def test_frames_show_the_behaviours_of_a_document(driver) -> None:
    names = driver.send({**FAP, "encoding": "json"}).of("subscribed")[0]["names"]
    pitch = names.index("head_pitch")
    driver.run(0.5)
    driver.send(NOD.format("b"))
    client = driver.run(2.0)
    rows = [t["values"][pitch] for t in client.of("fap")]
    assert max(map(abs, rows)) > 3 * max(map(abs, rows[:12])) + 100


def test_frames_show_idle_motion_without_a_document(driver) -> None:
    driver.send({"type": "subscribe", "stream": "au", "fps": 10})
    values = np.stack([f.values for f in driver.run(20).frames])
    assert values.shape[0] >= 200
    assert values.max() > 0.5, "an idle face blinks"


def test_frames_have_aus_after_or_before_the_rules(driver) -> None:
    def jaw_and_lips(asked: bool) -> list[float]:
        client = driver.send({"type": "subscribe", "stream": "au", "encoding": "json", "asked": asked})
        names = client.of("subscribed")[-1]["names"]
        values = driver.run(driver.now + 1.0).of("au")[-1]["values"]
        return [values[names.index("25")], values[names.index("26")]]

    driver.send({"type": "set", "aus": {"25": 1.0, "26": 1.0}})
    assert jaw_and_lips(asked=False) == [0.0, 1.0]
    assert jaw_and_lips(asked=True) == [1.0, 1.0]
