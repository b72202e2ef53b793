"""Frames that follow each other: each once, at its time, and none where there is more to do."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.core.options import PlayOptions
from realizer.playback.player import Player
from realizer.protocol.wire import unpack
from realizer.server.streams.broadcast import Run
from realizer.server.streams.connection import FrameSubscription
from realizer.server.streams.frame_windows import Strip, Timeline

FPS = 25.0
ZERO = 100.0
FRAMES = 10


def run(until: float = float("inf"), following: int = 0) -> tuple[Run, FrameSubscription]:
    player = Player(PlayOptions(idle=False))
    timeline = Timeline(player, 0, FPS, lambda: pytest.fail("no face is wanted"))
    subscription = FrameSubscription("fap", "binary", timeline, 0, None, following)
    rows = np.arange(FRAMES * 68, dtype="<i4").reshape(FRAMES, 68)
    strip = Strip("fap", 0, np.arange(FRAMES) / FPS, rows, 0)
    return Run(7, subscription, strip, ZERO, until), subscription


def at(frame: float) -> float:
    return ZERO + frame / FPS


def test_each_frame_is_given_once_at_its_time() -> None:
    frames, subscription = run()
    for number in range(FRAMES):
        assert frames.wakes == pytest.approx(at(number))
        assert frames.take(at(number) - 0.001) is None
        data = frames.take(at(number))
        assert data is not None
        assert unpack(data).frame == number
        assert unpack(data).values[0] == 68 * number
        assert frames.take(at(number)) is None
        assert subscription.next == number + 1


def test_behind_the_last_there_is_none() -> None:
    frames, _ = run(following=FRAMES - 1)
    assert frames.take(at(FRAMES - 1)) is not None
    assert frames.take(at(FRAMES)) is None


def test_where_more_than_one_is_due_the_session_is_wanted() -> None:
    frames, subscription = run()
    assert frames.take(at(1)) is None
    assert frames.take(at(0.99)) is not None
    assert subscription.next == 1


def test_where_something_else_is_due_the_session_is_wanted() -> None:
    frames, _ = run(until=at(1.5))
    assert frames.take(at(0)) is not None
    assert frames.take(at(1)) is not None
    assert frames.wakes == at(1.5)
    assert frames.take(at(1.5)) is None
    assert frames.take(at(2)) is None
