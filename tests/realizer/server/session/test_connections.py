"""Tests of the connections of a session."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import BlockProgress, SyncPointProgress, parse_feedback
from realizer.server.session import connections as feedback_log
from realizer.server.session.connections import FRESH, MOST, PACK, ROOM, FeedbackLog
from tests.realizer.server.conftest import NOD, Driver


def test_update_backlog_closes_a_client_that_never_reads(driver) -> None:
    driver.session.update_backlog(1, 10**9)
    driver.collect()
    assert [c.connection for c in driver.closed] == [1]


def test_connect_sends_missed_feedback() -> None:
    driver = Driver(named=True)
    driver.send(NOD.format("b"))
    driver.run(0.2)
    driver.leave(1)
    driver.run(10)
    whole = driver.session.feedback_log.newest
    again = driver.join(2, seen=2)
    assert [f.seq for f in again.feedback] == list(range(3, whole + 1))
    assert again.ids[-1] == "b:end"


def test_send_missed_feedback_reports_a_gap_of_lost_messages(driver, monkeypatch) -> None:
    monkeypatch.setattr(feedback_log, "MOST", 5)
    monkeypatch.setattr(feedback_log, "PACK", 1)  # whole packs go
    driver.send(NOD.format("b"))
    driver.run(10)
    viewer = driver.join(2, seen=2)
    assert viewer.of("gap") == [{"type": "gap", "seen": 2, "first": 9}]
    assert [f.seq for f in viewer.feedback] == [9, 10, 11, 12, 13]


def test_send_missed_feedback_reports_a_gap_of_unknown_numbers(driver) -> None:
    viewer = driver.join(2, seen=500)
    assert viewer.of("gap") == [{"type": "gap", "seen": 500, "first": 1}]


def test_session_sends_feedback_to_all_connections(driver) -> None:
    viewer = driver.join(2)
    driver.send(NOD.format("b"), 1)
    driver.run(10)
    assert viewer.messages == driver.clients[1].messages


def filled(count: int, step: float = 1.0) -> FeedbackLog:
    log = FeedbackLog()
    for n in range(count):
        log.add(BlockProgress(id=f"b{n}:end", global_time=n * step), n * step)
    return log


def numbers(log: FeedbackLog, seq: int) -> list[int | None]:
    return [parse_feedback(text).seq for text in log.since(seq)]


def test_add_numbers_messages_from_1() -> None:
    log = filled(3)
    assert numbers(log, 1) == [1, 2, 3]
    assert (log.first, log.newest) == (1, 3)


def test_since_returns_later_messages() -> None:
    log = filled(5)
    assert numbers(log, 4) == [4, 5]
    assert log.since(6) == []


def test_add_keeps_the_last_minute_and_a_bounded_size() -> None:
    log = filled(6000, step=0.05)
    texts = log.since(1)
    assert len(texts) == log.newest - log.first + 1
    assert FRESH / 0.05 <= len(texts) < 6000
    assert sum(map(len, texts)) > ROOM  # the last minute alone is larger here
    slow = filled(6000, step=10.0)
    assert ROOM - 1.1 * PACK < sum(map(len, slow.since(1))) <= ROOM
    assert numbers(slow, 1) == list(range(slow.first, 6001))


def test_add_limits_the_number_of_recent_messages() -> None:
    log = filled(MOST + 5, step=0.0)
    assert log.newest == MOST + 5
    assert MOST - PACK / 100 < len(log.since(1)) == log.newest - log.first + 1 <= MOST


@given(seq=st.integers(-5, 700))
def test_since_unpacks_compressed_messages(seq: int) -> None:
    log = FeedbackLog()
    texts = [log.add(BlockProgress(id=f"b{n}:end", global_time=n * 0.1), n * 0.1) for n in range(600)]
    assert sum(map(len, texts)) > 4 * PACK
    assert log.since(seq) == texts[max(seq - 1, 0) :]


def test_restore_continues_the_numbers() -> None:
    log = filled(5)
    again = FeedbackLog()
    again.restore(log.newest, log.since(3), now=7.0)
    assert (again.first, again.newest) == (3, 5)
    assert again.since(4) == log.since(4)


def test_add_writes_posix_times_with_an_epoch() -> None:
    log = FeedbackLog(epoch=1_700_000_000.25)
    log.add(SyncPointProgress(id="b:h:end", time=1.0, global_time=2.5), 2.5)
    (text,) = log.since(1)
    assert 'globalTime="2.5"' in text
    assert parse_feedback(text).posix_time == 1_700_000_002_750


@pytest.mark.parametrize(("unsent", "closes"), [(32 * 2**20, False), (32 * 2**20 + 1, True)])
def test_connection_closes_with_more_than_32_mib_unsent(driver: Driver, unsent: int, closes: bool) -> None:
    driver.session.update_backlog(1, unsent)
    driver.collect()
    assert bool(driver.closed) is closes
