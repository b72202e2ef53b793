"""The Xface player transport against a rebuilt player, which reads, answers and shows as the real one."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import Awaitable, Callable

import pytest
from websockets.asyncio.client import connect

from realizer.animation.fap.fap_reader import read_fap
from realizer.core.errors import RealizerError
from realizer.core.settings import Settings
from realizer.server.serve import Server
from realizer.server.transports import reconnecting
from realizer.server.transports.xface import player as xface_player
from realizer.server.transports.xface.player import XfacePlayerTransport
from realizer.server.transports.xface.server import XfaceTransport

LIMIT = 30  # s; a hung test ends
CHUNK = 40_000  # bytes of one read of the player
TASK = re.compile(
    r'<task name="(\w+)" ownerId="(\d+)" taskId="(\d+)">(?:<param>(.*)</param>)?</task>\0', re.S
)
ERROR = '<notify name="ERROR" ownerId="0" taskId="0" status="7"/>'


class Player:
    """A real socket server. It takes each read for one task, and shows a clip only when it is stopped.

    Attributes:
        shown: the frames that were on its screen, {FAP: value that is not 0}.
        strays: reads that were no task, or two.
    """

    def __init__(self) -> None:
        self.shown: list[dict[int, int]] = []
        self.strays: list[str] = []
        self.clients = 0
        self.greets = True
        self.answers = True
        self.news = asyncio.Event()
        self._loaded: dict[int, int] | None = None
        self._writers: list[asyncio.StreamWriter] = []

    async def __aenter__(self) -> Player:
        await self.open(0)
        return self

    async def open(self, port: int) -> None:
        self._server = await asyncio.start_server(self._serve, "127.0.0.1", port)
        self.port = self._server.sockets[0].getsockname()[1]

    async def __aexit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """As when its window is closed."""
        self._server.close()
        for writer in self._writers:
            writer.transport.abort()
        self._writers.clear()

    async def until(self, there: Callable[[], bool]) -> None:
        while not there():
            self.news.clear()
            await self.news.wait()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writers.append(writer)
        self.clients += 1
        if self.greets:
            note = f'<notify name="CONNECTION_OK" ownerId="{self.clients}" taskId="0" status="0"/>\0\0'
            writer.write(note.encode())
        self.news.set()
        while data := await reader.read(CHUNK):
            found = TASK.fullmatch(data.decode())
            if found is None:
                self.strays.append(data.decode())
                writer.write(ERROR.encode() + b"\0\0")
            elif self.answers:
                for status in self._do(found[1], found[4]):
                    head = f'<notify name="{found[1]}" ownerId="{found[2]}" taskId="{found[3]}"'
                    writer.write(f'{head} status="{status}"/>\0\0'.encode())
                    await writer.drain()
            self.news.set()
        writer.close()

    def _do(self, name: str, param: str | None) -> tuple[int, ...]:
        if name == "STOP_PLAYBACK":
            if self._loaded is not None:
                self.shown.append(self._loaded)
            return (1, 3)
        if name != "UPLOAD_FAP" or param is None:
            return (1,)
        try:
            clip = read_fap(param)
        except RealizerError:
            return (1, 7, 3)
        assert clip.notes == (), clip.notes
        self._loaded = {fap + 1: int(value) for fap, value in enumerate(clip.values[0]) if value}
        return (1, 2, 3)


def playing(test: Callable[[Server, Player], Awaitable[None]], **settings: object) -> None:
    async def run() -> None:
        async with asyncio.timeout(LIMIT), Player() as player:
            chosen = Settings(
                port=0,
                xface_player=f"127.0.0.1:{player.port}",
                voice="silent",
                **({"idle": False, "xface_player_interval": 0.0} | settings),  # type: ignore[arg-type]
            )
            async with Server(chosen) as server:
                await test(server, player)

    asyncio.run(run())


async def hold(server: Server, text: str, session: str = "xface-player") -> None:
    """Set FAPs of a session."""
    async with connect(f"{server.url}?session={session}") as client:
        await client.send(text)
        await client.send('{"type":"ping"}')
        while '"pong"' not in str(await client.recv()):
            pass


def test_player_shows_the_character_of_the_session() -> None:
    async def test(server: Server, player: Player) -> None:
        await hold(server, '{"type":"set","faps":{"open_jaw":500,"head_yaw":-9000}}')
        await player.until(lambda: {3: 500, 49: -9000} in player.shown)
        await hold(server, '{"type":"set","faps":{"open_jaw":null,"head_yaw":0}}')
        await player.until(lambda: player.shown[-1] == {})
        assert player.strays == []
        assert len(player.shown) > 3, "on the way there it was seen to move"

    playing(test)


def test_player_shows_blocks() -> None:
    async def test(server: Server, player: Player) -> None:
        nod = '<bml id="b"><head id="n" lexeme="NOD" start="0" end="1"/></bml>'
        await hold(server, nod)
        await player.until(lambda: any(frame.get(48, 0) > 3000 for frame in player.shown))
        assert player.strays == []

    playing(test)


def test_player_shows_another_session_by_its_setting() -> None:
    async def test(server: Server, player: Player) -> None:
        await hold(server, '{"type":"set","faps":{"open_jaw":500}}', "asap-127.0.0.1")
        await player.until(lambda: {3: 500} in player.shown)

    playing(test, xface_player_session="asap-127.0.0.1")


def test_player_shows_the_newest_frame_at_the_interval_of_paul() -> None:
    async def test(server: Server, player: Player) -> None:
        for value in range(100, 600, 100):
            await hold(server, f'{{"type":"set","faps":{{"open_jaw":{value}}}}}')
        await player.until(lambda: {3: 500} in player.shown)
        assert player.strays == []

    playing(test, xface_player_interval=0.25)


def test_player_may_be_another_service() -> None:
    async def run() -> None:
        common = {"port": 0, "voice": "silent", "idle": False}
        async with asyncio.timeout(LIMIT), Server(Settings(**common, xface_port=0)) as showing:  # type: ignore[arg-type]
            port = next(
                transport for transport in showing.transports if isinstance(transport, XfaceTransport)
            ).port
            pushing = Settings(**common, xface_player=f"127.0.0.1:{port}", xface_player_interval=0.0)  # type: ignore[arg-type]
            async with Server(pushing) as server, connect(f"{showing.url}?session=xface-127.0.0.1") as viewer:
                await hold(server, '{"type":"set","faps":{"open_jaw":500}}')
                await viewer.send('{"type":"subscribe","stream":"fap","encoding":"json"}')
                async for message in viewer:
                    if '"values"' in str(message) and json.loads(message)["values"][2] == 500:
                        return

    asyncio.run(run())


def test_player_prints_its_line_once_it_is_greeted() -> None:
    async def test(server: Server, player: Player) -> None:
        transport = next(
            transport for transport in server.transports if isinstance(transport, XfacePlayerTransport)
        )
        await transport.ready()
        assert transport.startup_lines == (
            f"xface player: 127.0.0.1:{player.port} shows session xface-player",
        )

    playing(test)


def test_player_that_comes_back_is_found_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reconnecting, "FIRST_RETRY", 0.01)
    monkeypatch.setattr(reconnecting, "LAST_RETRY", 0.02)

    async def test(server: Server, player: Player) -> None:
        await hold(server, '{"type":"set","faps":{"open_jaw":500}}')
        await player.until(lambda: {3: 500} in player.shown)
        player.close()
        player.shown.clear()
        await player.open(player.port)
        await player.until(lambda: {3: 500} in player.shown)
        assert player.clients == 2

    playing(test)


def test_player_that_is_gone_leaves_the_session() -> None:
    async def test(server: Server, player: Player) -> None:
        await hold(server, '{"type":"set","faps":{"open_jaw":500}}')
        await player.until(lambda: {3: 500} in player.shown)
        player.close()
        while server._sessions.health()["connections"]:
            await asyncio.sleep(0.01)

    playing(test)


@pytest.mark.parametrize("lost", ["a session that fails", "a player that reads nothing"])
def test_player_reconnects_after(lost: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reconnecting, "FIRST_RETRY", 0.01)

    async def test(server: Server, player: Player) -> None:
        await hold(server, '{"type":"set","faps":{"open_jaw":500}}')
        await player.until(lambda: {3: 500} in player.shown)
        if lost == "a session that fails":
            next(d for d in server.transports if isinstance(d, XfacePlayerTransport)).disconnect(
                1011, "internal error"
            )
        else:
            monkeypatch.setattr(xface_player, "MAX_UNREAD", -1)  # any number of bytes is more
            await hold(server, '{"type":"set","faps":{"open_jaw":600}}')
        await player.until(lambda: player.clients > 1)

    playing(test)


def test_player_without_a_greeting_is_given_up(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(xface_player, "CONNECT_TIMEOUT", 0.05)
    monkeypatch.setattr(reconnecting, "FIRST_RETRY", 0.01)

    async def test(server: Server, player: Player) -> None:
        player.greets = False
        await player.until(lambda: player.clients > 2)
        assert not player.strays
        assert not player.shown

    playing(test)
    warnings = [record.getMessage() for record in caplog.records if "no player" in record.getMessage()]
    assert len(warnings) == 1
    assert re.fullmatch(
        r"xface player: no player at 127\.0\.0\.1:\d+ \(nobody answers\); looking for it", warnings[0]
    )


def test_player_that_never_answers_delays_nothing() -> None:
    async def test(server: Server, player: Player) -> None:
        player.answers = False
        await hold(server, '{"type":"set","faps":{"open_jaw":500}}')
        async with connect(server.url) as other:
            await other.send('<bml id="b"><wait id="w" duration="0.05"/></bml>')
            while 'id="b:end"' not in str(await other.recv()):
                pass
        assert player.shown == []

    playing(test)
