"""The router of messages: answers, errors, frames by stream."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from bml_schema.feedback import BlockProgress, WarningFeedback
from realizer.client.errors import ClientError
from realizer.client.message_router import (
    MAX_FRAMES,
    MEMORY,
    Playout,
    Router,
)
from realizer.protocol.streams import JSON_STREAMS, KINDS
from realizer.protocol.wire import WireError, WireFrame, pack


@pytest.fixture
def mail() -> Router:
    return Router()


def error(where: str | None, code: str = "invalid") -> str:
    said = {"type": "error", "code": code, "message": "wanted another"}
    return json.dumps(said if where is None else {**said, "where": where})


def test_router_matches_an_answer_to_its_request(mail) -> None:
    request = mail.requests.add("ping", {})
    mail.receive('{"type":"state"}')
    mail.receive(error("set.aus"))
    mail.receive(error("video", "render"))
    assert request.reply is None
    mail.receive('{"type":"pong","time":1}')
    assert request.reply == {"type": "pong", "time": 1}
    assert [one["where"] for one in mail.errors] == ["set.aus", "video"]


def test_router_logs_what_was_dropped(mail, caplog) -> None:
    mail.receive(WarningFeedback(id="b:n", type="CANNOT_CREATE_BEHAVIOR", text="no such lexeme").to_xml())
    (record,) = caplog.records
    assert (record.name, record.levelname) == ("realizer.client", "WARNING")
    assert record.getMessage() == "b:n: CANNOT_CREATE_BEHAVIOR: no such lexeme"


def test_router_logs_an_error_without_a_request_once(mail, caplog) -> None:
    mail.requests.add("ping", {})
    mail.receive(error("ping.id"))
    assert not caplog.records, "the request raises it"
    mail.receive(error("type"))
    (record,) = caplog.records
    assert (record.name, record.levelname) == ("realizer.client", "WARNING")
    assert record.getMessage() == "type: wanted another"


def test_router_logs_the_same_error_once(mail, caplog) -> None:
    for where in ("speech.id", "speech.id", "set.aus"):
        mail.receive(error(where))
    assert [record.getMessage().partition(":")[0] for record in caplog.records] == ["speech.id", "set.aus"]
    assert len(mail.errors) == 3


@pytest.mark.parametrize("stream", [row.name for row in KINDS.values()])
def test_router_keeps_the_newest_frames_of_each_stream(mail, stream) -> None:
    for k in range(MAX_FRAMES + 5):
        mail.receive(pack(stream, k, k / 25, np.zeros(2, "<f4").tobytes()))
    ((_, frames),) = mail.frames.items()
    assert [frame.frame for frame in frames] == list(range(5, MAX_FRAMES + 5))


def test_router_adds_the_description_of_its_stream_to_a_frame(mail) -> None:
    mesh = {"stream": "mesh", "index": 1, "scale": 2.0, "offset": [0.0, 0.0, 1.0]}
    frame = pack("mesh", 0, 0.0, np.array([1, 2, 3], "<i2").tobytes(), character=1)
    request = mail.requests.add("subscribe", {"stream": "mesh"})
    mail.receive(json.dumps({"type": "subscribed", "fps": 25.0, **mesh}))
    mail.receive(frame)
    mail.receive(json.dumps({"type": "changed", **mesh, "scale": 1.0}))
    mail.receive(frame)
    mail.receive(frame[:2] + b"\0" + frame[3:])  # of another character
    first, second, other = mail.queue_of("mesh")
    assert first.vertices.tolist() == [[2.0, 4.0, 7.0]]
    assert second.vertices.tolist() == [[1.0, 2.0, 4.0]]
    assert second.stream_info["fps"] == 25.0
    assert first == second
    with pytest.raises(WireError, match="wanted a mesh whose scale is known, got none of a subscription"):
        _ = other.vertices
    assert request.reply["scale"] == 2.0
    assert not mail.errors


@pytest.mark.parametrize("stream", JSON_STREAMS)
def test_router_treats_messages_of_every_json_stream_as_frames(mail, stream) -> None:
    mail.receive(json.dumps({"type": stream, "time": 0}))
    assert {stream: len(kept) for stream, kept in mail.frames.items()} == {stream: 1}


def test_router_treats_an_answer_with_values_as_an_answer(mail) -> None:
    request = mail.requests.add("state", {})
    mail.receive('{"type":"state","values":[0.5]}')
    assert request.reply["values"] == [0.5]
    assert not mail.frames


FPS = 25.0
AHEAD = 0.2
INFO = {"names": ["a"], "fps": FPS, "ahead": AHEAD}
ZERO = 50.0  # the local clock when the session clock was 0


def message(first: int, *values: int, flush: bool = False) -> WireFrame:
    payload = np.array(values, "<i4").tobytes()
    return WireFrame(1, first, first / FPS, payload, flush=flush, stream_info=INFO)


def taken(playout: Playout, now: float) -> list[tuple[int, int]]:
    frames = iter(lambda: playout.take(now), None)
    return [(frame.frame, int(frame.values[0])) for frame in frames]


def test_take_returns_each_frame_at_its_time() -> None:
    playout = Playout(AHEAD)
    assert playout.next_due == math.inf
    playout.receive(message(3, 30, 40, 50), ZERO)  # sent at 0: the last is due at 0.2
    assert playout.next_due == pytest.approx(ZERO + 3 / FPS)
    assert not taken(playout, ZERO + 0.119)
    assert taken(playout, ZERO + 0.121) == [(3, 30)]
    assert taken(playout, ZERO + 0.21) == [(4, 40), (5, 50)]
    assert taken(playout, ZERO + 9) == []


def test_receive_drops_what_is_taken_back() -> None:
    playout = Playout(AHEAD)
    playout.receive(message(3, 30, 40, 50), ZERO)
    playout.receive(message(4, 41, 51, 61, flush=True), ZERO + 0.05)
    assert [taken(playout, ZERO + k / FPS + 0.01) for k in range(3, 7)] == [
        [(3, 30)], [(4, 41)], [(5, 51)], [(6, 61)]
    ]  # fmt: skip


def test_receive_drops_frames_that_were_taken() -> None:
    playout = Playout(AHEAD)
    playout.receive(message(3, 30, 40, 50), ZERO)
    assert taken(playout, ZERO + 4.1 / FPS) == [(3, 30), (4, 40)]
    playout.receive(message(4, 41, 51, flush=True), ZERO + 4.2 / FPS)
    assert taken(playout, ZERO + 1) == [(5, 51)]


def test_next_due_follows_the_message_with_the_least_delay() -> None:
    playout = Playout(AHEAD)
    playout.receive(message(3, 30, 40, 50), ZERO + 0.04)
    assert playout.next_due == pytest.approx(ZERO + 0.04 + 3 / FPS)
    playout.receive(message(6, 60, 70, 80), ZERO + 3 / FPS)
    assert playout.next_due == pytest.approx(ZERO + 3 / FPS)
    playout.receive(message(9, 90), ZERO + 0.3)  # late
    assert playout.next_due == pytest.approx(ZERO + 3 / FPS)


def test_next_due_forgets_delays_of_long_ago() -> None:
    playout = Playout(AHEAD)
    drift, number = 0.01, 0
    playout.receive(message(number, 50), ZERO - AHEAD)
    while number < (1 + MEMORY) * FPS:
        number += 10
        playout.receive(message(number, 1), ZERO + drift + number / FPS - AHEAD)
    assert playout.next_due == pytest.approx(ZERO + drift)


def test_playout_without_ahead_passes_frames_on() -> None:
    playout = Playout(0.0)
    for number, late in ((3, 0.01), (4, 0.0), (5, 0.02)):
        frame = WireFrame(1, number, number / FPS, np.array([number], "<i4").tobytes())
        playout.receive(frame, ZERO + number / FPS + late)
        assert taken(playout, ZERO + number / FPS + late) == [(number, number)]


def test_router_returns_feedback_up_to_a_gap_and_after_it(mail) -> None:
    mail.receive('{"type":"welcome","version":1,"session":"s","time":0,"seq":4}')
    assert mail.seen == 4
    waiter = mail.on_sent("<bml id='b'/>")
    assert waiter is not None
    mail.receive(end_of("a", 5))
    mail.on_gap([waiter])
    mail.receive(end_of("c", 1))
    assert mail.seen == 1
    assert mail.take_feedback().id == "a:end"
    with pytest.raises(ClientError, match="the session has begun anew") as caught:
        mail.take_feedback()
    assert caught.value.code == "gap"
    assert mail.take_feedback().id == "c:end"
    with pytest.raises(ClientError, match="the session has begun anew"):
        waiter.end()


def end_of(block: str, seq: int) -> str:
    return BlockProgress(id=f"{block}:end", global_time=1.0).to_xml(seq=seq)


def test_restart_takes_earlier_frames() -> None:
    playout = Playout(AHEAD)
    playout.receive(message(100, 1, 2), 10.0)
    assert taken(playout, 20.0)
    playout.restart()
    playout.receive(message(0, 3), 30.0)
    assert taken(playout, 40.0) == [(0, 3)]


def test_playout_leaves_out_frames_that_are_long_past() -> None:
    playout = Playout(AHEAD)
    playout.receive(message(0, *range(50)), ZERO + 49 / FPS - AHEAD)
    first = playout.take(ZERO + 1.0)
    assert first is not None
    assert (first.frame, playout.left_out) == (25, 25)
    assert [frame for frame, _ in taken(playout, ZERO + 1.08)] == [26, 27]
    assert playout.left_out == 25


def test_playout_knows_the_clock_after_a_pause_of_the_program() -> None:
    playout = Playout(AHEAD)
    playout.receive(message(0, 0, 1), ZERO + 1 / FPS - AHEAD)
    taken(playout, ZERO + 0.05)
    now = ZERO + 10.0  # everything that came in the meantime is read now
    for number in range(2, 255):
        playout.receive(message(number, number), now)
    frame = playout.take(now)
    assert frame is not None
    assert frame.frame == 250
    assert playout.left_out == 248
