"""Tests of the routes of sessions."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from realizer.client import ClientError, connect
from tests.realizer.asgi.served import LIMIT, NOD


def events(http: Any, session: str, last: str, **headers: str) -> list[dict[str, str]]:
    """Return the events of a session up to one whose data contain a text."""
    found: list[dict[str, str]] = []
    with http.stream("GET", f"/sessions/{session}/feedback", headers=headers) as stream:
        assert stream.headers["content-type"].startswith("text/event-stream")
        event: dict[str, str] = {}
        for line in stream.iter_lines():
            name, _, value = line.partition(": ")
            if line:
                event[name] = value
                continue
            found.append(event)
            event = {}
            if last in found[-1].get("data", ""):
                return found
    return found


def test_feedback_comes_as_events_that_can_be_resumed(http: Any) -> None:
    assert http.post("/sessions/one/bml", content=NOD.format("a")).status_code == 202
    found = events(http, "one", 'id="a:end"', **{"last-event-id": "0"})
    feedback = [event for event in found if event["event"] == "feedback"]
    assert [int(event["id"]) for event in feedback] == list(range(1, len(feedback) + 1))
    assert http.post("/sessions/one/bml", content=NOD.format("b")).json() == {"session": "one"}
    later = events(http, "one", 'id="b:end"', **{"last-event-id": feedback[-1]["id"]})
    assert int(next(event for event in later if "id" in event)["id"]) == len(feedback) + 1


def test_sessions_speak_a_text(http: Any) -> None:
    http.post("/sessions/talk/bml", content="Hello")
    assert any(
        ":speech:end" in event["data"] for event in events(http, "talk", ":end", **{"last-event-id": "0"})
    )


def test_sessions_are_those_of_the_websocket(place: str, http: Any) -> None:
    async def test() -> None:
        async with connect(f"ws://{place}/ws?session=both") as client:
            await asyncio.to_thread(http.post, "/sessions/both/bml", content=NOD.format("x"))
            assert [f async for f in client.until_end("x")][-1].id == "x:end"
            assert (await client.play(NOD.format("y"))).status == "DONE"
            async for frame in client.faps():
                assert len(frame.values) == 68
                break

    asyncio.run(asyncio.wait_for(test(), LIMIT))


def test_delete_ends_a_session_and_its_connections(place: str, http: Any) -> None:
    with connect(f"ws://{place}/ws?session=gone") as client:
        assert http.delete("/sessions/gone").status_code == 204
        with pytest.raises(ClientError, match="the session was ended"):
            client.ask("ping")
    assert http.delete("/sessions/gone").status_code == 404
