"""Tests of the clock of a session, and of its work and deadlines."""

from __future__ import annotations

import math

import pytest

from realizer.server.session.due_work import STANDSTILL, SessionClock
from tests.interleavings import Memory
from tests.realizer.server.conftest import NOD, Driver

CALM = """<bml id="{id}" composition="REPLACE"><head id="n" lexeme="NOD" start="0.3"/>
<faceLexeme id="f" lexeme="SMILE" start="n:stroke" end="1.1"/><gaze id="g" target="cup" end="0.9"/></bml>"""


def test_next_due_wakes_a_session_at_every_event(drive) -> None:
    def play(step: float | None) -> list[str | bytes]:
        driver = drive()
        for message in (
            {"type": "scene", "objects": {"cup": {"x": 0.2, "y": -0.1, "z": 0.5}}},
            {"type": "subscribe", "stream": "fap", "fps": 30},
            {"type": "subscribe", "stream": "au", "fps": 12.5, "encoding": "json"},
        ):
            driver.send(message)
        for k, at in enumerate((0.2, 0.9, 4.0)):
            while step is not None and driver.now + step < at:
                driver.run(driver.now + step)
                driver.session.tick(driver.opened + driver.now)
                driver.collect()
            driver.run(at)
            driver.send(CALM.format(id=f"b{k}"))
        driver.run(9.0)
        return driver.clients[1].messages

    assert play(None) == play(0.007)


def test_next_due_is_at_once_while_documents_wait(driver) -> None:
    assert driver.session.next_due() == float("inf")
    driver.session.receive(1, NOD.format("b"), driver.opened)
    assert driver.session.has_documents
    driver.run(0.0)
    assert not driver.session.has_documents
    assert driver.opened < driver.session.next_due() < driver.opened + 1.0


def test_tick_sends_frames_while_documents_wait(driver) -> None:
    driver.send({"type": "subscribe", "stream": "fap", "fps": 25})
    now = driver.opened
    for k in range(3):
        driver.session.receive(1, CALM.format(id=f"b{k}"), now)
    driver.collect()
    assert driver.session.has_documents
    for frame in range(1, 6):
        assert driver.session.next_due() == pytest.approx(now + frame / 25)
        driver.session.tick(now + frame / 25, read_documents=False)
        driver.collect()
    assert [frame.frame for frame in driver.clients[1].frames] == list(range(6))
    assert driver.session.has_documents
    driver.run(0.3)
    assert not driver.session.has_documents
    assert driver.clients[1].ids[-1] != "prediction"
    assert {"b0:end", "b1:end", "b2:start"} <= set(driver.clients[1].ids)


def test_send_alone_sends_feedback_and_frames_until_a_document_comes(driver) -> None:
    driver.send({"type": "subscribe", "stream": "fap", "fps": 25, "ahead": 0.2})
    client = driver.send(NOD.format("b"))
    driver.run(0.1)
    known, frames, due = len(client.ids), len(client.frames), 0.1
    while due < 2.0:
        due = driver.session.due.send_alone(due)
        driver.collect()
    assert {"b:n:stroke", "b:end"} <= set(client.ids[known:])
    assert len(client.frames) > frames + 10
    driver.session.receive(1, NOD.format("c"), driver.opened + 2.0)
    assert driver.session.next_due() > driver.opened + 2.0
    assert driver.session.due.send_alone(2.0) is None


def test_read_returns_seconds_since_the_session_opened() -> None:
    clock = SessionClock(100.0)
    assert [clock.read(now) for now in (100.0, 100.5, 103.0)] == [0.0, 0.5, 3.0]


def test_read_never_goes_back() -> None:
    clock = SessionClock(100.0)
    assert [clock.read(now) for now in (99.0, 102.0, 101.0, 102.5)] == [0.0, 2.0, 2.0, 2.5]


def test_read_is_after_an_instant_that_has_ended() -> None:
    clock = SessionClock(0.0)
    clock.end_instant(2.0)
    clock.end_instant(1.0)
    assert clock.read(2.0) == math.nextafter(2.0, math.inf)


def test_present_stands_still_for_a_while() -> None:
    clock = SessionClock(0.0)
    clock.stand_still(1.0)
    times = (0.9, 1.0, 1.0 + STANDSTILL, 1.01 + STANDSTILL)
    assert [clock.present(t) for t in times] == [0.9, 1.0, 1.0, 1.01 + STANDSTILL]
    clock.stand_still()
    assert clock.present(1.05) == 1.05
    assert not clock.stands_still(1.0)


def test_start_of_a_held_event_is_after_the_standstill() -> None:
    clock = SessionClock(0.0)
    clock.hold(1.0)
    assert [clock.start_of(t) for t in (0.5, 1.0, 1.5)] == [1.0 + STANDSTILL, 1.0 + STANDSTILL, 1.5]
    clock.hold()
    assert clock.start_of(1.0) == 1.0


def test_session_plans_nothing_before_what_has_happened() -> None:
    driver = Driver()
    driver.run(2.0)
    driver.send({"type": "ping"})
    driver.session.receive(1, NOD.format("late"), driver.opened + 0.5)  # the host's clock was set back
    driver.session.tick(driver.opened + 0.6)
    driver.collect()
    (schedule,) = (p.schedule for p in driver.session.player.blocks.active())
    assert schedule.start == 2.0


def test_session_whose_host_goes_back_writes_a_journal_that_rises(tmp_path) -> None:
    driver, journal = Driver(), Memory()
    driver.session.journal.open(journal)
    driver.session.journal.begin(0.0)
    for now in (3.0, 1.0, 0.0, 4.0):
        driver.session.receive(1, NOD.format(f"b{now:g}"), driver.opened + now)
        driver.session.tick(driver.opened + now)
        driver.session.connect(int(now) + 10, driver.opened + now - 0.5)
        driver.session.disconnect(int(now) + 10, driver.opened + now - 0.5)
    times = [entry.at for entry in journal.entries["test"]]
    assert len(times) > 8
    assert times == sorted(times)
