"""The delay between a session and what a WebRTC peer is sent."""

from __future__ import annotations

import pytest

pytest.importorskip("starlette", reason="needs the asgi extra")

from realizer.server.asgi.playout import FIRST, LOST, MOST, WINDOW, Playout

OPENED = 100.0


def after(*lags: float, quiet: bool = True) -> Playout:
    """Return the playout after pictures, a frame of 25 Hz each, that came so late."""
    playout = Playout(OPENED, OPENED + 5)
    for k, lag in enumerate(lags):
        playout.note_picture(5 + k / 25, OPENED + 5 + k / 25 + lag)
    if quiet:
        playout.adapt()
    return playout


def test_playout_begins_on_a_packet_of_the_session() -> None:
    playout = Playout(OPENED, OPENED + 5.013)
    assert playout.began >= OPENED + 5.013
    assert (playout.began - playout.offset) / 0.02 == pytest.approx(round((5.013 - FIRST) / 0.02), abs=1)
    assert playout.delay == pytest.approx(FIRST)


def test_playout_waits_for_slow_pictures() -> None:
    assert 0.23 <= after(*[0.23] * WINDOW).delay <= 0.26


def test_playout_ignores_two_late_pictures_of_a_window() -> None:
    assert after(*[0.095] * (WINDOW - 2), 0.4, 0.4).delay == pytest.approx(0.12, abs=0.021)


def test_playout_shortens_a_delay_that_is_much_too_long() -> None:
    assert 0.01 <= after(*[0.01] * WINDOW).delay <= 0.04
    assert after(*[0.08] * WINDOW).delay == pytest.approx(FIRST)


def test_playout_changes_in_silence_only() -> None:
    assert after(*[0.3] * WINDOW, quiet=False).delay == pytest.approx(FIRST)


def test_playout_waits_no_longer_than_half_a_second() -> None:
    assert after(*[0.9] * WINDOW).delay == pytest.approx(MOST, abs=0.03)


def test_playout_follows_a_clock_that_was_moved() -> None:
    playout = after(-LOST - 5)
    playout.note_picture(20.0, OPENED + 13)
    assert playout.delay == pytest.approx(FIRST, abs=0.021)
    assert playout.offset == pytest.approx(OPENED - 6 + FIRST, abs=1.021)
