"""Frames for subscribers: each once, and at its time."""

from __future__ import annotations

import gc

import pytest

from realizer.protocol.streams import STREAMS
from realizer.server.streams.audio_stream import AudioStream
from realizer.server.streams.broadcast import LATE, PERIOD, RECOVERY, TIMELY, Overload
from realizer.server.streams.frame_windows import FrameTimeline
from tests.realizer.server.conftest import NOD

FAP = {"type": "subscribe", "stream": "fap"}
FPS = 25.0
ZERO = 100.0
FRAMES = 10


def subscribe(stream: str, **fields):
    return {"type": "subscribe", "stream": stream, **fields}


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
