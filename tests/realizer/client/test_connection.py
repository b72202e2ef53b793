"""The connection of a client: its loss, and messages that it cannot read."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.server import ServerConnection, serve

from realizer.client import Client, ClientError, connect
from realizer.core.settings import Settings
from realizer.server.serve import Server
from tests.realizer.client.service import LIMIT, WAIT, serving

SHOW = "session=show"
WELCOME = '{"type":"welcome","version":1,"session":"show","time":0,"seq":0}'
PLANNED = (
    '<predictionFeedback xmlns="http://www.bml-initiative.org/bml/bml-1.0" xmlns:r="urn:bml-realizer:1" '
    'xmlns:bmla="http://www.asap-project.org/bmla" r:seq="1"><bml id="b" globalStart="0" globalEnd="1" '
    'bmla:status="IN_PREP"/></predictionFeedback>'
)
Answer = Callable[[ServerConnection], Awaitable[None]]


@pytest.fixture(autouse=True)
def impatience(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("realizer.client.connection.PAUSE", 0.01)


@pytest.mark.parametrize(
    "say",
    [
        lambda client: client.send(WAIT.format("b")),
        lambda client: client.play(WAIT.format("b")),
        lambda client: client.control("stop"),
        lambda client: client.ask("ping"),
        lambda client: client.subscribe("fap"),
    ],
)
def test_connection_raises_its_own_error_after_the_end_of_the_connection(say: Any) -> None:
    async def run() -> None:
        settings = Settings(port=0, voice="silent")
        async with asyncio.timeout(LIMIT), Server(settings) as server, connect(server.url) as client:
            await server.close()
            with pytest.raises(ClientError, match="the connection has ended: the service ends") as caught:
                await say(client)
            assert caught.value.code == "connection"

    asyncio.run(run())


def test_connection_raises_to_all_that_wait_if_a_message_is_unreadable() -> None:
    async def answer(socket: ServerConnection) -> None:
        await socket.recv()
        await socket.send('{"type":"welcome","version":1,"session":"a","time":0,"seq":0}')
        await socket.recv()
        await socket.send(b"no frame")
        await socket.wait_closed()

    async def run() -> None:
        async with serve(answer, "127.0.0.1", 0) as server:
            port = next(iter(server.sockets)).getsockname()[1]
            async with connect(f"ws://127.0.0.1:{port}/ws") as client:
                waits = client.frames("fap"), client.feedback(), client.until_end("b")
                tasks = [asyncio.ensure_future(anext(wait)) for wait in waits]
                await client.send(WAIT.format("b"))
                for result in await asyncio.gather(*tasks, return_exceptions=True):
                    assert isinstance(result, ClientError)
                    assert "cannot be read: WireError('wanted a header of 16 bytes" in str(result)

    asyncio.run(asyncio.wait_for(run(), LIMIT))


def lose(client: Client) -> None:
    """Cut the connection of a client as a network does."""
    client._connection._socket.transport.abort()


async def acknowledged(client: Client) -> None:
    await client.wait_for(lambda: bool(client._router.last_sent and client._router.last_sent.is_acknowledged))


def test_connection_that_was_lost_goes_on_with_blocks_and_feedback() -> None:
    async def test(url: str) -> None:
        async with connect(f"{url}?{SHOW}") as client:
            end = asyncio.create_task(client.play('<bml id="b"><wait id="w" duration="0.4"/></bml>'))
            await client.ask("ping")
            await acknowledged(client)
            lose(client)
            assert (await end).status == "DONE"
            assert (await client.play(WAIT.format("c"))).id == "c:end"
            numbers = [feedback.seq async for feedback in client.until_end("c")]
            assert numbers == list(range(1, len(numbers) + 1))

    serving(test, real_time=True)


def test_connection_that_was_lost_subscribes_and_asks_again() -> None:
    async def test(url: str) -> None:
        async with connect(f"{url}?{SHOW}") as client:
            frames, arriving = client.faps(fps=50), client.frames("au")
            await client.subscribe("au", fps=50)
            await anext(frames)
            await anext(arriving)
            lose(client)
            assert (await client.ask("ping", id=1))["id"] == 1
            client._router.queue_of("au").clear()
            await anext(arriving)
            await anext(frames)
            lose(client)
            await frames.aclose()
            assert (await client.ask("ping", id=2))["id"] == 2

    serving(test)


def test_connection_that_was_lost_raises_for_an_open_speech_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("realizer.client.connection.PAUSE", LIMIT)

    async def test(url: str) -> None:
        async with connect(f"{url}?{SHOW}") as client:
            speech = client.speech("s")
            await speech.append("Hello there. ")
            await client.ask("ping")
            lose(client)
            with pytest.raises(ClientError, match="lost while the speech was open"):
                await speech.ended()
            with pytest.raises(ClientError, match="lost while the speech was open"):
                await speech.append("And good bye.")

    serving(test)


def test_connection_goes_on_after_a_restart_with_a_journal(tmp_path: Path) -> None:
    async def run() -> None:
        settings = Settings(port=0, voice="silent", journal=str(tmp_path / "sessions.db"))
        async with asyncio.timeout(LIMIT):
            server = await Server(settings).start()
            async with connect(f"{server.url}?{SHOW}") as client:
                end = asyncio.create_task(client.play('<bml id="b"><wait id="w" duration="2"/></bml>'))
                await client.ask("ping")
                await acknowledged(client)
                await server.close()
                async with Server(replace(settings, port=server.port)):
                    assert (await end).status == "DONE"

    asyncio.run(run())


async def answering(answers: Sequence[Answer], test: Callable[[Client], Awaitable[None]]) -> None:
    """Run a test against a service that answers its connections after `hello`, each in its own way."""
    left = iter(answers)

    async def answer(socket: ServerConnection) -> None:
        assert '"hello"' in await socket.recv()
        await next(left)(socket)

    async with asyncio.timeout(LIMIT), serve(answer, "127.0.0.1", 0) as server:
        port = next(iter(server.sockets)).getsockname()[1]
        async with connect(f"ws://127.0.0.1:{port}/ws?{SHOW}") as client:
            await test(client)


async def acknowledge_one(socket: ServerConnection) -> None:
    await socket.send(WELCOME)
    await socket.recv()
    await socket.send(PLANNED)


async def ignore_one(socket: ServerConnection) -> None:
    await socket.send(WELCOME)
    await socket.recv()


async def stay(socket: ServerConnection) -> None:
    await socket.send(WELCOME)
    await socket.wait_closed()


async def miss(socket: ServerConnection) -> None:
    assert socket.request is not None
    assert socket.request.path.endswith("?session=show&seen=1")
    await socket.send('{"type":"gap","seen":1,"first":1}')
    await stay(socket)


async def refuse(socket: ServerConnection) -> None:
    await socket.close(1008, "token: it has expired")


def test_connection_raises_for_a_block_that_was_not_acknowledged() -> None:
    async def test(client: Client) -> None:
        with pytest.raises(ClientError, match="before the service acknowledged the block: send it again"):
            await client.play(WAIT.format("b"))

    asyncio.run(answering([ignore_one, stay], test))


def test_connection_raises_where_feedback_is_missing() -> None:
    async def test(client: Client) -> None:
        end = asyncio.create_task(client.play(WAIT.format("b")))
        heard = [feedback async for feedback in limited(client.until_end("b"))]
        assert isinstance(heard[-1], ClientError)
        for error in (heard[-1], (await asyncio.gather(end, return_exceptions=True))[0]):
            assert isinstance(error, ClientError)
            assert error.code == "gap"
        assert "the session has begun anew" in str(heard[-1])

    async def limited(items: AsyncIterator[Any]) -> AsyncIterator[Any]:
        try:
            async for item in items:
                yield item
        except ClientError as error:
            yield error

    asyncio.run(answering([acknowledge_one, miss], test))


def test_connection_raises_at_once_if_the_service_refuses_it() -> None:
    async def test(client: Client) -> None:
        with pytest.raises(ClientError, match="token: it has expired"):
            await client.play(WAIT.format("b"))

    asyncio.run(answering([acknowledge_one, refuse], test))


def test_connection_raises_if_the_service_does_not_return(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("realizer.client.connection.PATIENCE", 0.02)

    async def run() -> None:
        settings = Settings(port=0, voice="silent")
        async with (
            asyncio.timeout(LIMIT),
            Server(settings) as server,
            connect(f"{server.url}?{SHOW}") as client,
        ):
            await server.close()
            with pytest.raises(ClientError, match=r"ends, and there was no new one for 0.02 s: .* Connect"):
                await client.play(WAIT.format("b"))

    asyncio.run(run())


def test_connection_that_connects_again_can_be_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("realizer.client.connection.PAUSE", LIMIT)

    async def test(client: Client) -> None:
        feedback = asyncio.create_task(anext(client.feedback(), None))
        await client.send(WAIT.format("b"))
        await client._connection._socket.wait_closed()
        await client.close()
        assert await feedback is None

    asyncio.run(answering([ignore_one], test))


def test_connection_that_shall_not_return_raises_at_once() -> None:
    async def test(url: str) -> None:
        async with connect(f"{url}?{SHOW}", reconnect=False) as client:
            lose(client)
            with pytest.raises(ClientError, match="the connection has ended"):
                await client.play(WAIT.format("b"))

    serving(test)
