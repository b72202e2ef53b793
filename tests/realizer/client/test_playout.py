"""The playout of frames: each at its time, without those that were taken back."""

from __future__ import annotations

import math

import numpy as np
import pytest

from realizer.client.message_router import MEMORY, Playout
from realizer.protocol.wire import WireFrame

FPS = 25.0
AHEAD = 0.2
INFO = {"names": ["a"], "fps": FPS, "ahead": AHEAD}
ZERO = 50.0  # the local clock when the session clock was 0


def message(first: int, *values: int, flush: bool = False) -> WireFrame:
    payload = np.array(values, "<i4").tobytes()
    return WireFrame(1, first, first / FPS, payload, flush=flush, stream_info=INFO)


def taken(playout: Playout, now: float) -> list[tuple[int, int]]:
    frames = iter(lambda: playout.take(now), None)
    return [(frame.frame, int(frame.values[0])) for frame in frames]


def test_take_returns_each_frame_at_its_time() -> None:
    playout = Playout(AHEAD)
    assert playout.next_due == math.inf
    playout.receive(message(3, 30, 40, 50), ZERO)  # sent at 0: the last is due at 0.2
    assert playout.next_due == pytest.approx(ZERO + 3 / FPS)
    assert not taken(playout, ZERO + 0.119)
    assert taken(playout, ZERO + 0.121) == [(3, 30)]
    assert taken(playout, ZERO + 0.3) == [(4, 40), (5, 50)]
    assert taken(playout, ZERO + 9) == []


def test_receive_drops_what_is_taken_back() -> None:
    playout = Playout(AHEAD)
    playout.receive(message(3, 30, 40, 50), ZERO)
    playout.receive(message(4, 41, 51, 61, flush=True), ZERO + 0.05)
    assert taken(playout, ZERO + 1) == [(3, 30), (4, 41), (5, 51), (6, 61)]


def test_receive_drops_frames_that_were_taken() -> None:
    playout = Playout(AHEAD)
    playout.receive(message(3, 30, 40, 50), ZERO)
    assert taken(playout, ZERO + 4.1 / FPS) == [(3, 30), (4, 40)]
    playout.receive(message(4, 41, 51, flush=True), ZERO + 4.2 / FPS)
    assert taken(playout, ZERO + 1) == [(5, 51)]


def test_next_due_follows_the_message_with_the_least_delay() -> None:
    playout = Playout(AHEAD)
    playout.receive(message(3, 30, 40, 50), ZERO + 0.04)
    assert playout.next_due == pytest.approx(ZERO + 0.04 + 3 / FPS)
    playout.receive(message(6, 60, 70, 80), ZERO + 3 / FPS)
    assert playout.next_due == pytest.approx(ZERO + 3 / FPS)
    playout.receive(message(9, 90), ZERO + 0.3)  # late
    assert playout.next_due == pytest.approx(ZERO + 3 / FPS)


def test_next_due_forgets_delays_of_long_ago() -> None:
    playout = Playout(AHEAD)
    playout.receive(message(5, 50), ZERO)
    drift, later = 0.01, 10 + MEMORY
    taken(playout, ZERO + 1)
    playout.receive(message(round(later * FPS), 1), ZERO + drift + later - AHEAD)
    assert playout.next_due == pytest.approx(ZERO + drift + later)


def test_playout_without_ahead_passes_frames_on() -> None:
    playout = Playout(0.0)
    for number, late in ((3, 0.01), (4, 0.0), (5, 0.02)):
        frame = WireFrame(1, number, number / FPS, np.array([number], "<i4").tobytes())
        playout.receive(frame, ZERO + number / FPS + late)
        assert taken(playout, ZERO + number / FPS + late) == [(number, number)]
