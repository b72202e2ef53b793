"""Tracks of pictures and of sound, as a WebRTC connection reads them."""

from __future__ import annotations

import asyncio
import io
from collections.abc import Awaitable, Callable
from typing import Any

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("aiortc", reason="needs the webrtc extra")

from aiortc.mediastreams import MediaStreamError

from realizer.protocol.wire import pack, unpack
from realizer.server.http.tracks import (
    FIRST,
    LOST,
    MOST,
    PICTURE_CLOCK,
    RATE,
    SAMPLES,
    WINDOW,
    PictureTrack,
    Playout,
    SoundTrack,
)


def played(act: Callable[[Playout], Awaitable[Any]]) -> Any:
    """Run `act` with the playout of a session that opens now."""

    async def run() -> Any:
        now = asyncio.get_running_loop().time()
        return await act(Playout(now, now))

    return asyncio.run(run())


def sound(number: int, level: int = 1000, *, flush: bool = False, count: int = SAMPLES) -> Any:
    samples = np.full(count, level, "<i2").tobytes()
    return unpack(pack("audio", number, number * 0.02, samples, flush=flush))


def picture(time: float, grey: int = 128) -> Any:
    stored = io.BytesIO()
    Image.new("RGB", (32, 32), (grey, grey, grey)).save(stored, "JPEG")
    return unpack(pack("video", round(time * 25), time, stored.getvalue()))


def test_tracks_give_one_time_of_the_session_one_timestamp() -> None:
    async def act(playout: Playout) -> tuple[float, float]:
        sounds, pictures = SoundTrack(playout), PictureTrack(playout)
        for number in range(20):
            sounds.put(sound(number, level=1000 if number == 5 else 0))
        pictures.put(picture(0.1))  # packet 5
        frames = [await sounds.recv() for _ in range(12)]
        (loud,) = (frame for frame in frames if frame.to_ndarray().any())
        return loud.pts / RATE, (await pictures.recv()).pts / PICTURE_CLOCK

    heard, seen = played(act)
    assert heard == pytest.approx(seen, abs=0.001)


def test_sound_track_is_silent_between_packets_and_forgets_sound() -> None:
    async def act(playout: Playout) -> list[int]:
        track = SoundTrack(playout)
        for number in (0, 1, 3):
            track.put(sound(number))
        track.put(sound(3, flush=True, count=0))
        return [int((await track.recv()).to_ndarray().max()) for _ in range(11)]

    levels = played(act)
    assert sum(level > 0 for level in levels) == 2
    assert levels[-1] == 0


def test_sound_track_keeps_no_packets_whose_time_is_over() -> None:
    async def act(playout: Playout) -> int:
        track = SoundTrack(playout)
        for _ in range(8):
            await track.recv()
        for number in range(3):
            track.put(sound(number))
        await track.recv()
        return len(track._packets)

    assert played(act) == 0


def test_picture_track_leaves_out_pictures_that_are_overdue() -> None:
    async def act(playout: Playout) -> int:
        track = PictureTrack(playout)
        for k, time in enumerate((4.0, 4.1, 4.2)):
            track.put(picture(time, 50 * k))
        playout.offset -= 4.5  # they were due before
        playout.began = playout.offset
        return int((await track.recv()).to_ndarray(format="gray").mean())

    assert played(act) == pytest.approx(100, abs=8)


def test_picture_track_gives_pictures_earlier_where_encoding_takes_long() -> None:
    async def act(playout: Playout) -> tuple[float, float]:
        track = PictureTrack(playout)
        first = track._due(0.0)
        track.put(picture(0.1))
        await track.recv()
        track._taken -= 0.5  # s; encoding it has taken that long
        track.put(picture(0.2))
        await track.recv()
        return first, track._due(0.0)

    first, now = played(act)
    assert first - now == pytest.approx(0.05, abs=0.03)


def test_tracks_end_when_they_are_stopped() -> None:
    async def act(playout: Playout) -> None:
        pictures, sounds = PictureTrack(playout), SoundTrack(playout)
        waiting = asyncio.ensure_future(pictures.recv())
        await asyncio.sleep(0)
        pictures.stop()
        sounds.stop()
        with pytest.raises(MediaStreamError):
            await waiting
        with pytest.raises(MediaStreamError):
            await sounds.recv()

    played(act)


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
