"""The STOMP transport with a real ActiveMQ, and a peer that uses stomp.py."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Awaitable, Callable
from pathlib import Path
from urllib.parse import quote, unquote

import pytest
import stomp
from websockets.asyncio.client import connect

from bml_schema.feedback import BlockProgress, Feedback, WarningFeedback, parse_feedback
from realizer.core.settings import Settings
from realizer.server.serve import Server
from realizer.server.transports.stomp import StompTransport
from tests.realizer.server.transports.conftest import free_port
from tests.waiting import LIMIT

pytestmark = pytest.mark.xdist_group("brokers")

NOD = '<bml id="{}"><head id="n" lexeme="NOD"/></bml>'
WAIT = '<bml id="{}"><wait id="w" duration="{}"/></bml>'


class Peer(stomp.ConnectionListener):
    """A client of the broker: what comes from each topic queues in the event loop."""

    def __init__(
        self, port: int, *topics: str, login: tuple[str, str] | None = None, host: str | None = None
    ) -> None:
        self.queue: asyncio.Queue[tuple[str, dict[str, str], str]] = asyncio.Queue()
        self._loop = asyncio.get_running_loop()
        self._topics = topics
        self._login = login or (None, None)
        self._reading = asyncio.Event()
        self._gone = asyncio.Event()
        self._stomp = stomp.Connection12([("127.0.0.1", port)], auto_content_length=False, vhost=host)
        self._stomp.set_listener("peer", self)

    async def __aenter__(self) -> Peer:
        await asyncio.to_thread(self._stomp.connect, *self._login, wait=True)
        for n, topic in enumerate(self._topics):
            last = {"receipt": "reading"} if n == len(self._topics) - 1 else {}
            self._stomp.subscribe(topic, id=str(n), headers=last)
        await self._reading.wait()
        return self

    async def __aexit__(self, *_: object) -> None:
        if not self._gone.is_set():
            self._stomp.disconnect()
            await self._gone.wait()

    def _in_loop(self, function, *arguments) -> None:
        self._loop.call_soon_threadsafe(function, *arguments)

    def on_receipt(self, frame) -> None:
        if frame.headers["receipt-id"] == "reading":
            self._in_loop(self._reading.set)

    def on_message(self, frame) -> None:
        said = (frame.headers["destination"], frame.headers, frame.body)
        self._in_loop(self.queue.put_nowait, said)

    def on_disconnected(self) -> None:
        self._in_loop(self._gone.set)

    def send(self, topic: str, body: str) -> None:
        self._stomp.send(topic, body)

    def ask(self, bml: str) -> None:
        self.send("/topic/bmlRequests", json.dumps({"bml": {"content": quote(bml)}}))

    def say(self, text: str) -> None:
        headers = {"ELVISH_SCOPE": "DEFAULT_SCOPE", "MESSAGE_PREFIX": text.split()[0]}
        self._stomp.send("/topic/DEFAULT_SCOPE", quote(text), headers=headers)

    async def feedback(self, last: str) -> list[Feedback]:
        """JSON feedback up to the block progress `last`."""
        found: list[Feedback] = []
        while True:
            _, _, body = await self.queue.get()
            found.append(parse_feedback(unquote(json.loads(body)["feedback"]["content"])))
            if isinstance(found[-1], BlockProgress) and found[-1].id == last:
                return found

    async def heard(self, last: str) -> list[str]:
        """Return the texts of components up to one that begins with `last`."""
        found: list[str] = []
        while not (found and found[-1].startswith(last)):
            _, headers, body = await self.queue.get()
            found.append(unquote(body))
            if found[-1].split()[0] not in ("vrSpeak", "vrAllCall"):
                assert headers["MESSAGE_PREFIX"] == found[-1].split()[0]
        return found


def transport_of(server: Server) -> StompTransport:
    (transport,) = [d for d in server.transports if isinstance(d, StompTransport)]
    return transport


def serving(
    test: Callable[[Server], Awaitable[None]], address: str, *, ready: bool = True, **settings
) -> None:
    """Run a test against a service of its own, once its transport is ready."""

    async def run() -> None:
        wanted = Settings(port=0, stomp=address, voice="silent", **settings)
        async with asyncio.timeout(LIMIT), Server(wanted) as server:
            if ready:
                await transport_of(server).ready()
            await test(server)

    asyncio.run(run())


def test_stomp_plays_bml_in_json_and_answers_in_json(broker) -> None:
    async def test(server: Server) -> None:
        async with Peer(broker.port, "/topic/bmlFeedback") as peer:
            peer.ask(NOD.format("b"))
            feedback = await peer.feedback("b:end")
        progress = [f.id for f in feedback if hasattr(f, "id")]
        points = ["start", "ready", "strokeStart", "stroke", "strokeEnd", "relax", "end"]
        assert progress == ["b:start", *(f"b:n:{p}" for p in points), "b:end"]

    serving(test, broker.address)


def test_stomp_plays_plain_bml_over_the_topics_of_asap(broker) -> None:
    async def test(server: Server) -> None:
        async with Peer(broker.port, "/topic/asap.bml.feedback") as peer:
            peer.send("/topic/asap.bml.request", WAIT.format("é", 0))
            body = ""
            while 'id="é:end"' not in body:
                _, headers, body = await peer.queue.get()
                # With a length it would be a message of bytes, which Java clients pass over.
                assert "content-length" not in headers
                assert body.startswith("<")

    serving(test, broker.address)


def test_stomp_plays_a_vrspeak_and_reports_it(broker) -> None:
    async def test(server: Server) -> None:
        async with Peer(broker.port, "/topic/DEFAULT_SCOPE") as peer:
            act = '<?xml version="1.0"?><act><participant id="Brad"/>{}</act>'
            peer.say("vrSpeak Brad ALL m1 " + act.format('<bml><head id="n" lexeme="NOD"/></bml>'))
            heard = await peer.heard("vrSpoke")
            assert heard[-3:] == [
                "vrAgentBML Brad ALL m1 start",
                "vrAgentBML Brad ALL m1 end complete",
                "vrSpoke Brad ALL m1",
            ]
            peer.say("vrAllCall")
            assert (await peer.heard("vrComponent"))[-1] == "vrComponent renderer bml-realizer"

    serving(test, broker.address)


def test_stomp_interrupts_at_the_vrspoke_of_another_component(broker) -> None:
    async def test(server: Server) -> None:
        async with Peer(broker.port, "/topic/DEFAULT_SCOPE") as peer:
            peer.say("vrSpeak Brad ALL m1 " + WAIT.format("b", 60))
            await peer.heard("vrAgentBML Brad ALL m1 start")
            peer.say("vrSpoke Brad ALL m1")
            assert (await peer.heard("vrAgentBML"))[-1] == "vrAgentBML Brad ALL m1 end interrupted"

    serving(test, broker.address)


def test_stomp_ends_a_broken_vrspeak_with_an_error(broker) -> None:
    async def test(server: Server) -> None:
        async with Peer(broker.port, "/topic/DEFAULT_SCOPE") as peer:
            peer.say('vrSpeak Brad ALL m1 <bml><head id="n"</bml>')
            assert "end error" in (await peer.heard("vrAgentBML Brad ALL m1"))[-1]
            peer.say('vrSpeak Brad ALL m2 <bml><head id="n"></bml>')
            assert "end error" in (await peer.heard("vrAgentBML Brad ALL m2"))[-1]
            peer.say("vrSpeak Brad ALL m3 <bml/>")
            await peer.heard("vrAgentBML Brad ALL m3 end complete")

    serving(test, broker.address)


def test_stomp_has_a_session_for_each_format(broker) -> None:
    async def test(server: Server) -> None:
        topics = ("/topic/bmlFeedback", "/topic/asap.bml.feedback")
        async with (
            Peer(broker.port, *topics) as peer,
            connect(f"{server.url}?session=stomp-json") as viewer,
        ):
            peer.send("/topic/asap.bml.request", WAIT.format("same", 0.2))
            peer.ask(WAIT.format("same", 0.2))
            ended: set[str] = set()
            while len(ended) < 2:
                topic, _, body = await peer.queue.get()
                assert "warningFeedback" not in body
                if "same:end" in unquote(body):
                    ended.add(topic)
            async for message in viewer:
                if 'id="same:end"' in str(message):
                    break

    serving(test, broker.address)


def test_stomp_warns_of_bad_messages_and_plays_the_next(broker) -> None:
    async def test(server: Server) -> None:
        async with Peer(broker.port, "/topic/bmlFeedback") as peer:
            for body in ("nonsense", '{"bml":{"content":"%7B%7D"}}', "x" * 2**20):
                peer.send("/topic/bmlRequests", body)
            peer.ask("<bml id='x'><oops")
            peer.ask(WAIT.format("b", 0))
            feedback = await peer.feedback("b:end")
            assert [f.id for f in feedback if isinstance(f, WarningFeedback)] == ["<no id>"] * 3 + ["x"]

    serving(test, broker.address)


def test_stomp_plays_many_messages_at_once(broker) -> None:
    async def test(server: Server) -> None:
        async with Peer(broker.port, "/topic/bmlFeedback") as peer:
            for n in range(200):
                peer.ask(f'<bml id="b{n}"/>')
            feedback = await peer.feedback("b199:end")
            ends = [f.id for f in feedback if isinstance(f, BlockProgress) and f.id.endswith(":end")]
            assert sorted(ends) == sorted(f"b{n}:end" for n in range(200))

    serving(test, broker.address)


def test_stomp_refuses_a_message_that_is_too_large_and_plays_the_next(broker) -> None:
    async def test(server: Server) -> None:
        async with Peer(broker.port, "/topic/bmlFeedback") as peer:
            peer.send("/topic/bmlRequests", "x" * 500)
            peer.ask(NOD.format("good"))
            feedback = await peer.feedback("good:end")
            (warning,) = [f for f in feedback if isinstance(f, WarningFeedback)]
            assert "at most 400 bytes in a message, got 500" in warning.text
            assert "REALIZER_MAX_MESSAGE" in warning.text

    serving(test, broker.address, max_message=400)


def test_stomp_reads_a_flood_slowly_and_loses_nothing(
    broker, all_at_once, caplog: pytest.LogCaptureFixture
) -> None:
    async def test(server: Server) -> None:
        async with Peer(broker.port, "/topic/bmlFeedback") as peer:
            for n in range(8):
                peer.ask(f'<bml id="b{n}"/>')
            feedback = await peer.feedback("b7:end")
            ends = [f.id for f in feedback if isinstance(f, BlockProgress) and f.id.endswith(":end")]
            assert ends == [f"b{n}:end" for n in range(8)]
        assert caplog.text.count("REALIZER_MAX_RATE") == 1

    serving(test, broker.address, max_rate=3)


def test_stomp_topics_are_settings_and_may_be_off(broker) -> None:
    settings = {
        "stomp_json_in": "/topic/mine.in",
        "stomp_json_out": "/topic/mine.out",
        "stomp_xml_in": None,
        "stomp_vhmsg": "/topic/MINE",
    }

    async def test(server: Server) -> None:
        assert transport_of(server).startup_lines == (
            f"stomp: {broker.address} reads /topic/mine.in in session stomp-json, "
            "/topic/MINE in session stomp-vhmsg",
        )
        async with Peer(broker.port, "/topic/mine.out", "/topic/MINE") as peer:
            peer._stomp.send("/topic/MINE", "vrAllCall")
            while (said := await peer.queue.get())[2] != quote("vrComponent renderer bml-realizer"):
                pass
            assert said[1]["ELVISH_SCOPE"] == "MINE"
            peer.send("/topic/mine.in", json.dumps({"bml": {"content": quote(WAIT.format("b", 0))}}))
            await peer.feedback("b:end")

    serving(test, broker.address, **settings)


def test_stomp_leaves_when_a_component_kills_it(broker) -> None:
    async def test(server: Server) -> None:
        async with Peer(broker.port, "/topic/DEFAULT_SCOPE") as peer:
            peer.say("vrSpeak Brad ALL m1 " + WAIT.format("b", 60))
            await peer.heard("vrAgentBML Brad ALL m1 start")
            peer.say("vrKillComponent renderer")
            await peer.heard("vrAgentBML Brad ALL m1 end interrupted")
            leaving = transport_of(server)._leaving
            assert leaving is not None
            await leaving
            assert server._sessions.health()["connections"] == 0
            async with connect(server.url) as socket:  # the other transports stay open
                await socket.send(WAIT.format("b", 0))
                assert "feedback" in str(await socket.recv()).lower()

    serving(test, broker.address)


def test_stomp_reports_the_end_of_the_service(broker) -> None:
    async def run() -> None:
        async with asyncio.timeout(LIMIT), Peer(broker.port, "/topic/DEFAULT_SCOPE") as peer:
            async with Server(Settings(port=0, stomp=broker.address, voice="silent")) as server:
                await transport_of(server).ready()
                peer.say("vrSpeak Brad ALL m1 " + WAIT.format("b", 60))
                await peer.heard("vrAgentBML Brad ALL m1 start")
            await peer.heard("vrAgentBML Brad ALL m1 end interrupted")

    asyncio.run(run())


async def gone(server: Server) -> None:
    """Wait until the transport knows that its broker is away."""
    while transport_of(server)._broker is not None:
        await asyncio.sleep(0)


@pytest.mark.slow
def test_stomp_reconnects_to_a_broker_that_dies(own_broker, caplog) -> None:
    async def test(server: Server) -> None:
        own_broker_port = own_broker.port
        async with Peer(own_broker_port, "/topic/bmlFeedback") as peer:
            peer.ask(WAIT.format("before", 0))
            await peer.feedback("before:end")
            peer.ask(WAIT.format("over", 0.5))
            await peer.feedback("over:start")
            await asyncio.to_thread(own_broker.kill)
            await peer._gone.wait()
        await gone(server)
        while server._sessions.busy:  # what plays, plays on
            await asyncio.sleep(0)
        transport = transport_of(server)
        assert any("over%3Aend" in message.body for message in transport._out)
        transport._up.clear()
        await asyncio.to_thread(own_broker.start)
        await transport.ready()
        async with Peer(own_broker_port, "/topic/bmlFeedback") as peer:
            peer.ask(WAIT.format("after", 0))
            await peer.feedback("after:end")
        assert [("gone" in m, "connected" in m) for m in caplog.messages if m.startswith("stomp")] == [
            (True, False),
            (False, True),
        ]

    own_broker.start()
    with caplog.at_level(logging.WARNING):
        serving(test, own_broker.address)


def test_stomp_logs_once_that_there_is_no_broker_and_waits(own_broker, caplog) -> None:
    async def test(server: Server) -> None:
        async with connect(server.url) as socket:  # the other transports are open already
            await socket.send('{"type":"ping"}')
            assert "pong" in str(await socket.recv())
        await asyncio.to_thread(own_broker.start)
        await transport_of(server).ready()
        async with Peer(own_broker.port, "/topic/bmlFeedback") as peer:
            peer.ask(WAIT.format("b", 0))
            await peer.feedback("b:end")

    with caplog.at_level(logging.WARNING):
        serving(test, own_broker.address, ready=False)
    assert [m for m in caplog.messages if m.startswith("stomp")] == [
        f"stomp: no broker at {own_broker.address} (nobody answers); looking for it",
        f"stomp: connected to {own_broker.address}",
    ]


@pytest.mark.slow
def test_stomp_reconnects_if_the_broker_falls_silent(own_broker, monkeypatch, caplog) -> None:
    monkeypatch.setattr("realizer.server.transports.broker.HEARTBEAT", 200)
    monkeypatch.setattr("realizer.server.transports.stomp.ATTEMPT", 1)

    async def test(server: Server) -> None:
        own_broker.freeze()
        await gone(server)
        transport = transport_of(server)
        transport._up.clear()
        own_broker.thaw()
        await transport.ready()
        async with Peer(own_broker.port, "/topic/bmlFeedback") as peer:
            peer.ask(WAIT.format("b", 0))
            await peer.feedback("b:end")

    own_broker.start()
    with caplog.at_level(logging.WARNING):
        serving(test, own_broker.address)
    assert f"the broker at {own_broker.address} is gone (it has fallen silent)" in caplog.text


def test_stomp_answers_a_vrallcall(guarded_broker, caplog) -> None:
    async def test(server: Server) -> None:
        async with Peer(guarded_broker.port, "/topic/bmlFeedback", login=("face", "secret")) as peer:
            peer.ask(WAIT.format("b", 0))
            await peer.feedback("b:end")

    serving(test, guarded_broker.address, stomp_login="face", stomp_password="secret")

    async def refused(server: Server) -> None:
        while not caplog.messages:
            await asyncio.sleep(0)

    with caplog.at_level(logging.WARNING):
        serving(refused, guarded_broker.address, ready=False, stomp_login="face", stomp_password="wrong")
    assert "no broker at" in caplog.messages[0]
    assert "password" in caplog.messages[0]


def test_stomp_works_with_rabbitmq_and_says_what_it_misses(rabbit, caplog) -> None:
    guest = {"stomp_login": "guest", "stomp_password": "guest"}

    async def test(server: Server) -> None:
        topics = ("/topic/bmlFeedback", "/topic/DEFAULT_SCOPE")
        async with Peer(rabbit.port, *topics, login=("guest", "guest"), host="/") as peer:
            peer.ask(WAIT.format("b", 0))
            await peer.feedback("b:end")
            peer.say("vrSpeak Brad ALL m1 <bml/>")
            await peer.heard("vrSpoke Brad ALL m1")

    serving(test, rabbit.address, stomp_host="/", **guest)

    async def refused(server: Server) -> None:
        while not caplog.messages:
            await asyncio.sleep(0)

    with caplog.at_level(logging.WARNING):
        serving(refused, rabbit.address, ready=False, **guest)
    assert "Virtual host '127.0.0.1' access denied" in caplog.messages[0]


def test_stomp_gives_up_a_port_that_says_nothing(monkeypatch: pytest.MonkeyPatch, caplog) -> None:
    monkeypatch.setattr("realizer.server.transports.stomp.ATTEMPT", 0.2)

    async def run() -> None:
        async def silence(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            await reader.read()
            writer.close()

        mute = await asyncio.start_server(silence, "127.0.0.1", 0)
        address = f"127.0.0.1:{mute.sockets[0].getsockname()[1]}"
        async with asyncio.timeout(LIMIT), mute, Server(Settings(port=0, stomp=address)):
            while not caplog.messages:
                await asyncio.sleep(0)

    with caplog.at_level(logging.WARNING):
        asyncio.run(run())
    assert "no broker at" in caplog.messages[0]


def alone(test: Callable[[Server], Awaitable[None]], **settings) -> None:
    """Run a test against a service whose broker never comes."""
    serving(test, f"127.0.0.1:{free_port()}", ready=False, **settings)


def test_stomp_joins_once_although_another_process_has_its_session(tmp_path: Path) -> None:
    where = str(tmp_path / "journal.db")

    async def test(server: Server) -> None:
        async with Server(Settings(port=0, voice="silent", journal=where)) as other:
            for url in (server.url, other.url):  # the second one takes it over
                async with connect(f"{url}?session=stomp-json") as viewer:
                    await viewer.send(WAIT.format("b", 0))
                    while 'id="b:end"' not in str(await viewer.recv()):
                        pass
            while server._sessions.health()["connections"]:
                await asyncio.sleep(0)
            transport_of(server)._links[0].receive(WAIT.format("c", 60))
            assert server._sessions.health() == {"sessions": 1, "connections": 1}
            while not server._sessions.busy:
                await asyncio.sleep(0)

    alone(test, journal=where)


@pytest.mark.slow
def test_stomp_begins_a_new_session_after_one_that_fails(caplog) -> None:
    async def test(server: Server) -> None:
        link = transport_of(server)._links[0]
        link.receive(WAIT.format("b", 60))
        (session,) = server._sessions._registry.sessions.values()
        server._sessions._end(session, 1011, "internal error")
        assert server._sessions.health() == {"sessions": 0, "connections": 0}
        for id in ("c", "d"):
            link.receive(WAIT.format(id, 60))
            assert server._sessions.health() == {"sessions": 1, "connections": 1}

    alone(test)
