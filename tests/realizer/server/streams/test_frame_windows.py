"""What frames hold: ARKit's weights with head and eyes; pictures in every form; the layers behind a face."""

from __future__ import annotations

import gc

import numpy as np
import pytest

from realizer.animation.arkit import ARKIT_NAMES, arkit
from realizer.animation.fap.au_fap_mapping import FapMapping, standard
from realizer.playback.player import Player
from realizer.protocol.streams import STREAMS
from realizer.server.streams.audio_stream import AudioStream
from realizer.server.streams.frame_windows import TURNS, FrameTimeline

TURN = '<bml id="b"><head id="h" lexeme="SHAKE" start="0"/><faceLexeme id="f" lexeme="SMILE" end="2"/></bml>'


def subscribe(stream: str, **fields):
    return {"type": "subscribe", "stream": stream, **fields}


def test_arkit_frames_are_the_weights_of_the_file_then_head_and_eyes(driver) -> None:
    (told,) = driver.send(subscribe("arkit", fps=25)).of("subscribed")
    assert told["names"] == [*ARKIT_NAMES(), *TURNS]
    driver.send(TURN)
    frames = driver.run(1.5).frames
    assert {frame.stream for frame in frames} == {"arkit"}
    times = np.array([frame.time for frame in frames])
    shown = arkit(driver.session.player.frames(times))
    values = np.stack([frame.values for frame in frames])
    assert values[:, :52] == pytest.approx(shown.weights, abs=2e-3)
    assert values[:, 52:55] == pytest.approx(shown.head, abs=2e-3)
    assert values[:, 55:] == pytest.approx(shown.eyes.reshape(-1, 4), abs=2e-3)
    assert values[:, told["names"].index("mouthSmileLeft")].max() > 0.3
    assert np.abs(values[:, told["names"].index("headYaw")]).max() > 0.05


def test_arkit_as_json_says_the_same(driver) -> None:
    driver.join(2)
    driver.send(subscribe("arkit", encoding="json"), 1)
    driver.send(subscribe("arkit"), 2)
    driver.send(TURN)
    driver.run(1.0)
    texts, frames = driver.clients[1].of("arkit"), driver.clients[2].frames
    assert len(texts) == len(frames) > 20
    for text, frame in zip(texts, frames, strict=True):
        assert text["values"] == pytest.approx(frame.values, abs=1e-4)


def test_all_streams_run_side_by_side_on_one_connection(driver) -> None:
    for stream, rate in (("fap", 25), ("au", 50), ("arkit", 10), ("mesh", 5)):
        driver.send(subscribe(stream, fps=rate))
    counts = dict.fromkeys(STREAMS, 0)
    for frame in driver.run(1.0).frames:
        counts[frame.stream] += 1
    rates = {"fap": 25, "au": 50, "arkit": 10, "mesh": 5}
    assert {stream: count for stream, count in counts.items() if count} == {
        k: n + 1 for k, n in rates.items()
    }


def test_rates_that_nobody_gets_any_more_are_forgotten(driver) -> None:
    def alive() -> int:
        gc.collect()
        return sum(isinstance(o, FrameTimeline | AudioStream) for o in gc.get_objects())

    before = alive()
    for k in range(20):
        driver.send(subscribe("fap", fps=10 + k / 7))
        driver.send(subscribe("audio", rate=8000 + 50 * k))
        driver.run(driver.now + 0.05)
    assert alive() == before + 2


@pytest.mark.parametrize("form", ["jpeg", "png", "webp"])
def test_a_picture_is_asked_for_in_its_form(driver, form) -> None:
    client = driver.send(subscribe("video", size=[64, 64], format=form, quality=70))
    assert client.of("subscribed")[0]["media_type"] == f"image/{form}"
    driver.run(0.05)
    assert [(draw.options.form, draw.options.quality) for draw in driver.draws] == [(form, 70)]


def test_what_is_transparent_is_no_jpeg(driver) -> None:
    client = driver.send(subscribe("video", background="transparent"))
    assert client.of("error")[0]["where"] == "subscribe.background"
    driver.send(subscribe("video", background="transparent", format="png"))
    driver.run(0.05)
    assert [draw.options.background for draw in driver.draws] == ["transparent"]


def test_a_camera_that_is_not_there_is_refused_with_those_that_are(driver) -> None:
    (error,) = driver.send(subscribe("video", camera="moon")).of("error")
    assert error["where"] == "subscribe.camera"
    assert "front, three-quarter" in error["message"]


def test_the_state_tells_each_layer_s_part_of_the_face(drive) -> None:
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
