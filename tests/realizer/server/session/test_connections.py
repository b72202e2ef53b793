"""Tests of the connections of a session."""

from __future__ import annotations

from realizer.server.session import connections as feedback_log
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
