"""The client against the real service: send, follow a block to its end, iterate frames, be told of errors."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator

import pytest

from bml_schema.feedback import WarningFeedback
from realizer.client import ClientError, connect, connect_sync
from realizer.server.serve import Server
from realizer.server.wire import WireFrame
from realizer.settings import Settings

WAIT = '<bml id="{}"><wait id="w" duration="0.1"/></bml>'
LIMIT = 30  # s


def serving(test) -> None:
    async def run() -> None:
        async with asyncio.timeout(LIMIT), Server(Settings(port=0, voice="silent")) as server:
            await test(server.url)

    asyncio.run(run())


def test_a_block_is_followed_to_its_end() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            await client.send(WAIT.format("b"))
            ids = [getattr(f, "id", None) async for f in client.until_end()]
            assert [i for i in ids if i] == ["b:start", "b:w:start", "b:w:end", "b:end"]
            await client.send(WAIT.format("c"))
            assert [f async for f in client.until_end("c")][-1].id == "c:end"

    serving(test)


def test_a_refused_block_ends_the_waiting() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            await client.send('<bml id="b"><required><head id="n" lexeme="NONE"/></required></bml>')
            assert isinstance([f async for f in client.until_end()][-1], WarningFeedback)
            await client.send("<bml id='x'><oops")
            assert isinstance([f async for f in client.until_end()][-1], WarningFeedback)

    serving(test)


def test_what_is_planned_is_followed_and_does_not_mix_with_answers() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            await client.subscribe("schedule")
            await client.send(WAIT.format("b"))
            told = []
            async for message in client.frames("schedule"):
                assert isinstance(message, dict)
                told += [block["state"] for block in message["blocks"]]
                if "DONE" in told:
                    break
            assert told[0] != "DONE"
            assert (await client.ask("ping"))["type"] == "pong"

    serving(test)


def test_frames_of_two_streams_do_not_mix() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            told = await client.subscribe("fap", fps=50)
            await client.subscribe("au", fps=50, encoding="json")
            assert len(told["names"]) == 68
            numbers = []
            async for frame in client.frames("fap"):
                assert isinstance(frame, WireFrame)
                numbers.append(frame.frame)
                if len(numbers) == 5:
                    break
            assert numbers == list(range(told["frame"], told["frame"] + 5))
            async for frame in client.frames("au"):
                assert frame["type"] == "au"
                break

    serving(test)


def test_an_error_of_the_service_is_raised() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            with pytest.raises(ClientError, match="wanted a stream of"):
                await client.subscribe("smell")
            assert (await client.ask("ping"))["type"] == "pong"

    serving(test)


def test_feedback_ends_with_the_connection() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            await client._socket.close()
            assert [f async for f in client.feedback()] == []
            with pytest.raises(ClientError, match="has ended"):
                await client._wait(lambda: False)

    serving(test)


def test_nobody_there_is_an_os_error() -> None:
    async def run() -> None:
        async with Server(Settings(port=0, voice="silent")) as server:
            url = server.url
        with pytest.raises(OSError, match="Connect"):
            async with connect(url):
                pass

    asyncio.run(run())


@pytest.fixture
def url() -> Iterator[str]:
    """A service in a thread of its own, for clients without an event loop."""
    started, urls, stop = threading.Event(), [], []

    async def run() -> None:
        async with Server(Settings(port=0, voice="silent")) as server:
            urls.append(server.url)
            ended = asyncio.Event()
            loop = asyncio.get_running_loop()
            stop.append(lambda: loop.call_soon_threadsafe(ended.set))
            started.set()
            await ended.wait()

    thread = threading.Thread(target=lambda: asyncio.run(run()))
    thread.start()
    assert started.wait(LIMIT)
    yield urls[0]
    stop[0]()
    thread.join(LIMIT)
    assert not thread.is_alive()


def test_the_plain_client_does_the_same(url) -> None:
    with connect_sync(url) as client:
        client.send(WAIT.format("b"))
        assert list(client.until_end())[-1].id == "b:end"
        client.subscribe("fap", fps=50)
        assert len(next(client.frames("fap")).values) == 68
        with pytest.raises(ClientError, match="wanted a stream of"):
            client.subscribe("smell")
