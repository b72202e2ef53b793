"""Recording of a block as a film, from the streams of pictures and sound."""

import asyncio
import contextlib
import errno
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractAsyncContextManager
from pathlib import Path
from typing import Any

import numpy as np

from bml_schema.feedback import BlockProgress
from realizer.client.errors import ClientError
from realizer.core.array_types import Int16, UInt8
from realizer.core.units import frame_count
from realizer.protocol.wire import PictureFrame, SoundFrame

RATE = 48_000  # Hz
# The quality of the pictures is better than that of the film's encoder.
LOOK = {"format": "jpeg", "quality": 95}


async def record(
    connection: AbstractAsyncContextManager[Any], path: Path, bml: str, fps: float, look: Mapping[str, Any]
) -> BlockProgress:
    """Play BML and save its last block as a film. Other arguments and errors are those of `Client.film`."""
    from realizer.core.atomic_files import replacing
    from realizer.outputs.film import FORMATS, encode_film

    if path.suffix.lower() not in FORMATS:
        raise ClientError(f"wanted a film ({' or '.join(FORMATS)}), got {path.name}", "film")
    if not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path.parent))
    async with connection as camera:
        await camera.subscribe("video", fps=fps, **{**LOOK, **look})
        await camera.subscribe("audio", rate=RATE, **{k: v for k, v in look.items() if k == "character"})
        pictures: list[PictureFrame] = []
        packets: list[SoundFrame] = []
        taking = [
            asyncio.create_task(_collect(camera, "video", pictures)),
            asyncio.create_task(_collect(camera, "audio", packets)),
        ]
        await camera.wait_for(lambda: bool(pictures) or bool(camera.errors))
        until = await camera.send_and_follow(bml)
        await camera.wait_for(lambda: until.is_finished)
        end: BlockProgress = until.end()
        assert until.start is not None
        # The last picture is still being drawn.
        await camera.wait_for(lambda: bool(camera.errors) or pictures[-1].time >= end.global_time)
        if camera.errors:
            raise ClientError.of(camera.errors[0])
        for task in taking:
            task.cancel()
    count = frame_count(round(end.global_time - until.start, 5), fps)  # feedback has times to the microsecond
    shown = _film_frames(pictures, until.start, fps, count)
    sound = _sound(packets, until.start, count / fps)

    def write() -> None:
        with replacing(path) as draft:
            encode_film(draft, FORMATS[path.suffix.lower()], shown, count, fps, sound, RATE)

    await asyncio.to_thread(write)
    return end


async def _collect(camera: Any, stream: str, kept: list[Any]) -> None:
    with contextlib.suppress(ClientError):  # `record` waits too, and raises it
        async for frame in camera.frames(stream):
            kept.append(frame)


def _film_frames(pictures: Sequence[PictureFrame], start: float, fps: float, count: int) -> Iterator[UInt8]:
    """Yield the newest picture at each frame of the film."""
    at, decoded, known = 0, -1, np.empty(0, np.uint8)
    for k in range(count):
        # The frame grids of the service and the film differ: take the nearest picture.
        time = start + (k + 0.5) / fps
        while at + 1 < len(pictures) and pictures[at + 1].time <= time:
            at += 1
        if decoded != at:
            known, decoded = pictures[at].pixels[..., :3], at
        yield known


def _sound(packets: Sequence[SoundFrame], start: float, seconds: float) -> Int16:
    """Return (n,) int16: each packet at its time; one with the flag `flush` cancels what was to follow."""
    pcm = np.zeros(round(seconds * RATE), np.int16)
    for packet in packets:
        first = round((packet.time - start) * RATE)
        if packet.flush:
            pcm[max(0, first) :] = 0
        samples = packet.values[max(0, -first) :]
        target = pcm[max(0, first) :][: len(samples)]
        target[:] = samples[: len(target)]
    return pcm
