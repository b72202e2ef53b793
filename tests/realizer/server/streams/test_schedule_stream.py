"""The stream `schedule`: all blocks first, then every change, once and in order."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.wake_times import next_wake

SCHEDULE = {"type": "subscribe", "stream": "schedule"}
WAIT = '<bml id="{}"{}><wait id="w" duration="{}"/></bml>'
BMLA = ' xmlns:bmla="http://www.asap-project.org/bmla"'
# Blocks of the first id, some of which refer to a block of the second one, which may be there or not.
DOCUMENTS = (
    '<bml id="{0}"><head id="n" lexeme="NOD" start="0.3"/><faceLexeme id="w" lexeme="SMILE"/></bml>',
    '<bml id="{0}" composition="APPEND"><wait id="w" duration="1"/></bml>',
    '<bml id="{0}" composition="REPLACE"><wait id="w" duration="2"/></bml>',
    '<bml id="{0}"><wait id="w" start="anticipators:m:beat" duration="1"/></bml>',
    '<bml id="{0}"><wait id="w" start="{1}:w:end" duration="1"/></bml>',
    '<bml id="{0}"><wait id="w" duration="2"/><constraint><after ref="{1}:w:start"><sync ref="w:start"/>'
    "</after></constraint></bml>",
)


def states(client) -> list[tuple[str, str]]:
    """Return (block, state) of all messages, in order."""
    return [(b["block"], b["state"]) for m in client.of("schedule") for b in m["blocks"]]


def known(client) -> dict[str, dict[str, Any]]:
    """Return the state of a client that applies all messages."""
    blocks: dict[str, dict[str, Any]] = {}
    for message in client.of("schedule"):
        if message["whole"]:
            blocks = {}
        for block in message["blocks"]:
            blocks[block["block"]] = blocks.get(block["block"], {}) | block
    return blocks


def ends(block: dict[str, Any]) -> dict[str, float]:
    return {b["id"]: b["syncs"][-1]["at"] for b in block["behaviours"]}


def test_schedule_stream_begins_with_all_blocks(driver) -> None:
    driver.send(WAIT.format("a", "", 3))
    driver.send(WAIT.format("b", ' composition="APPEND"', 2))
    driver.run(1.0)
    client = driver.send(SCHEDULE)
    assert client.of("subscribed") == [
        {"type": "subscribed", "stream": "schedule", "encoding": "json", "index": 0}
    ]
    (message,) = client.of("schedule")
    assert (message["whole"], message["time"]) == (True, 1.0)
    assert states(client) == [("a", "IN_EXEC"), ("b", "LURKING")]
    second = message["blocks"][1]
    assert (second["start"], second["end"]) == (3.0, 5.0)
    assert second["behaviours"][0]["syncs"] == [
        {"name": "start", "time": 0.0, "at": 3.0},
        {"name": "end", "time": 2.0, "at": 5.0},
    ]


def test_schedule_stream_begins_empty_without_blocks(driver) -> None:
    client = driver.send(SCHEDULE)
    assert [m["blocks"] for m in client.of("schedule")] == [[]]


def test_schedule_stream_sends_a_block_when_planned_started_and_ended(driver) -> None:
    client = driver.send(SCHEDULE)
    driver.send(WAIT.format("a", "", 1))
    driver.send(WAIT.format("b", ' composition="APPEND"', 1))
    driver.run(5)
    assert states(client) == [
        ("a", "LURKING"),
        ("a", "IN_EXEC"),
        ("b", "LURKING"),
        ("a", "DONE"),
        ("b", "IN_EXEC"),
        ("b", "DONE"),
    ]
    waits, begins, ends = client.of("schedule")[-3:]
    assert waits["blocks"][0]["behaviours"][0]["gaps"][0]["actual"] == 1.0
    # What has not changed is not sent again.
    assert begins["blocks"][1].keys() == {"block", "character", "state", "start", "end"}
    assert ends["blocks"] == [{"block": "b", "character": None, "state": "DONE", "start": 1.0, "end": 2.0}]
    assert (begins["time"], ends["time"]) == pytest.approx((1.0, 2.0), abs=1e-5)


def test_schedule_stream_sends_changes_when_they_happen(driver) -> None:
    client = driver.send(SCHEDULE)
    driver.send(WAIT.format("a", "", 1))
    count = len(client.messages)
    driver.run(0.9)
    assert len(client.messages) == count


def test_schedule_stream_sends_a_block_that_another_one_moves(driver) -> None:
    client = driver.send(SCHEDULE)
    driver.send(WAIT.format("a", "", 3))
    driver.send(WAIT.format("b", ' composition="APPEND"', 2))
    driver.run(1.0)
    driver.send({"type": "stop", "blocks": ["a"]})
    driver.run(1.1)
    assert states(client)[-3:] == [("a", "INTERRUPTED"), ("b", "LURKING"), ("b", "IN_EXEC")]
    assert ends(known(client)["b"]) == {"w": 3.0}


def test_schedule_stream_sends_blocks_that_an_anticipated_point_moves(driver) -> None:
    client = driver.send(SCHEDULE)
    driver.send({"type": "anticipate", "id": "music", "syncs": {"beat": 2.0}})
    driver.send('<bml id="a"><head id="n" lexeme="NOD" stroke="anticipators:music:beat"/></bml>')
    driver.run(0.1)
    driver.send({"type": "anticipate", "id": "music", "syncs": {"beat": 2.5}})
    (link,) = known(client)["a"]["behaviours"][0]["links"]
    assert (link["sync"], link["to"]) == ("stroke", "anticipators:music:beat")
    syncs = {s["name"]: s["at"] for s in known(client)["a"]["behaviours"][0]["syncs"]}
    assert syncs["stroke"] == pytest.approx(2.5)


def test_schedule_stream_sends_constraints_that_another_block_moves(driver) -> None:
    client = driver.send(SCHEDULE)
    driver.send({"type": "anticipate", "id": "music", "syncs": {"beat": 2.0}})
    driver.send('<bml id="a"><wait id="w" start="anticipators:music:beat" duration="1"/></bml>')
    driver.send(
        '<bml id="b"><wait id="v" start="0.5" duration="1"/>'
        '<constraint><before ref="a:w:start"><sync ref="v:end"/></before></constraint></bml>'
    )
    driver.run(0.1)

    def slack() -> float:
        return known(client)["b"]["behaviours"][0]["links"][1]["slack"]

    assert slack() == pytest.approx(0.5)
    driver.send({"type": "anticipate", "id": "music", "syncs": {"beat": 3.0}})
    assert slack() == pytest.approx(1.5)


def test_schedule_stream_sends_a_behaviour_that_is_cut_off(driver) -> None:
    client = driver.send(SCHEDULE)
    driver.send('<bml id="a"><gaze id="g" target="x" start="0" end="5"/><wait id="w" duration="6"/></bml>')
    driver.send(f'<bml id="b"{BMLA}><bmla:interrupt id="i" start="2" target="a" include="g"/></bml>')
    driver.run(3)
    times = ends(known(client)["a"])
    assert 2.0 < times["g"] < 4.0
    assert times["w"] == 6.0


def test_schedule_stream_sends_times_when_a_block_is_activated(driver) -> None:
    client = driver.send(SCHEDULE)
    driver.send(WAIT.format("a", f'{BMLA} bmla:preplan="true"', 1))
    waits = known(client)["a"]
    assert (waits["state"], waits["start"], waits["behaviours"][0]["syncs"][0]["at"]) == (
        "PENDING",
        None,
        None,
    )
    driver.run(1)
    driver.send(f'<bml id="b"{BMLA}><bmla:activate id="i" target="a"/></bml>')
    assert known(client)["a"]["start"] == pytest.approx(1.0)


def test_schedule_stream_sends_dropped_behaviours_with_warnings(driver) -> None:
    client = driver.send(SCHEDULE)
    driver.send('<bml id="a"><wait id="w" duration="1"/><head id="n" lexeme="NOD" end="0.01"/></bml>')
    (gone,) = known(client)["a"]["dropped"]
    assert (gone["id"], gone["element"], gone["type"]) == ("n", "head", "IMPOSSIBLE_TO_SCHEDULE")
    assert [w["id"] for w in known(client)["a"]["warnings"]] == ["a:n"]


def test_schedule_stream_filters_by_character(driver) -> None:
    alice = driver.join(2)
    driver.send(WAIT.format("a", ' characterId="Alice"', 1))
    driver.send({**SCHEDULE, "character": "Alice"}, 2)
    client = driver.send(SCHEDULE)
    driver.send(WAIT.format("b", ' characterId="Bob"', 2))
    driver.run(5)
    assert {block for block, _ in states(alice)} == {"a"}
    assert {m["character"] for m in alice.of("schedule")} == {"Alice"}
    assert {block for block, _ in states(client)} == {"a", "b"}


def test_schedule_stream_sends_a_slow_client_all_blocks_later(driver) -> None:
    fast = driver.join(2)
    driver.send(SCHEDULE, 2)
    client = driver.send(SCHEDULE)
    driver.session.update_backlog(1, 10**6)
    for name in "abc":
        driver.send(WAIT.format(name, ' composition="APPEND"', 2))
    driver.run(3)
    assert len(client.of("schedule")) == 1
    driver.session.update_backlog(1, 0)
    driver.run(4.5)
    assert [m["whole"] for m in client.of("schedule")][:2] == [True, True]
    # From there on it gets the same messages as the others, and has missed nothing.
    assert {b: s["state"] for b, s in known(client).items()} == {"b": "DONE", "c": "IN_EXEC"}
    alive = {b: s for b, s in known(fast).items() if s["state"] != "DONE"}
    assert {b: ends(s) for b, s in known(client).items() if s["state"] != "DONE"} == {
        b: ends(s) for b, s in alive.items()
    }


def test_schedule_stream_does_not_retry_without_changes(driver) -> None:
    driver.send(SCHEDULE)
    driver.session.update_backlog(1, 10**6)
    driver.run(5)
    assert next_wake(driver.session) == math.inf


def test_schedule_stream_ends_with_unsubscribe(driver) -> None:
    client = driver.send(SCHEDULE)
    driver.send({"type": "unsubscribe", "stream": "schedule"})
    driver.send(WAIT.format("a", "", 1))
    driver.run(3)
    assert states(client) == []


def test_schedule_stream_begins_with_all_blocks_after_a_reconnect(drive) -> None:
    driver = drive(named=True)
    driver.send(SCHEDULE)
    driver.send(WAIT.format("a", "", 3))
    driver.run(1)
    driver.leave(1)
    driver.run(2)
    again = driver.join(2)
    driver.send(SCHEDULE, 2)
    assert [m["whole"] for m in again.of("schedule")] == [True]
    assert states(again) == [("a", "IN_EXEC")]


def test_schedule_stream_has_no_other_encoding(driver) -> None:
    client = driver.send({**SCHEDULE, "encoding": "binary"})
    assert client.of("error")[0]["where"] == "subscribe.encoding"


MOVES = st.one_of(
    st.tuples(st.just("send"), st.integers(0, len(DOCUMENTS) - 1)),
    st.tuples(st.just("run"), st.floats(0.01, 1.5)),
    st.tuples(st.just("stop"), st.integers(0, 5)),
    st.tuples(st.just("beat"), st.floats(0, 4)),
    st.tuples(st.just("slow"), st.sampled_from([0, 10**6])),
)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(moves=st.lists(MOVES, max_size=14))
def test_schedule_stream_changes_add_up_to_the_whole_state(drive, moves) -> None:
    driver = drive(idle=False)
    client = driver.send(SCHEDULE)
    driver.send({"type": "anticipate", "id": "m", "syncs": {"beat": 1.0}})
    for number, (move, value) in enumerate(moves):
        if move == "send":
            driver.send(DOCUMENTS[value].format(f"b{number}", f"b{max(0, number - 2)}"))
        elif move == "run":
            driver.run(driver.now + value)
        elif move == "stop":
            driver.send({"type": "stop", "blocks": [f"b{value}"]})
        elif move == "beat":
            driver.send({"type": "anticipate", "id": "m", "syncs": {"beat": driver.now + value}})
        else:
            driver.session.update_backlog(1, value)
    driver.session.update_backlog(1, 0)
    driver.run(driver.now + 0.2)
    last = driver.join(2)
    driver.send(SCHEDULE, 2)
    over = ("DONE", "INTERRUPTED", "REVOKED")
    assert {b: s for b, s in known(client).items() if s["state"] not in over} == known(last)
