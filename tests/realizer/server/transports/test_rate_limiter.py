"""The rate at which messages are read."""

from __future__ import annotations

import pytest

from realizer.server.transports.rate_limiter import RateLimiter


def test_rate_limiter_never_delays_a_client_within_its_rate() -> None:
    pace = RateLimiter(10)
    assert all(pace.wait(k / 10) == 0.0 for k in range(1000))


def test_rate_limiter_notices_a_flood_once() -> None:
    pace = RateLimiter(2)
    notices = [pace.wait(0.0) > 0 and pace.notice for _ in range(10)]
    assert notices[:4] == [False] * 4
    assert notices[4] == "wanted at most 2 messages a second; more are read later (REALIZER_MAX_RATE sets it)"
    assert notices[5:] == [None] * 5
    pace.wait(60.0)
    assert [pace.wait(60.0) > 0 and pace.notice for _ in range(4)][-1] == notices[
        4
    ]  # and again, after a pause


def test_rate_limiter_counts_several_messages_at_once() -> None:
    one, several = RateLimiter(10), RateLimiter(10)
    for _ in range(30):
        pause = one.wait(0.0)
    assert several.wait(0.0, 30) == pytest.approx(pause) == pytest.approx(1.0)


def test_rate_limiter_limits_a_flood_after_a_first_burst() -> None:
    pace, now, read = RateLimiter(10), 0.0, 0
    while now < 60.0:
        now += pace.wait(now)
        read += 1
    assert 600 <= read <= 10 * 62 + 1
