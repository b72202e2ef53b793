"""Tests of the detection of overload."""

from __future__ import annotations

import pytest

from realizer.server.streams.broadcast import LATE, PERIOD, RECOVERY, TIMELY, Overload

STEP = 0.125  # s


def noted(*spans: tuple[float, float]) -> tuple[Overload, float]:
    """Return the state after spans of (seconds, lateness) in which sessions are woken, and the time."""
    overload, now = Overload(), 100.0
    for seconds, late in spans:
        for _ in range(round(seconds / STEP)):
            now += STEP
            overload.note(late, now)
            overload.end_if_over(now)
    return overload, now


@pytest.mark.parametrize(
    ("spans", "is_active"),
    [
        ([(10, LATE)], False),
        ([(PERIOD, 2 * LATE)], False),
        ([(PERIOD + STEP, 2 * LATE)], True),
        ([(PERIOD, 2 * LATE), (STEP, 0.0), (PERIOD, 2 * LATE)], False),
        ([(PERIOD + STEP, 2 * LATE), (RECOVERY - STEP, TIMELY)], True),
        ([(PERIOD + STEP, 2 * LATE), (RECOVERY, TIMELY)], False),
        ([(PERIOD + STEP, 2 * LATE), (RECOVERY - STEP, 0.0), (STEP, 0.06), (RECOVERY - STEP, 0.0)], True),
    ],
)
def test_overload_begins_and_ends_after_a_while(spans: list[tuple[float, float]], is_active: bool) -> None:
    assert noted(*spans)[0].is_active is is_active


def test_overload_needs_more_than_two_late_sessions_far_apart() -> None:
    overload, now = noted((STEP, 1.0))
    overload.note(1.0, now + 60.0)
    assert not overload.is_active


def test_overload_ends_if_no_session_is_left() -> None:
    overload, now = noted((PERIOD + STEP, 1.0))
    overload.end_if_over(now + RECOVERY)
    assert not overload.is_active


def test_overload_is_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    noted((3 * PERIOD, 0.25), (2 * RECOVERY, 0.0))
    assert caplog.messages == [
        "overloaded: sessions are woken 250 ms too late. New ones are refused, and frames are left out",
        "no longer overloaded: sessions are woken in time",
    ]


def test_oldest_is_the_newest_frame_while_overloaded() -> None:
    overload = Overload()
    assert overload.oldest(100, 4.0, 25.0) == 88
    overload.is_active = True
    assert overload.oldest(100, 4.0, 25.0) == 100
