"""Tests of the models of replies."""

from __future__ import annotations

import json

import pytest

from realizer.protocol.messages.common import PICTURES
from realizer.protocol.messages.replies import (
    Capabilities,
    ErrorMessage,
    FaceChanged,
    FrameMessage,
    ScheduleMessage,
    StateMessage,
    Subscribed,
    Welcome,
)
from realizer.protocol.streams import STREAMS

NOD = '<bml id="b"><head id="n" lexeme="NOD"/></bml>'


def test_reply_leaves_out_empty_fields() -> None:
    text = ErrorMessage(code="invalid", message="y").text()
    assert text == '{"type":"error","code":"invalid","message":"y"}'


def test_welcome_has_version_capabilities_and_limits(driver) -> None:
    (message,) = driver.send({"type": "hello"}).of("welcome")
    welcome = Welcome.model_validate(message, extra="forbid")
    assert welcome.version == 1
    assert welcome.capabilities.streams == {name: list(row.encodings) for name, row in STREAMS.items()}
    assert welcome.capabilities.pictures == list(PICTURES)
    assert (welcome.limits.document, welcome.limits.fps) == (2**20, 240)
    assert isinstance(welcome.capabilities, Capabilities)


@pytest.mark.parametrize("stream", ["fap", "au", "arkit"])
def test_frame_message_describes_json_frames(driver, stream) -> None:
    driver.send({"type": "subscribe", "stream": stream, "encoding": "json"})
    client = driver.run(0.5)
    assert len(client.of(stream)) == 13
    for frame in client.of(stream):
        FrameMessage.model_validate(frame, extra="forbid")
        assert len(frame["values"]) == len(client.of("subscribed")[0]["names"])


def test_schedule_message_and_state_message_describe_the_wire(driver) -> None:
    driver.send({"type": "subscribe", "stream": "schedule"})
    driver.send(NOD)
    driver.run(0.2)
    driver.send({"type": "state"})
    client = driver.run(5)
    for message in client.of("schedule"):
        ScheduleMessage.model_validate(message, extra="forbid")
    (state,) = [StateMessage.model_validate(message, extra="forbid") for message in client.of("state")]
    assert [(b.id, b.status, b.behaviours) for b in state.blocks] == [("b", "IN_EXEC", ["n"])]
    assert json.loads(state.text()) == client.of("state")[0]


def test_subscribed_and_changed_have_index_0_by_default() -> None:
    assert Subscribed(stream="fap", encoding="json").index == 0
    message = {"stream": "mesh", "frame": 7, "face": "ada", "vertices": 3, "scale": 1.0, "offset": [0.0] * 3}
    assert FaceChanged.model_validate(message).index == 0
