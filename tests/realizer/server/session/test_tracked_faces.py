"""Tests of characters that pictures of a client drive."""

from __future__ import annotations

import io
import json
from typing import Any

import pytest

from realizer.core.settings import Settings
from realizer.protocol.wire import HEADER
from realizer.server.runtime.engines import Engines
from realizer.server.session.effects import Look, Send
from realizer.server.session.session import Session
from tests.portraits import LITERT, faps_of, portrait

START = '{"type": "track", "fps": 20}'


def picture(number: int, content: bytes) -> bytes:
    return HEADER.pack(3, 1, 0, number, 0.0) + content


def smile() -> bytes:
    content = io.BytesIO()
    portrait("ada", faps_of("ada", AU12=0.9)).save(content, "jpeg")
    return content.getvalue()


class Client:
    """A session with one client, and engines that look at its pictures when they are told to."""

    def __init__(self) -> None:
        self.session = Session("s", Settings(idle=False), 0.0)
        self.session.connect(1, 0.0)
        self.engines = Engines()
        self.looks: list[Look] = []
        self.replies: list[dict[str, Any]] = []
        self._collect()

    def send(self, message: str | bytes, now: float) -> None:
        self.session.receive(1, message, now)
        self._collect()

    def look(self, now: float) -> None:
        order = self.looks.pop(0)
        self.session.on_sight(order.id, self.engines.look(order), now)
        self._collect()

    def _collect(self) -> None:
        for effect in self.session.take_effects():
            if isinstance(effect, Look):
                self.looks.append(effect)
            elif isinstance(effect, Send) and isinstance(effect.data, str) and effect.data.startswith("{"):
                self.replies.append(json.loads(effect.data))


@LITERT
@pytest.mark.gl("onboard")
def test_tracked_picture_drives_the_character() -> None:
    client = Client()
    client.send(START, 0.1)
    client.send(picture(7, smile()), 0.2)
    client.look(0.25)
    (tracked,) = [reply for reply in client.replies if reply["type"] == "tracked"]
    assert (tracked["frame"], tracked["face"]) == (7, True)
    assert tracked["aus"]["12L"] > 0.4
    assert len(tracked["head"]) == 3
    assert {"12L", "12R"} <= {*client.session.player.direct_names()}


@LITERT
def test_of_pictures_that_wait_only_the_newest_is_looked_at() -> None:
    client = Client()
    client.send(START, 0.1)
    for number in range(4):
        client.send(picture(number, b"none"), 0.2 + 0.05 * number)
    assert [look.picture for look in client.looks] == [b"none"]
    client.look(0.5)
    assert len(client.looks) == 1
    client.look(0.6)
    assert client.looks == []
    assert [reply["code"] for reply in client.replies] == ["unsupported"] * 2


def test_pictures_that_come_too_often_are_left_out() -> None:
    client = Client()
    client.send('{"type": "track", "fps": 5}', 0.1)
    client.send(picture(0, b"none"), 0.2)
    client.look(0.21)
    client.send(picture(1, b"none"), 0.25)
    assert client.looks == []
    client.send(picture(2, b"none"), 0.4)
    assert len(client.looks) == 1


def test_pictures_need_track_before_them() -> None:
    client = Client()
    client.send(picture(0, b"none"), 0.1)
    client.send(START, 0.2)
    client.send('{"type": "track", "fps": 0}', 0.3)
    client.send(picture(0, b"none"), 0.4)
    assert client.looks == []
    assert [reply["message"] for reply in client.replies] == ["wanted `track` before pictures"] * 2


def test_track_refuses_a_name_that_no_character_can_have() -> None:
    client = Client()
    client.send('{"type": "track", "fps": -1}', 0.1)
    assert client.replies[0]["code"] == "invalid"
    assert client.replies[0]["where"] == "track.fps"
