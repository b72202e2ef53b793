"""Frames that follow each other: each once, at its time, and none where there is more to do."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.core.options import PlayOptions
from realizer.playback.player import Player
from realizer.protocol.wire import unpack
from realizer.server.streams.broadcast import FrameRun
from realizer.server.streams.frame_windows import FrameSubscription, FrameTimeline, PackedFrames

FPS = 25.0
ZERO = 100.0
FRAMES = 10


def run(until: float = float("inf"), following: int = 0) -> tuple[FrameRun, FrameSubscription]:
    player = Player(PlayOptions(idle=False))
    timeline = FrameTimeline(player, 0, FPS, lambda: pytest.fail("no face is wanted"))
    subscription = FrameSubscription("fap", "binary", timeline, 0, None, following)
    rows = np.arange(FRAMES * 68, dtype="<i4").reshape(FRAMES, 68)
    strip = PackedFrames("fap", 0, np.arange(FRAMES) / FPS, rows, 0)
    return FrameRun(7, subscription, strip, ZERO, until), subscription


def at(frame: float) -> float:
    return ZERO + frame / FPS


def test_each_frame_is_given_once_at_its_time() -> None:
    frames, subscription = run()
    for number in range(FRAMES):
        assert frames.wake_at == pytest.approx(at(number))
        assert frames.next_message(at(number) - 0.001) is None
        data = frames.next_message(at(number))
        assert data is not None
        assert unpack(data).frame == number
        assert unpack(data).values[0] == 68 * number
        assert frames.next_message(at(number)) is None
        assert subscription.next == number + 1


def test_behind_the_last_there_is_none() -> None:
    frames, _ = run(following=FRAMES - 1)
    assert frames.next_message(at(FRAMES - 1)) is not None
    assert frames.next_message(at(FRAMES)) is None


def test_where_more_than_one_is_due_the_session_is_wanted() -> None:
    frames, subscription = run()
    assert frames.next_message(at(1)) is None
    assert frames.next_message(at(0.99)) is not None
    assert subscription.next == 1


def test_where_something_else_is_due_the_session_is_wanted() -> None:
    frames, _ = run(until=at(1.5))
    assert frames.next_message(at(0)) is not None
    assert frames.next_message(at(1)) is not None
    assert frames.wake_at == at(1.5)
    assert frames.next_message(at(1.5)) is None
    assert frames.next_message(at(2)) is None
