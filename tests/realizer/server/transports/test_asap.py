"""The Asap TCP transport on loopback, with a client written only from the description of the protocol."""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
from collections.abc import Awaitable, Callable
from xml.etree import ElementTree

import pytest
from websockets.asyncio.client import connect

from bml_schema.feedback import (
    BlockProgress,
    Feedback,
    PredictionFeedback,
    SyncPointProgress,
    WarningFeedback,
    parse_feedback,
)
from realizer.core.settings import Settings
from realizer.server.runtime import session_host
from realizer.server.serve import Server
from realizer.server.transports import asap
from realizer.server.transports.asap import AsapTransport
from tests.waiting import LIMIT

CORE = "{http://www.bml-initiative.org/bml/bml-1.0}"
NOD = '<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="{}">\n<head id="n" lexeme="NOD"/>\n</bml>\n'
WAIT = '<bml id="{}"><wait id="w" duration="{}"/></bml>\n'


def free_port(host: str = "127.0.0.1") -> int:
    with socket.socket() as taken:
        taken.bind((host, 0))
        return taken.getsockname()[1]


class Client:
    """A client that sends BML to one port, and listens on another once the first connection is open.

    The feedback is one XML element after the other; an incremental parser, not a splitter of lines,
    finds their ends, as in the clients there are.
    """

    def __init__(self, bml_port: int, feedback_port: int, host: str = "127.0.0.1") -> None:
        self.ports = (bml_port, feedback_port)
        self.host = host
        self.raw = b""
        self.feedback: list[Feedback] = []
        self.called_back = asyncio.Event()
        self.gone = asyncio.Event()  # the server closed the feedback connection
        self._news = asyncio.Event()
        self._listener: asyncio.Server | None = None
        self._writers: list[asyncio.StreamWriter] = []

    async def __aenter__(self) -> Client:
        await self.connect()
        await self.listen()
        return self

    async def __aexit__(self, *_: object) -> None:
        self.leave()

    async def connect(self) -> None:
        address = ("127.0.0.1", self.ports[0])
        self.reader, self.bml = await asyncio.open_connection(*address, local_addr=(self.host, 0))

    async def listen(self) -> None:
        self._listener = await asyncio.start_server(self._take, self.host, self.ports[1])

    def leave(self) -> None:
        self.bml.transport.abort()
        self.hang_up()
        if self._listener is not None:
            self._listener.close()

    def hang_up(self) -> None:
        for writer in self._writers:
            writer.transport.abort()

    def send(self, text: str | bytes) -> None:
        self.bml.write(text.encode() if isinstance(text, str) else text)

    async def _take(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writers.append(writer)
        self.called_back.set()
        parser = ElementTree.XMLPullParser(("start", "end"))
        parser.feed("<stream>")
        depth = 0
        try:
            while data := await reader.read(1000):
                self.raw += data
                parser.feed(data)
                for event, element in parser.read_events():
                    depth += 1 if event == "start" else -1
                    if event == "end" and depth == 1:
                        assert element.tag.startswith(CORE)
                        element.tail = None
                        self.feedback.append(parse_feedback(ElementTree.tostring(element, "unicode")))
                        self._news.set()
        except OSError:
            pass
        self.gone.set()

    async def until(self, id: str, kind: type[Feedback] = BlockProgress) -> list[Feedback]:
        """Everything up to a feedback of that kind and id."""
        seen = 0
        while True:
            while seen < len(self.feedback):
                feedback = self.feedback[seen]
                seen += 1
                if isinstance(feedback, kind) and getattr(feedback, "id", None) == id:
                    return self.feedback[:seen]
            self._news.clear()
            await self._news.wait()


def serving(test: Callable[[Server, int, int], Awaitable[None]], loop=None, **settings) -> None:
    """Run a test against a service of its own: server, BML port, feedback port."""

    async def run() -> None:
        feedback = free_port()
        wanted = Settings(port=0, asap_ports=(0, feedback), voice="silent", **settings)
        async with asyncio.timeout(LIMIT), Server(wanted) as server:
            (transport,) = [d for d in server.transports if isinstance(d, AsapTransport)]
            await test(server, transport.port, feedback)

    with asyncio.Runner(loop_factory=loop) as runner:
        runner.run(run())


async def until_played(server: Server) -> None:
    """Wait until something plays, then until nothing does any more."""
    while not server._sessions.busy:
        await asyncio.sleep(0)
    while server._sessions.busy:
        await asyncio.sleep(0)


def warnings(feedback: list[Feedback]) -> list[WarningFeedback]:
    return [f for f in feedback if isinstance(f, WarningFeedback)]


def test_asap_plays_a_document_and_calls_back_with_feedback() -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as client:
            client.send('<?xml version="1.0" encoding="UTF-8"?>\r\n' + NOD.format("b"))
            feedback = await client.until("b:end")
        assert isinstance(feedback[0], PredictionFeedback)
        progress = [f for f in feedback if isinstance(f, BlockProgress | SyncPointProgress)]
        points = ["start", "ready", "strokeStart", "stroke", "strokeEnd", "relax", "end"]
        assert [f.id for f in progress] == ["b:start", *(f"b:n:{p}" for p in points), "b:end"]
        assert not warnings(feedback)

    serving(test)


def test_asap_ends_feedback_with_a_line_feed_and_declares_namespaces() -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as client:
            client.send(NOD.format("b"))
            count = len(await client.until("b:end"))
            parts = client.raw.split(b'xmlns="http://www.bml-initiative.org/bml/bml-1.0"')
            assert len(parts) - 1 == count
            assert client.raw.endswith(b">\n")
            assert b"><" not in client.raw.replace(b"><sync", b"")

    serving(test)


def test_asap_works_with_uvloop() -> None:
    uvloop = pytest.importorskip("uvloop", reason="needs the fast extra")

    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as client:
            client.send(WAIT.format("b", 0))
            await client.until("b:end")
            client.called_back.clear()
            client.hang_up()
            await client.called_back.wait()
            client.send(WAIT.format("c", 0))
            await client.until("c:end")

    serving(test, uvloop.new_event_loop)


def test_asap_queues_feedback_for_a_client_that_listens_late() -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        early = Client(bml, port)
        await early.connect()
        early.send(WAIT.format("b", 0.1))
        await until_played(server)
        await early.listen()
        feedback = await early.until("b:end")
        assert [f.id for f in feedback if isinstance(f, BlockProgress)] == ["b:start", "b:end"]
        early.leave()

    serving(test)


def test_asap_accepts_documents_cut_anywhere() -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as client:
            one, two, three = (WAIT.format(id, 0) for id in ("ä", "b", "c"))
            text = f"\ufeff<!-- é -->\n{one}{two}<!DOCTYPE bml>{three}"
            for byte in text.encode():
                client.send(bytes([byte]))
                await client.bml.drain()
            feedback = await client.until("c:end")
            ends = [f.id for f in feedback if isinstance(f, BlockProgress) and f.id.endswith(":end")]
            assert ends == ["ä:end", "b:end", "c:end"]
            assert not warnings(feedback)

    serving(test)


@pytest.mark.parametrize(
    ("broken", "id", "says"),
    [
        ("hello\n", "<no id>", "got 'hello'"),
        ('{"type":"ping"}\n', "<no id>", "wanted <bml>"),
        ('<bml id="x"><head></bml>\n', "x", "not well-formed"),
        ('<bml id="x"><head ', "x", "before the next <bml"),
        ("<bml/>\n", "<no id>", "id"),
        (b'<bml id="x">\xff</bml>', "x", "UTF-8"),
        (f'<bml id="x">{"x" * 5000}</bml>', "x", "at most 5000 bytes"),
    ],
)
def test_asap_warns_once_of_a_broken_document_and_plays_the_next(broken, id: str, says: str) -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as client:
            client.send(broken)
            client.send(WAIT.format("good", 0))
            feedback = await client.until("good:end")
            (warning,) = warnings(feedback)
            assert (warning.id, warning.type) == (id, "PARSING_FAILURE")
            assert says in warning.text
            assert b"CDATA" not in client.raw

    serving(test, max_document=5000)


def test_asap_reads_documents_of_dialects_in_their_elements() -> None:
    async def test(server: Server, bml: int, feedback: int) -> None:
        async with Client(bml, feedback) as client:
            client.send('<act><participant id="Brad"/><bml id="s"><head type="NOD"/></bml></act>')
            text = '<speech id="s"><tm id="tm1"/>Hello</speech>'
            client.send(f'<fml-apml><bml id="g">{text}</bml><fml><x/></fml></fml-apml>')
            client.send(NOD.format("plain"))
            told = await client.until("plain:end")
            notes = {f.id: f.text for f in told if isinstance(f, WarningFeedback)}
            assert list(notes) == ["s", "g"]
            assert "SmartBody's BML" in notes["s"]
            assert "Greta's BML" in notes["g"]
            characters = {f.id: f.character_id for f in told if isinstance(f, BlockProgress)}
            assert characters["s:start"] == "Brad"
            assert characters["plain:start"] is None

    serving(test)


def test_asap_gives_each_address_its_own_session() -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as one, Client(bml, port, "127.0.0.2") as other:
            one.send(WAIT.format("same", 0.2))
            other.send(WAIT.format("same", 0.1))
            other.send(WAIT.format("mine", 0))
            assert not warnings(await one.until("same:end"))
            assert not warnings(await other.until("same:end"))
            await other.until("mine:end")
            assert not any("mine" in str(f) for f in one.feedback)

    serving(test)


def test_asap_calls_back_a_second_client_of_an_address_when_it_listens() -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        second = Client(bml, port)
        async with Client(bml, port) as first:
            await first.called_back.wait()
            assert first._listener is not None
            first._listener.close()  # as clients do once they were called back
            await second.connect()
            second.send(WAIT.format("second", 0))
            await second.listen()
            first.send(WAIT.format("first", 0))
            await first.until("first:end")
            await second.until("second:end")
            await first.until("second:end")
        second.leave()

    serving(test)


async def until_alone(server: Server) -> None:
    """Wait until no connection is left."""
    while server._sessions.health()["connections"]:
        await asyncio.sleep(0)


def test_asap_closes_the_call_back_with_the_bml_connection() -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as client:
            await client.called_back.wait()
            client.send(WAIT.format("b", 60) + '<bml id="half"><head')
            await client.until("b:start")
            client.bml.close()
            await client.gone.wait()
            await until_alone(server)

    serving(test)


def test_asap_leaves_nothing_behind_if_the_feedback_port_never_opens() -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        client = Client(bml, port)
        await client.connect()
        client.send(WAIT.format("b", 60) + '<bml id="half">')
        while not server._sessions.busy:
            await asyncio.sleep(0)
        client.leave()
        await until_alone(server)
        while any("keep" in repr(task.get_coro()) for task in asyncio.all_tasks()):
            await asyncio.sleep(0)

    serving(test)


def test_asap_reopens_a_lost_call_back() -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as client:
            await client.called_back.wait()
            client.called_back.clear()
            client.hang_up()
            await client.called_back.wait()
            client.send(WAIT.format("b", 0))
            await client.until("b:end")

    serving(test)


def test_asap_warns_once_of_ten_mebibytes_of_garbage() -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as client:
            garbage = os.urandom(2**20).replace(b"<", b"(")
            for _ in range(10):
                client.send(garbage)
                await client.bml.drain()
            client.send(WAIT.format("b", 0))
            assert len(warnings(await client.until("b:end"))) == 1

    serving(test)


def test_asap_bounds_queued_feedback_and_reports_the_loss(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(asap, "MAX_QUEUED", 2000)

    async def test(server: Server, bml: int, port: int) -> None:
        client = Client(bml, port)
        await client.connect()
        client.send("".join(WAIT.format(f"b{n}", 0.1) for n in range(20)))
        await until_played(server)
        await client.listen()
        feedback = await client.until("b19:end")
        assert isinstance(feedback[0], WarningFeedback)
        assert "messages are lost: nothing listened here" in feedback[0].text
        assert len(client.raw) < 3000
        client.leave()

    serving(test)


def test_asap_replaces_a_start_tag_that_clients_cannot_read() -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as client:
            client.send(WAIT.format("y" * 5000, 0) + WAIT.format("b", 0))
            feedback = await client.until("b:end")
            assert warnings(feedback)
            assert max(len(tag) for tag in client.raw.split(b"<")) < 4096

    serving(test)


def test_asap_disconnects_a_client_that_stops_reading(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("realizer.server.session.connections.STUCK", 1000)

    async def test(server: Server, bml: int, port: int) -> None:
        client = Client(bml, port)
        await client.connect()  # and never listens
        client.send("".join(WAIT.format(f"b{n}", 60) for n in range(20)))
        with contextlib.suppress(ConnectionResetError):
            assert await client.reader.read() == b""
        client.leave()
        await until_alone(server)

    serving(test)


def test_asap_session_of_an_address_can_be_joined() -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as client, connect(f"{server.url}?session=asap-127.0.0.1") as viewer:
            await viewer.send('{"type":"subscribe","stream":"fap","encoding":"json"}')
            assert '"subscribed"' in await viewer.recv()
            client.send(NOD.format("b"))
            async for message in viewer:
                if 'id="b:end"' in str(message):
                    break
            await client.until("b:end")

    serving(test)


def test_asap_plays_hundreds_of_documents_at_once() -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as client:
            client.send("".join(f'<bml id="b{n}"/>' for n in range(300)))
            feedback = await client.until("b299:end")
            ends = [f.id for f in feedback if isinstance(f, BlockProgress) and f.id.endswith(":end")]
            assert sorted(ends) == sorted(f"b{n}:end" for n in range(300))

    serving(test)


def test_asap_reads_no_more_while_the_session_is_congested(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session_host, "MOST_WAITING", 0)  # it always is

    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as client:
            client.send(WAIT.format("a", 0.1) + WAIT.format("b", 0.1))
            feedback = await client.until("a:end")
            assert {f.id.partition(":")[0] for f in feedback if isinstance(f, BlockProgress)} == {"a"}
            monkeypatch.setattr(session_host, "MOST_WAITING", 100)
            await client.until("b:end")

    serving(test)


def test_asap_disconnects_a_client_if_the_service_is_full() -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        async with connect(server.url):
            client = Client(bml, port)
            await client.connect()
            with contextlib.suppress(ConnectionResetError):
                assert await client.reader.read() == b""
            client.leave()
        async with Client(bml, port) as client:
            client.send(WAIT.format("b", 0))
            await client.until("b:end")

    serving(test, max_sessions=1)


def test_asap_limits_the_connections_of_an_address(caplog: pytest.LogCaptureFixture) -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as client:
            more = Client(bml, port)
            await more.connect()
            assert await more.reader.read() == b""
            more.bml.transport.abort()
            assert "127.0.0.1 is refused: 1 connections from it are open" in caplog.text
            assert "REALIZER_MAX_CONNECTIONS" in caplog.text
            async with Client(bml, free_port("127.0.0.2"), "127.0.0.2"):  # another address has its own
                pass
            client.send(NOD.format("b"))
            await client.until("b:end")

    serving(test, max_connections=1)


def test_asap_reads_a_flood_slowly_and_loses_nothing(all_at_once) -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as client:
            client.send("".join(f'<bml id="b{n}"/>' for n in range(8)))
            feedback = await client.until("b7:end")
            (warning,) = [f for f in feedback if isinstance(f, WarningFeedback)]
            assert "REALIZER_MAX_RATE" in warning.text
            ends = [f.id for f in feedback if isinstance(f, BlockProgress) and f.id.endswith(":end")]
            assert ends == [f"b{n}:end" for n in range(8)]

    serving(test, max_rate=3)


@pytest.mark.parametrize(
    ("limit", "document"),
    [
        ({"max_document": 60}, f'<bml id="b"><!--{"x" * 100}--></bml>'),
        ({"max_elements": 2}, '<bml id="b"><wait id="w"/><wait id="v"/></bml>'),
        ({"max_behaviours": 1}, '<bml id="b"><wait id="w"/><wait id="v"/></bml>'),
        ({"max_duration": 9}, '<bml id="b"><wait id="w" duration="10"/></bml>'),
        ({"max_speech": 3}, '<bml id="b"><speech id="s"><text>Hello</text></speech></bml>'),
    ],
)
def test_asap_applies_and_names_the_limits_of_the_service(limit: dict[str, int], document: str) -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as client:
            client.send(document)
            client.send('<bml id="c"/>')
            feedback = await client.until("c:end")
            (warning,) = [f for f in feedback if isinstance(f, WarningFeedback)]
            (name,) = limit
            assert warning.id == "b"
            assert f"REALIZER_{name.upper()} sets it" in warning.text

    serving(test, **limit)


def test_asap_prints_its_address_and_raises_if_it_is_in_use() -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        (transport,) = [d for d in server.transports if isinstance(d, AsapTransport)]
        line = f"asap: BML at 127.0.0.1:{bml}, feedback to port {port} of the client, session asap-ADDRESS"
        assert transport.startup_lines == (line,)
        with pytest.raises(OSError, match="in use"):
            await Server(Settings(port=0, asap_ports=(bml, port))).start()

    serving(test)


def test_asap_drains_before_it_disconnects() -> None:
    async def test(server: Server, bml: int, port: int) -> None:
        async with Client(bml, port) as client:
            client.send(WAIT.format("b", 0.3))
            await client.until("b:start")
            draining = asyncio.create_task(server.drain())
            await client.until("b:end")
            await draining
            await server.close()
            await client.gone.wait()
            assert await client.reader.read() == b""

    serving(test)
