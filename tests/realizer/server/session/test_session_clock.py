"""Tests of `realizer.server.session.session_clock`."""

from __future__ import annotations

import math

from realizer.server.session.session_clock import STANDSTILL, SessionClock
from tests.interleavings import Memory
from tests.realizer.server.conftest import NOD, Driver


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
