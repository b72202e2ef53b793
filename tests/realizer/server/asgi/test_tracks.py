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
from realizer.server.asgi.playout import Playout
from realizer.server.asgi.tracks import PICTURE_CLOCK, RATE, SAMPLES, PictureTrack, SoundTrack


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
