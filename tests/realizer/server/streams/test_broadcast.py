"""Frames for subscribers: each once, at its time, and by the fast path."""

from __future__ import annotations

import gc

import numpy as np
import pytest

from realizer.core.options import PlayOptions
from realizer.playback.player import Player
from realizer.protocol.streams import STREAMS
from realizer.protocol.wire import unpack
from realizer.server.streams.audio_stream import AudioStream
from realizer.server.streams.broadcast import FrameRun
from realizer.server.streams.connection import Connection
from realizer.server.streams.frame_windows import FrameSubscription, FrameTimeline, PackedFrames
from realizer.server.streams.overload import OUTDATED, Overload
from tests.realizer.server.conftest import NOD

FAP = {"type": "subscribe", "stream": "fap"}
FPS = 25.0
ZERO = 100.0
FRAMES = 10


def subscribe(stream: str, **fields):
    return {"type": "subscribe", "stream": stream, **fields}


def run(
    until: float = float("inf"), following: int = 0, overload: Overload | None = None
) -> tuple[FrameRun, FrameSubscription]:
    player = Player(PlayOptions(idle=False))
    timeline = FrameTimeline(player, 0, FPS, lambda: pytest.fail("no face is wanted"))
    subscription = FrameSubscription("fap", "binary", timeline, 0, None, following)
    rows = np.arange(FRAMES * 68, dtype="<i4").reshape(FRAMES, 68)
    strip = PackedFrames("fap", 0, np.arange(FRAMES) / FPS, rows, 0)
    client = Connection(7)
    return FrameRun(client, subscription, strip, ZERO, until, overload or Overload()), subscription


def at(frame: float) -> float:
    return ZERO + frame / FPS


def test_next_message_returns_each_frame_once_at_its_time() -> None:
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


def test_next_message_skips_late_frames_of_an_overloaded_process() -> None:
    overload = Overload()
    overload.is_active = True
    frames, subscription = run(overload=overload)
    data = frames.next_message(at(4.5))
    assert data is not None
    assert (unpack(data).frame, subscription.next, frames.wake_at) == (4, 5, pytest.approx(at(5)))
    assert frames.next_message(at(FRAMES)) is None


@pytest.mark.parametrize(("ahead", "lost"), [(0, 9), (0.2, 5)])
@pytest.mark.parametrize("viewers", [1, 2])
def test_broadcast_sends_the_newest_frame_of_an_overload(
    driver, ahead: float, lost: int, viewers: int
) -> None:
    for viewer in range(1, viewers + 1):
        driver.join(viewer)
        driver.send(subscribe("fap", ahead=ahead), viewer)
    driver.run(1.0)
    driver.session.broadcast.overload.is_active = True
    before = len(driver.clients[1].frames)
    driver.session.tick(driver.opened + 1.42)
    driver.collect()
    (frame,) = driver.clients[1].frames[before:]
    assert frame.frame == 35
    assert [client.dropped for client in driver.session.connections.values()] == [lost] * viewers


def test_next_message_returns_none_after_the_last_frame() -> None:
    frames, _ = run(following=FRAMES - 1)
    assert frames.next_message(at(FRAMES - 1)) is not None
    assert frames.next_message(at(FRAMES)) is None


def test_next_message_returns_late_frames_one_after_the_other() -> None:
    frames, subscription = run()
    numbers = [unpack(data).frame for data in iter(lambda: frames.next_message(at(2.5)), None)]
    assert numbers == [0, 1, 2]
    assert subscription.next == 3
    assert frames.wake_at == pytest.approx(at(3))


def test_next_message_returns_none_if_a_frame_is_far_too_late() -> None:
    frames, subscription = run()
    assert frames.next_message(ZERO + OUTDATED + 0.01) is None
    assert subscription.next == 0


def test_next_message_returns_none_if_another_event_is_due() -> None:
    frames, _ = run(until=at(1.5))
    assert frames.next_message(at(0)) is not None
    assert frames.next_message(at(1)) is not None
    assert frames.wake_at == at(1.5)
    assert frames.next_message(at(1.5)) is None
    assert frames.next_message(at(2)) is None


def test_broadcast_numbers_frames_by_the_clock_and_sends_them_in_time(driver) -> None:
    driver.run(0.5)
    driver.send({**FAP, "fps": 25})
    client = driver.run(2.0)
    frames = client.frames
    assert [f.frame for f in frames] == list(range(13, 51))
    sent = client.times[-len(frames) :]
    assert [f.time for f in frames] == pytest.approx(sent, abs=1e-4)
    assert all(len(f.values) == 68 for f in frames)


def test_broadcast_drops_and_counts_frames_of_a_slow_client(driver) -> None:
    driver.session.update_backlog(1, 10**6)
    driver.send(FAP)
    driver.send(NOD.format("b"))
    client = driver.run(10)
    assert not client.frames
    assert "b:end" in client.ids
    driver.session.update_backlog(1, 0)
    driver.run(11)
    assert [f.frame for f in client.frames] == list(range(251, 276))
    driver.send({"type": "state"})
    assert client.of("state")[0]["dropped"] == 251


def test_broadcast_skips_late_frames_after_a_stall(driver) -> None:
    driver.send({**FAP, "fps": 25})
    driver.now = 5.0
    driver.session.tick(driver.opened + 5.0)
    driver.collect()
    numbers = [f.frame for f in driver.clients[1].frames]
    assert numbers[-1] == 125
    assert len(numbers) < 20


def test_broadcast_sends_all_streams_side_by_side(driver) -> None:
    for stream, rate in (("fap", 25), ("au", 50), ("arkit", 10), ("mesh", 5)):
        driver.send(subscribe(stream, fps=rate))
    counts = dict.fromkeys(STREAMS, 0)
    for frame in driver.run(1.0).frames:
        counts[frame.stream] += 1
    rates = {"fap": 25, "au": 50, "arkit": 10, "mesh": 5}
    assert {stream: count for stream, count in counts.items() if count} == {
        k: n + 1 for k, n in rates.items()
    }


def test_broadcast_forgets_timelines_without_subscribers(driver) -> None:
    def alive() -> int:
        gc.collect()
        return sum(type(o) in (FrameTimeline, AudioStream) for o in gc.get_objects())

    before = alive()
    for k in range(20):
        driver.send(subscribe("fap", fps=10 + k / 7))
        driver.send(subscribe("audio", rate=8000 + 50 * k))
        driver.run(driver.now + 0.05)
    assert alive() == before + 2
