"""Which reply is about which request."""

from __future__ import annotations

import json
from typing import Any

from realizer.client.control_requests import ControlRequests
from realizer.protocol.messages.parse import parse_control
from tests.rows import each_row

PONG = {"type": "pong", "time": 1}


def refused(type: str, **fields: Any) -> dict[str, Any]:
    """Return the error of the service about a message."""
    return json.loads(parse_control(json.dumps({"type": type, **fields})).text())


def test_requests_without_an_answer_end_with_the_pong_behind_them() -> None:
    requests = ControlRequests()
    first, second = requests.add("stop", {}), requests.add("stop", {})
    assert [json.loads(text) for text in first.texts] == [{"type": "stop"}, {"type": "ping", "id": "ask-0"}]
    assert requests.on_reply(PONG | {"id": "ask-0"}) is first
    assert requests.on_reply(PONG | {"id": "ask-0"}) is None
    assert requests.on_reply(refused("stop", blocks=3)) is second
    assert not requests.waiting


@each_row(
    "reply, number",
    [
        (refused("stopp"), 0),
        (PONG | {"id": "ask-0"}, 0),
        (refused("ping", x=1), 1),
        (PONG, 1),
        (PONG | {"id": 3}, 2),
        (refused("subscribe", stream="nosuch"), 3),
        ({"type": "subscribed", "stream": "au", "index": 0}, 3),
        ({"type": "subscribed", "stream": "fap", "index": 0}, None),
        ({"type": "subscribed", "stream": "au", "character": "B", "index": 1}, None),
        ({"type": "error", "code": "invalid", "message": "no", "where": "state.x"}, 4),
        ({"type": "error", "code": "bad-json", "message": "no"}, 0),
        ({"type": "error", "code": "invalid", "message": "no", "where": "speech.append", "id": "s"}, None),
        ({"type": "state"}, 4),
        ({"type": "changed", "stream": "au"}, None),
    ],
)
def test_a_reply_ends_its_own_request(reply: dict[str, Any], number: int | None) -> None:
    requests = ControlRequests()
    sent = [
        requests.add("stopp", {}),
        requests.add("ping", {}),
        requests.add("ping", {"id": 3}),
        requests.add("subscribe", {"stream": "au"}),
        requests.add("state", {}),
    ]
    assert requests.on_reply(reply) is (None if number is None else sent[number])


def test_requests_whose_answer_is_lost_are_ended_or_sent_again() -> None:
    requests = ControlRequests()
    stop, state, late = requests.add("stop", {}), requests.add("state", {}), requests.add("set", {})
    stop.is_sent = state.is_sent = True
    requests.on_lost()
    assert stop.reply is not None
    assert stop.reply["code"] == "connection"
    assert requests.waiting == [state, late]
