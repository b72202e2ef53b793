"""Iterations over subscriptions, against the real service."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Any

import numpy as np
import pytest

from realizer.client import Client, ClientError, connect
from realizer.core.settings import Settings
from realizer.protocol.wire import (
    ArkitFrame,
    AUFrame,
    FapFrame,
    MeshFrame,
    PictureFrame,
    SoundFrame,
    WireFrame,
)
from realizer.server.serve import Server
from tests.realizer.client.service import LIMIT, serving


@pytest.mark.parametrize("ahead", [0, 0.2])
def test_client_yields_frames_without_those_taken_back(ahead: float) -> None:
    async def test(url: str) -> None:
        async with connect(url) as client, connect(f"{url}?session={client.session}") as other:
            await other.subscribe("fap")
            numbers, rows = [], {}
            async for frame in client.faps(ahead=ahead, fps=25):
                numbers.append(frame.frame)
                rows[frame.frame] = frame.values.tolist()
                if len(numbers) == 3:
                    await client.send('<bml id="b"><head id="n" lexeme="NOD"/></bml>')
                if len(numbers) == 30:
                    break
            assert numbers == sorted(numbers)
            # On a busy machine some are long past.
            assert numbers[-1] - numbers[0] + 1 - len(numbers) <= client.left_out.get("fap", 0)
            timely = {}
            async for frame in other.frames("fap"):
                assert isinstance(frame, WireFrame)
                timely[frame.frame] = frame.values.tolist()
                if frame.frame == numbers[-1]:
                    break
            # Frames that were due when the document was planned may have been yielded before it.
            differ = [k for k in numbers if k in timely and rows[k] != timely[k]]
            assert len(differ) <= 2
            assert (await client.ask("ping"))["type"] == "pong"

    serving(test)


def test_client_refuses_frames_too_far_ahead() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            with pytest.raises(ClientError, match="ahead"):
                await anext(client.aus(ahead=3))
            frame = await anext(client.aus(ahead=0.5))
            assert frame.stream == "au"
            assert (await anext(client.arkit())).values.shape == (59,)

    serving(test)


def iterations(client: Client) -> list[AsyncIterator[Any]]:
    methods = client.feedback, client.aus, client.faps, client.mesh, client.sound
    return [client.until_end("b"), client.frames("fap"), *(method() for method in methods)]


async def rest(items: AsyncIterator[Any]) -> list[Any]:
    return [item async for item in items]


def test_client_iterations_end_when_it_is_closed() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            tasks = [asyncio.create_task(rest(items)) for items in iterations(client)]
            await client.ask("ping")
            await client.close()
            await asyncio.gather(*tasks)
            assert await rest(client.feedback()) == []
            with pytest.raises(ClientError, match="has ended: it was closed here"):
                await client.wait_for(lambda: False)

    serving(test)


def test_client_iterations_raise_when_the_connection_is_lost() -> None:
    async def run() -> None:
        settings = Settings(port=0, voice="silent")
        async with asyncio.timeout(LIMIT), Server(settings) as server, connect(server.url) as client:
            tasks = [asyncio.create_task(rest(items)) for items in iterations(client)]
            await client.ask("ping")
            await server.close()
            for result in await asyncio.gather(*tasks, return_exceptions=True):
                assert isinstance(result, ClientError)
                assert str(result) == "the connection has ended: the service ends"

    asyncio.run(run())


@pytest.mark.parametrize(
    ("method", "kind", "shape", "dtype"),
    [
        ("faps", FapFrame, (68,), np.int32),
        ("aus", AUFrame, None, np.float32),
        ("arkit", ArkitFrame, (59,), np.float32),
        ("mesh", MeshFrame, None, np.int16),
        ("sound", SoundFrame, (441,), np.int16),
    ],
)
def test_client_has_a_method_for_each_stream_with_frames_of_its_type(
    method: str, kind: type[WireFrame[Any]], shape: tuple[int, ...] | None, dtype: type
) -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            frames = getattr(client, method)()
            first = asyncio.create_task(anext(frames))
            await client.ask("ping")
            if method == "sound":
                await client.say(np.full(8000, 500, np.int16), 8000)
            frame = await first
            assert type(frame) is kind
            assert frame.values.dtype == dtype
            assert shape in (None, frame.values.shape)
            if method in ("faps", "aus", "arkit"):
                assert len(frame.named) == len(frame.values)
            await frames.aclose()
            assert (await client.ask("ping"))["type"] == "pong"
            assert not client.errors

    serving(test)


@pytest.mark.gl
def test_client_yields_pictures() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            async for picture in client.pictures(fps=5, size=(64, 48), format="png"):
                assert type(picture) is PictureFrame
                assert picture.pixels.shape[:2] == (48, 64)
                break

    serving(test, limit=60)


def test_client_raises_when_a_stream_is_refused() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            for frames in (client.mesh(fps=-1), client.sound(rate=7), client.faps(ahead=9)):
                with pytest.raises(ClientError, match="wanted"):
                    await anext(frames)

    serving(test)


def test_client_has_streams_of_two_characters_side_by_side() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            for name in ("ada", "ben"):
                await client.control("character", id=name, face=name)
            meshes = [client.mesh(character=name) for name in ("ada", "ben")]
            frames = [await anext(mesh) for mesh in meshes for _ in range(2)]
            assert [frame.stream_info["face"] for frame in frames if frame.stream_info] == ["ada"] * 2 + [
                "ben"
            ] * 2

    serving(test)
