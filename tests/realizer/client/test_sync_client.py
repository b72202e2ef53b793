"""The client without an event loop, against the real service in a thread."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator

import pytest

from realizer.client import ClientError, connect
from realizer.core.settings import Settings
from realizer.protocol.wire import WireFrame
from realizer.server.serve import Server
from tests.realizer.client.service import LIMIT, WAIT


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


def test_sync_client_does_what_the_async_client_does(url) -> None:
    with connect(url) as client:
        client.send(WAIT.format("b"))
        assert list(client.until_end())[-1].id == "b:end"
        client.subscribe("fap", fps=50)
        assert len(next(client.frames("fap")).values) == 68
        with pytest.raises(ClientError, match="wanted a stream of"):
            client.subscribe("smell")
        with pytest.raises(ClientError, match=r"stop\.blocks: "):
            client.control("stop", blocks=["nobody"])
        assert client.ask("state")["type"] == "state"


def test_sync_client_yields_frames_until_it_stops(url) -> None:
    with connect(url) as client:
        numbers = [frame.frame for frame, _ in zip(client.faps(), range(5), strict=False)]
        assert numbers == list(range(numbers[0], numbers[0] + 5))
        assert len(next(client.aus(ahead=0, fps=50)).values) > 60
        assert client.ask("ping")["type"] == "pong"


def test_sync_client_shares_a_session(url) -> None:
    with connect(f"{url}?session=show") as manager, connect(f"{url}?session=show") as viewer:
        subscribed = viewer.subscribe("arkit", fps=50)
        end = manager.play(WAIT.format("b"))
        assert end.id == "b:end"
        assert [f.seq for f in viewer.until_end("b")][-1] == end.seq
        frames = viewer.frames("arkit")
        first, second = next(frames), next(frames)
        assert isinstance(first, WireFrame)
        assert isinstance(second, WireFrame)
        assert second.frame == first.frame + 1
        assert len(first.values) == len(subscribed["names"]) == 59
        assert manager.state()["connections"] == 2
        assert manager.session == viewer.session == "show"
        assert manager.errors == []


def test_sync_client_raises_a_refusal_and_ends_its_thread(url) -> None:
    with connect(url) as client:
        with pytest.raises(ClientError, match="lexeme"):
            client.play('<bml id="b"><required><head id="n" lexeme="NONE"/></required></bml>')
        assert client.url == url
    assert "realizer client" not in [thread.name for thread in threading.enumerate()]


def test_sync_client_restores_a_lost_connection(url) -> None:
    async def lose() -> None:
        client._original._connection._socket.transport.abort()

    with connect(f"{url}?session=lost") as client:
        client._thread.do(lose())
        assert client.play(WAIT.format("b")).status == "DONE"
    with connect(f"{url}?session=lost", reconnect=False) as client:
        client._thread.do(lose())
        with pytest.raises(ClientError, match="the connection has ended"):
            list(client.until_end("b"))


def test_sync_client_close_twice_does_nothing_more(url) -> None:
    with connect(url) as client:
        client.close()
        with pytest.raises(ClientError, match="the connection has ended"):
            client.play(WAIT.format("b"))
        with pytest.raises(ClientError, match="the connection has ended"):
            next(client.feedback())
    client.close()


def test_sync_client_raises_os_error_where_nothing_listens() -> None:
    with pytest.raises(OSError, match="Connect"), connect("ws://127.0.0.1:9/ws"):
        pass
