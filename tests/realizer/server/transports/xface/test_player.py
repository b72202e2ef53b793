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
from realizer.server.transports.xface.player import NUMBERS, PATIENCE, PlayerLink, State, XfacePlayerTransport
from realizer.server.transports.xface.server import XfaceTransport
from realizer.server.transports.xface.wire import Task, TaskReader, pack_note
from tests.waiting import LIMIT, wait_for

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
        await wait_for(lambda: not server._sessions.health()["connections"])

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


def frame(**faps: int) -> list[int]:
    values = [0] * 68
    for name, value in faps.items():
        values[int(name[3:]) - 1] = value
    return values


def note(task: Task, *statuses: int) -> bytes:
    return b"".join(pack_note(task.name, task.owner, task.id, status) for status in statuses)


def due(link: PlayerLink, now: float) -> Task | None:
    """The one task that is due."""
    data = link.due(now)
    if data is None:
        return None
    (task,) = TaskReader(10_000).feed(data)
    assert isinstance(task, Task)
    assert data.endswith(b"</task>\0")
    return task


@pytest.fixture
def link() -> PlayerLink:
    """Connected, greeted as client 3, with Paul's interval."""
    link = PlayerLink(0.25)
    link.on_connect()
    link.receive(pack_note("CONNECTION_OK", 3, 0, 0))
    return link


def shown(link: PlayerLink, now: float) -> dict[int, int]:
    """Play the player: take the upload and the stop, and say that they are done."""
    upload = due(link, now)
    assert upload is not None
    assert upload.name == "UPLOAD_FAP"
    link.receive(note(upload, 1, 2, 3))
    stop = due(link, now)
    assert stop is not None
    assert (stop.name, stop.params) == ("STOP_PLAYBACK", ())
    link.receive(note(stop, 1, 3))
    clip = read_fap(upload.params[0])
    assert clip.notes == ()
    assert len(clip.values) == 1
    return {fap: int(clip.values[0, fap - 1]) for fap in range(1, 69) if clip.mask[fap - 1]}


def test_player_link_sends_nothing_before_the_greeting() -> None:
    link = PlayerLink(0.25)
    link.show(frame(fap3=100))
    assert link.due(0.0) is None
    link.on_connect()
    assert (link.state, link.due(0.0), link.next_deadline()) == (State.GREETING, None, None)
    link.receive(pack_note("CONNECTION_OK", 3, 0, 0)[:30])
    assert link.due(0.0) is None
    link.receive(pack_note("CONNECTION_OK", 3, 0, 0)[30:])
    assert due(link, 0.0) is not None


def test_player_link_sends_a_frame_as_an_upload_and_a_stop(link: PlayerLink) -> None:
    link.show(frame(fap3=500, fap48=-4000))
    upload = due(link, 0.0)
    assert upload is not None
    assert (upload.name, upload.owner, upload.id) == ("UPLOAD_FAP", 3, 3 * NUMBERS + 1)
    assert upload.params[0].startswith("2.1 realizer 25 1\n")
    assert due(link, 0.0) is None, "the player takes two tasks in one read for one"
    link.receive(note(upload, 1, 2))
    assert (due(link, 0.0), link.state) == (None, State.UPLOADING)
    link.receive(note(upload, 3))
    stop = due(link, 0.0)
    assert stop == Task("STOP_PLAYBACK", 3, 3 * NUMBERS + 2)
    link.receive(note(stop, 1))
    assert link.state is State.STOPPING
    link.receive(note(stop, 3))
    assert link.state.name == "READY"


def test_player_link_leaves_out_zeros_and_compound_faps(link: PlayerLink) -> None:
    link.show(frame(fap1=3, fap2=1, fap3=500, fap48=-4000))
    assert shown(link, 0.0) == {3: 500, 48: -4000}
    link.show(frame())
    assert shown(link, 1.0) == {}


def test_player_link_waits_for_the_interval_and_sends_the_newest(link: PlayerLink) -> None:
    link.show(frame(fap3=1))
    assert shown(link, 10.0) == {3: 1}
    link.show(frame(fap3=2))
    link.show(frame(fap3=3))
    assert due(link, 10.2) is None
    assert link.next_deadline() == 10.25
    assert shown(link, 10.25) == {3: 3}


def test_player_link_without_an_interval_waits_for_notes_only() -> None:
    link = PlayerLink(0.0)
    link.on_connect()
    link.receive(pack_note("CONNECTION_OK", 1, 0, 0))
    for value in (1, 2, 3):
        link.show(frame(fap3=value))
        assert shown(link, 5.0) == {3: value}


def test_player_link_sends_an_unchanged_face_once(link: PlayerLink) -> None:
    link.show(frame(fap3=1))
    shown(link, 0.0)
    link.show(frame(fap3=1))
    assert (link.due(9.0), link.next_deadline()) == (None, None)


def test_player_link_goes_on_after_a_task_without_a_note(link: PlayerLink) -> None:
    link.show(frame(fap3=1))
    assert due(link, 0.0) is not None
    link.show(frame(fap3=2))
    assert link.next_deadline() == PATIENCE
    assert due(link, PATIENCE - 0.1) is None
    stop = due(link, PATIENCE)
    assert stop is not None
    assert stop.name == "STOP_PLAYBACK"
    assert link.next_deadline() == 2 * PATIENCE
    upload = due(link, 2 * PATIENCE)
    assert upload is not None
    assert upload.name == "UPLOAD_FAP"


def test_player_link_logs_a_failed_task_once_and_goes_on(
    link: PlayerLink, caplog: pytest.LogCaptureFixture
) -> None:
    for time, value in ((0.0, 1), (1.0, 2)):
        link.show(frame(fap3=value))
        upload = due(link, time)
        assert upload is not None
        link.receive(note(upload, 1, 7, 3))
        stop = due(link, time)
        assert stop is not None
        link.receive(note(stop, 1, 3))
    assert [record.getMessage() for record in caplog.records] == ["xface player: it cannot do UPLOAD_FAP"]


def test_player_link_ignores_notes_about_old_tasks(link: PlayerLink) -> None:
    link.show(frame(fap3=1))
    upload = due(link, 0.0)
    assert upload is not None
    link.receive(note(Task("UPLOAD_FAP", 3, 77), 3) + note(Task("STOP_PLAYBACK", 3, upload.id - 1), 3))
    assert link.state is State.UPLOADING


def test_player_link_begins_anew_with_a_connection(link: PlayerLink) -> None:
    link.show(frame(fap3=1))
    shown(link, 0.0)
    link.on_disconnect()
    assert (link.due(9.0), link.next_deadline()) == (None, None)
    link.on_connect()
    link.receive(pack_note("CONNECTION_OK", 8, 0, 0))
    upload = due(link, 0.1)
    assert upload is not None
    assert (upload.owner, upload.id) == (8, 8 * NUMBERS + 1)


def test_player_link_refuses_a_second_connection(link: PlayerLink) -> None:
    with pytest.raises(AssertionError, match="connected already"):
        link.on_connect()
