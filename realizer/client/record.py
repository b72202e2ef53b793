"""Filming of a block over the wire: pictures and sound to a film."""

from __future__ import annotations

import asyncio
import errno
import io
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl, urlencode, urlsplit

import numpy as np

from bml_schema.feedback import BlockProgress
from realizer.client.message_router import ClientError
from realizer.core.array_types import Int16, UInt8
from realizer.protocol.wire import WireFrame

if TYPE_CHECKING:
    from realizer.client.async_client import Client

RATE = 48_000  # Hz
# Pictures on their way from service to encoder: good enough that the film's own encoder decides.
LOOK = {"format": "jpeg", "quality": 95}


async def record(client: Client, path: Path, bml: str, fps: float, look: Mapping[str, Any]) -> BlockProgress:
    """As `Client.film`, which see. A connection of its own: what the client subscribed to stays."""
    from realizer.client.connection import connect
    from realizer.core.atomic_files import replacing
    from realizer.outputs.film import FORMATS, encode_film

    if path.suffix.lower() not in FORMATS:
        raise ClientError(f"wanted a film ({' or '.join(FORMATS)}), got {path.name}", "film")
    if not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path.parent))
    async with connect(_joining(client.url, client.session), token=client._token) as camera:
        await camera.subscribe("video", fps=fps, **{**LOOK, **look})
        await camera.subscribe("audio", rate=RATE, **{k: v for k, v in look.items() if k == "character"})
        pictures: list[WireFrame] = []
        packets: list[WireFrame] = []
        taking = [
            asyncio.create_task(_take(camera, "video", pictures)),
            asyncio.create_task(_take(camera, "audio", packets)),
        ]
        await camera._wait(lambda: bool(pictures) or bool(camera.errors))
        until = await camera._follow(bml)
        await camera._wait(lambda: until.over)
        end = until.end()
        assert until.start is not None
        # The picture of the last instant is still being drawn.
        await camera._wait(lambda: bool(camera.errors) or pictures[-1].time >= end.global_time)
        if camera.errors:
            raise ClientError.of(camera.errors[0])
        for task in taking:
            task.cancel()
    count = int((end.global_time - until.start) * fps) + 1
    shown = _each(pictures, until.start, fps, count)
    sound = _sound(packets, until.start, count / fps)

    def write() -> None:
        with replacing(path) as draft:
            encode_film(draft, FORMATS[path.suffix.lower()], shown, count, fps, sound, RATE)

    await asyncio.to_thread(write)
    return end


async def _take(camera: Client, stream: str, kept: list[WireFrame]) -> None:
    async for frame in camera.frames(stream):
        assert isinstance(frame, WireFrame)
        kept.append(frame)


def _each(pictures: Sequence[WireFrame], start: float, fps: float, count: int) -> Iterator[UInt8]:
    """The newest picture at each frame of the film."""
    from PIL import Image

    at, decoded, known = 0, -1, np.empty(0, np.uint8)
    for k in range(count):
        # Frames of the service lie on its own grid: the film takes the nearest one.
        time = start + (k + 0.5) / fps
        while at + 1 < len(pictures) and pictures[at + 1].time <= time:
            at += 1
        if decoded != at:
            known, decoded = np.asarray(Image.open(io.BytesIO(pictures[at].payload)).convert("RGB")), at
        yield known


def _sound(packets: Sequence[WireFrame], start: float, seconds: float) -> Int16:
    """(n,) int16: each packet at its time; one that says so takes back what was to follow."""
    pcm = np.zeros(round(seconds * RATE), np.int16)
    for packet in packets:
        first = round((packet.time - start) * RATE)
        if packet.forget:
            pcm[max(0, first) :] = 0
        samples = np.frombuffer(packet.payload, "<i2")[max(0, -first) :]
        there = pcm[max(0, first) :][: len(samples)]
        there[:] = samples[: len(there)]
    return pcm


def _joining(url: str, session: str) -> str:
    """The address of another connection to the same session."""
    parts = urlsplit(url)
    others = [(name, value) for name, value in parse_qsl(parts.query) if name not in ("session", "seen")]
    return parts._replace(query=urlencode([*others, ("session", session)])).geturl()
