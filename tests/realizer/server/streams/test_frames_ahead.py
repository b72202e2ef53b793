"""Rows that are sent ahead: in time, and after changes of plan equal to frames that are sent in time."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.core.settings import Settings
from realizer.protocol.wire import HEADER, unpack
from realizer.server.journal import Entry, SavedSession
from realizer.server.journal.replay import restore_session
from realizer.server.session.session import Session
from realizer.server.streams.broadcast import OUTDATED
from realizer.server.streams.frame_windows import FrameTimeline, FrameWindow
from tests.example_counts import examples
from tests.realizer.server.conftest import NOD, TALK, Client, Driver, spoken

FPS = 25
DTYPES = {"fap": "<i4", "au": "<f4", "arkit": "<f4"}
SMILE = '<bml id="{}"><faceLexeme id="f" lexeme="SMILE" start="{}" end="{}"/></bml>'


def subscribe(stream: str = "fap", *, ahead: float = 0.2, **fields) -> dict[str, object]:
    return {"type": "subscribe", "stream": stream, "ahead": ahead, **fields}


@dataclass
class Batch:
    """A message with several rows."""

    sent: float
    first: int
    rows: list[list[float]]
    flush: bool


def batches(client: Client, stream: str = "fap") -> list[Batch]:
    """Return the messages of a stream."""
    width = len(client.of("subscribed")[0]["names"])
    found = []
    for sent, message in zip(client.times, client.messages, strict=True):
        if isinstance(message, bytes) and (frame := unpack(message)).stream == stream:
            rows = np.frombuffer(message, DTYPES[stream], offset=HEADER.size).reshape(-1, width).tolist()
            found.append(Batch(sent, frame.frame, rows, frame.flush))
        elif isinstance(message, str) and message.startswith(f'{{"type":"{stream}"'):
            fields = json.loads(message)
            found.append(Batch(sent, fields["frame"], fields["values"], fields.get("flush", False)))
    return found


def shown(client: Client, stream: str = "fap") -> dict[int, list[float]]:
    """Return frame number -> values as a client has them at the end."""
    rows: dict[int, list[float]] = {}
    for batch in batches(client, stream):
        if batch.flush:
            rows = {k: values for k, values in rows.items() if k < batch.first}
        assert batch.first not in rows
        rows |= dict(enumerate(batch.rows, batch.first))
    return rows


@pytest.mark.parametrize("fps", [10, 25, 30, 60])
@pytest.mark.parametrize("ahead", [0.02, 0.1, 0.2, 1.3, 2.0])
def test_ahead_sends_rows_early_and_together(driver, fps: int, ahead: float) -> None:
    driver.run(1.01)
    driver.send(subscribe(ahead=ahead, fps=fps))
    found = batches(driver.run(8.0))
    numbers = [number for batch in found for number in range(batch.first, batch.first + len(batch.rows))]
    assert numbers == list(range(numbers[0], numbers[-1] + 1))
    assert numbers[-1] / fps >= 8.0
    for batch in found[1:]:
        last = (batch.first + len(batch.rows) - 1) / fps
        assert last <= batch.sent + ahead + 1e-6
        assert batch.first / fps >= batch.sent + 0.55 * ahead
    assert len(found) <= 2 + 7.0 / max(0.3 * ahead, 1 / fps)
    assert not any(batch.flush for batch in found)


def test_ahead_takes_back_rows_that_a_document_changes(driver) -> None:
    driver.send(subscribe())
    driver.run(1.01)
    before = batches(driver.clients[1])
    client = driver.send(SMILE.format("b", 0.1, 2))
    changed = batches(client)[len(before) :]
    assert [batch.flush for batch in changed] == [True]
    assert 1.01 + 0.1 <= changed[0].first / FPS <= 1.01 + 0.2
    assert driver.session.broadcast.counts["taken_back"] == 1


def test_ahead_takes_nothing_back_for_a_later_change(driver) -> None:
    driver.send(subscribe())
    driver.run(1.01)
    driver.send(SMILE.format("b", 1, 2))
    assert not any(batch.flush for batch in batches(driver.run(4.0)))
    assert driver.session.broadcast.counts["taken_back"] == 0


def test_ahead_is_refused_for_other_streams(driver) -> None:
    (error,) = driver.send(subscribe("mesh")).of("error")
    assert error["where"] == "subscribe.ahead"
    assert driver.send(subscribe(ahead=2.1)).of("error")[-1]["where"] == "subscribe.ahead"
    assert not driver.clients[1].of("subscribed")


def test_ahead_is_a_list_of_rows_in_json(driver) -> None:
    driver.send(subscribe("au", ahead=0.02, encoding="json"))
    client = driver.run(1.0)
    (reply,) = client.of("subscribed")
    assert reply["ahead"] == 0.02
    assert all(len(message["values"]) == 1 for message in client.of("au"))
    assert {len(row) for message in client.of("au") for row in message["values"]} == {len(reply["names"])}


def test_ahead_0_is_the_way_without_it(driver) -> None:
    driver.join(2)
    driver.send(subscribe(ahead=0, encoding="json"), 1)
    driver.send({"type": "subscribe", "stream": "fap", "encoding": "json"}, 2)
    driver.run(1.0)
    assert driver.clients[1].messages == driver.clients[2].messages


def test_ahead_skips_and_counts_rows_of_a_slow_client(driver) -> None:
    driver.join(2)
    driver.send(subscribe(), 1)
    driver.send(subscribe(ahead=0), 2)
    driver.run(1.01)
    got = len(shown(driver.clients[1]))
    driver.session.update_backlog(1, 10**6)
    driver.send(SMILE.format("b", 0.1, 2), 2)
    driver.run(2.01)
    assert len(shown(driver.clients[1])) == got
    driver.session.update_backlog(1, 0)
    driver.run(3.01)
    (back,) = [batch for batch in batches(driver.clients[1]) if batch.flush]
    assert 50 <= back.first <= 52
    driver.send({"type": "state"}, 1)
    lost = driver.clients[1].of("state")[-1]["dropped"]
    assert 20 < lost < 26
    rows = shown(driver.clients[1])
    wanted = {f.frame: f.values.tolist() for f in driver.clients[2].frames}
    assert all(rows[number] == wanted[number] for number in range(back.first, 76))


def test_ahead_skips_late_rows_after_a_stall(driver) -> None:
    driver.send(subscribe())
    driver.now = 5.0
    driver.session.tick(driver.opened + 5.0)
    driver.collect()
    last = batches(driver.clients[1])[-1]
    assert 0 <= last.first - (5.0 - OUTDATED) * FPS < 1
    assert last.first + len(last.rows) - 1 == 5.2 * FPS


def test_ahead_begins_again_when_a_subscription_is_replaced(driver) -> None:
    driver.send(subscribe())
    driver.run(1.01)
    driver.send(subscribe(ahead=0))
    driver.run(2.01)
    _, second = driver.clients[1].of("subscribed")
    assert "ahead" not in second
    assert second["frame"] == 26
    frames = [f.frame for f in driver.clients[1].frames]
    assert frames[-25:] == list(range(26, 51))
    driver.send({"type": "unsubscribe", "stream": "fap"})
    count = len(driver.clients[1].messages)
    driver.run(3.01)
    assert len(driver.clients[1].messages) == count


def test_ahead_goes_on_when_the_face_has_changed(driver) -> None:
    driver.send(subscribe())
    driver.send({"type": "set", "aus": {"26": 1, "12": 1}})
    driver.run(1.01)
    driver.session.broadcast.face_changed(0)
    driver.run(2.0)
    assert list(shown(driver.clients[1]))[:51] == list(range(51))


ACTIONS = st.one_of(
    st.sampled_from([NOD, TALK, SMILE.format("{}", 0, 1), SMILE.format("{}", 0.05, 0.4)]).map(
        lambda text: lambda k: text.format(f"b{k}")
    ),
    st.sampled_from(["REPLACE", "APPEND"]).map(
        lambda how: (
            lambda k: (
                f'<bml id="b{k}" composition="{how}"><head id="n" lexeme="SHAKE"/><speech id="s" start="0.2">'
                "<text>One two</text></speech></bml>"
            )
        )
    ),
    st.sampled_from([{"type": "stop"}, {"type": "stop", "blocks": ["b0"]}]).map(lambda m: lambda k: m),
    st.floats(0, 1).map(lambda x: lambda k: {"type": "set", "aus": {"12": x}, "faps": {"open_jaw": 200 * x}}),
    st.just(lambda k: {"type": "set", "aus": None, "faps": None, "emotion": {"name": "joy"}}),
    st.just(lambda k: {"type": "scene", "objects": {"cup": {"x": 0.2, "y": k / 10, "z": 0.5}}}),
    st.just(
        lambda k: (
            f'<bml xmlns:bmla="http://www.asap-project.org/bmla" id="b{k}" bmla:interrupt="b{k - 1}">'
            '<gaze id="g" target="LEFT" start="0.1" end="0.9"/></bml>'
        )
    ),
    st.just(lambda k: {"type": "speech", "id": "turn", "append": "Hello there, how are you? "}),
    st.just(lambda k: {"type": "speech", "id": "turn", "close": True}),
    st.sampled_from([0.0, 2.0]).map(lambda t: lambda k: {"type": "anticipate", "id": "c", "syncs": {"s": t}}),
    st.just(lambda k: f'<bml id="b{k}"><head id="n" lexeme="NOD" start="anticipators:c:s"/></bml>'),
)
# Also times that are on the grid of frames.
TIMES = st.one_of(st.floats(0, 0.5), st.integers(0, 12).map(lambda k: k / FPS))


@given(
    actions=st.lists(st.tuples(TIMES, ACTIONS), min_size=1, max_size=8),
    stream=st.sampled_from(["fap", "au", "arkit"]),
    ahead=st.sampled_from([0.05, 0.2, 0.7, 2.0]),
    together=st.booleans(),
)
@examples(0.6)
def test_ahead_gives_the_frames_that_are_sent_in_time(actions, stream, ahead, together) -> None:
    drivers = [Driver()] if together else [Driver(), Driver()]
    if together:
        drivers[0].join(2)
    ends = [(drivers[0], 1), (drivers[-1], 2 if together else 1)]
    for (driver, connection), seconds in zip(ends, (ahead, 0), strict=True):
        driver.send(subscribe(stream, ahead=seconds), connection)
    for driver in drivers:
        for k, (pause, action) in enumerate(actions):
            driver.run(driver.now + pause)
            driver.send(action(k))
        driver.run(driver.now + 1.5)
    (early, one), (timely, two) = ends
    rows = shown(early.clients[one], stream)
    wanted = {f.frame: f.values for f in timely.clients[two].frames}
    assert len(wanted) > 35
    assert rows.keys() >= wanted.keys()
    got = np.array([rows[number] for number in wanted])
    assert np.abs(got - np.stack(list(wanted.values()))).max() < 1e-5
    # Never after their time, and in the same session those that change at their own time with the others.
    assert all(batch.first / FPS >= batch.sent - 1e-6 for batch in batches(early.clients[one], stream))


def test_ahead_computes_no_rows_before_the_subscription(driver, monkeypatch: pytest.MonkeyPatch) -> None:
    computed: list[int] = []
    window = FrameTimeline.window

    def counted(timeline: FrameTimeline, first: int, last: int) -> FrameWindow:
        computed.append(first)
        return window(timeline, first, last)

    monkeypatch.setattr(FrameTimeline, "window", counted)
    driver.run(3600.0)
    driver.send(subscribe())
    first = batches(driver.run(3601.0))[0].first
    assert first >= 3600 * FPS
    assert min(computed) >= first


def test_ahead_goes_on_in_a_restored_session(drive) -> None:
    driver = drive()
    session = driver.session = Session("test", Settings(), 0.0, named=True)
    rows = [("join", ""), ("text", SMILE.format("a", 0.1, 1.2)), ("tick", ""), ("tick", "")]
    entries = [Entry(0.5, kind, 1, body) for kind, body in rows]
    restore_session(session, SavedSession(0.0, entries), lambda _: spoken())
    session.clock.opened, driver.now = driver.opened, 1.0
    session.disconnect(1, session.clock.opened + 1.0)
    for connection, ahead in ((2, 0.2), (3, 0.0)):
        driver.join(connection)
        driver.send(subscribe(ahead=ahead), connection)
    driver.run(2.01)
    driver.send(SMILE.format("b", 0.1, 2), 2)
    driver.run(4.0)
    assert [batch.first for batch in batches(driver.clients[2]) if batch.flush] == [54]
    early, late = shown(driver.clients[2]), shown(driver.clients[3])
    assert list(early) == list(range(25, max(early) + 1))
    assert list(late) == list(range(25, 101))
    assert all(early[number] == row for number, row in late.items())
