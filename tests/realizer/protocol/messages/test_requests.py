"""Requests: defaults, and forms of scenes."""

from __future__ import annotations

import json

import pytest

from realizer.protocol.messages.parse import parse_control
from realizer.protocol.messages.requests import SceneMessage, Subscribe
from realizer.protocol.streams import STREAMS


def test_subscribe_has_the_defaults_of_the_protocol() -> None:
    message = parse_control('{"type":"subscribe","stream":"video"}')
    assert isinstance(message, Subscribe)
    assert (message.size, message.quality) == ((512, 512), 85)
    # The service's own.
    assert (message.camera, message.light, message.background, message.fps) == (None,) * 4
    assert STREAMS["fap"].encodings[0] == "binary"


@pytest.mark.parametrize(
    "objects",
    [
        {"cup": {"x": 0.1, "y": 0, "z": 0.5}},
        {"cup": [0.1, 0, 0.5]},
        [{"id": "cup", "x": 0.1, "y": 0, "z": 0.5}],
    ],
)
def test_scene_message_accepts_three_forms(objects: object) -> None:
    message = parse_control(json.dumps({"type": "scene", "objects": objects}))
    assert isinstance(message, SceneMessage)
    assert message.objects is not None
    assert (message.objects["cup"].x, message.objects["cup"].z) == (0.1, 0.5)
