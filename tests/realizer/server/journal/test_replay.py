"""Sessions of a service that is killed, restored by another one."""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
import sqlite3
import subprocess
import urllib.request
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from redis import Redis
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from bml_schema.feedback import parse_feedback
from realizer.core.settings import Settings
from realizer.server.http import protocols
from realizer.server.journal import Entry, SavedSession, journal_at
from realizer.server.journal.entry import NOTE
from realizer.server.journal.replay import STALLS, ReplayNote, ReplayWatch, restore_session
from realizer.server.journal.session_journal import ENTRIES
from realizer.server.runtime import session_host
from realizer.server.serve import Server
from realizer.server.session.session import Session
from tests.feedback_log import read_feedback, seq_numbers
from tests.programs import serving
from tests.realizer.server.conftest import Clock, spoken
from tests.waiting import LIMIT, wait_for
from tests.worst_documents import document

FIRST = """<bml id="a"><gaze id="g" target="cup" start="0.2" end="1.4"/>
<head id="n" lexeme="NOD" start="0.6"/>
<speech id="s" start="0.3"><text>What is said <sync id="m"/> before it dies</text></speech></bml>"""
NEXT = '<bml id="b" composition="APPEND"><head id="n" lexeme="SHAKE" end="0.8"/></bml>'
POINTS = ("start", "ready", "strokeStart", "stroke", "strokeEnd", "relax", "end")
SCENE = json.dumps({"type": "scene", "objects": {"cup": {"x": 0.2, "y": -0.1, "z": 0.5}}})


def points(received: list[str]) -> list[str]:
    """Return the blocks and sync points that feedback has reported as reached."""
    return [text.split(' id="')[1].split('"')[0] for text in received if "Progress" in text.split(" ")[0]]


async def drained(client: ClientConnection) -> None:
    """Read until the connection ends."""
    while True:
        await client.recv()


@pytest.mark.slow
def test_restored_session_sends_all_feedback_once_and_in_order(where: str) -> None:
    async def before(url: str, service: subprocess.Popen[str]) -> list[str]:
        async with asyncio.timeout(LIMIT), connect(f"{url}?session=killed") as client:
            await client.send(SCENE)
            await client.send(FIRST)
            await client.send(NEXT)
            received = []
            async for message in client:
                if isinstance(message, str) and message.startswith("<"):
                    received.append(message)
                    if 'id="a:s:m"' in message:  # the second block waits, the first one is in the middle
                        service.kill()
                        break
            return received + await read_feedback(client, "never")

    async def after(url: str, seen: int) -> list[str]:
        async with asyncio.timeout(LIMIT), connect(f"{url}?session=killed&seen={seen}") as client:
            return await read_feedback(client, "b:end")

    with serving("--journal", where) as (url, service):
        first = asyncio.run(before(url, service))
    seen = seq_numbers(first)[-1]

    async def whole(url: str) -> list[str]:
        async with asyncio.timeout(LIMIT), connect(f"{url}?session=whole") as client:
            await client.send(SCENE)
            await client.send(FIRST)
            await client.send(NEXT)
            return await read_feedback(client, "b:end")

    with serving("--journal", where) as (url, _):
        rest = asyncio.run(after(url, seen))
        undisturbed = asyncio.run(whole(url))
    seqs = seq_numbers(first + rest)
    assert seqs == list(range(1, len(seqs) + 1))
    assert any('id="a:end"' in text for text in rest)
    for text in first + rest:
        parse_feedback(text)
    # The order of two unrelated messages depends on when the documents came.
    assert sorted(points(first + rest)) == sorted(points(undisturbed))


def in_a_checkpoint(where: str, session: str) -> bool:
    """Whether the journal has an entry of a session, whose owner stays the same."""
    if where.startswith("redis://"):
        with Redis.from_url(where) as store:
            return bool(store.hexists(f"realizer:{{{session}}}:parts", "state"))
    with contextlib.closing(sqlite3.connect(where)) as file:
        return file.execute("SELECT 1 FROM parts WHERE session = ?", (session,)).fetchone() is not None


@pytest.mark.parametrize("where", ["redis"], indirect=True)
@pytest.mark.slow
def test_restored_session_has_the_state_of_its_checkpoint(where: str) -> None:
    hold = json.dumps({"type": "set", "aus": {"12L": 0.5}})
    tied = '<bml id="c"><head id="n" lexeme="NOD" start="a:n:end+120"/></bml>'

    async def before(url: str, service: subprocess.Popen[str]) -> list[str]:
        async with asyncio.timeout(LIMIT), connect(f"{url}?session=long", max_queue=None) as client:
            for message in (SCENE, hold, FIRST):
                await client.send(message)
            received = await read_feedback(client, "a:end")
            for _ in range(ENTRIES):
                await client.send(SCENE)
            while not in_a_checkpoint(where, "long"):  # the face comes to rest
                await client.send('{"type": "ping"}')
                await client.recv()
            await client.send(tied)
            await client.send(NEXT.replace("APPEND", "MERGE"))
            received += await read_feedback(client, "b:start")
            service.kill()
            return received + await read_feedback(client, "never")

    async def after(url: str, seen: int) -> tuple[list[str], list[str], dict[str, float]]:
        async with asyncio.timeout(LIMIT), connect(f"{url}?session=long&seen={seen}") as client:
            rest = await read_feedback(client, "b:end")
            await client.send('{"type": "state"}')
            state = json.loads(await client.recv())
        async with asyncio.timeout(LIMIT), connect(f"{url}?session=long&seen=0") as client:
            return rest, await read_feedback(client, "b:end"), state["characters"][0]["aus"]

    with serving("--journal", where) as (url, service):
        first = asyncio.run(before(url, service))
    with serving("--journal", where) as (url, _):
        rest, again, held = asyncio.run(after(url, seq_numbers(first)[-1]))
    assert seq_numbers(first + rest) == list(range(1, len(first + rest) + 1))
    assert again == first + rest
    assert held["12L"] == 0.5
    assert not any("warningFeedback" in text for text in again)  # the points of what has gone are known


def test_restored_session_writes_a_checkpoint_without_messages(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("realizer.server.runtime.session_host.EXPIRY_INTERVAL", 0.05)
    where = str(tmp_path / "journal.db")

    async def run() -> None:
        settings = Settings(port=0, voice="silent", journal=where)
        async with (
            asyncio.timeout(LIMIT),
            Server(settings) as server,
            connect(f"{server.url}?session=one") as one,
            connect(f"{server.url}?session=two") as two,
        ):
            for client in (one, two):
                for _ in range(ENTRIES):
                    await client.send(SCENE)
            await wait_for(lambda: in_a_checkpoint(where, "one") and in_a_checkpoint(where, "two"))

    asyncio.run(run())


@pytest.mark.parametrize("where", ["redis"], indirect=True)
@pytest.mark.slow
def test_restored_sessions_of_fifty_clients_repeat_no_feedback(where: str) -> None:
    block = '<bml id="b"><head id="n" lexeme="NOD" start="{:.2f}" end="{:.2f}"/></bml>'
    received: dict[int, list[str]] = {k: [] for k in range(50)}

    async def before(url: str, service: subprocess.Popen[str]) -> None:
        playing = asyncio.Barrier(len(received))

        async def one(k: int) -> None:
            async with connect(f"{url}?session=one-{k}") as client:
                await client.send(SCENE)
                await client.send(block.format(k / 50, 1.5 + k / 50))
                received[k] += await read_feedback(client, "b:start")
                await playing.wait()  # all of them play, each is elsewhere
                service.kill()
                received[k] += await read_feedback(client, "never")

        async with asyncio.timeout(LIMIT):
            await asyncio.gather(*map(one, received))

    async def after(url: str) -> None:
        async def one(k: int) -> None:
            seen = seq_numbers(received[k])[-1]
            async with connect(f"{url}?session=one-{k}&seen={seen}") as client:
                received[k] += await read_feedback(client, "b:end")

        async with asyncio.timeout(LIMIT):
            await asyncio.gather(*map(one, received))

    with serving("--journal", where) as (url, service):
        asyncio.run(before(url, service))
    assert any("b:end" not in text for texts in received.values() for text in texts[-1:])
    with serving("--journal", where) as (url, _):
        asyncio.run(after(url))
    for texts in received.values():
        seqs = seq_numbers(texts)
        assert seqs == list(range(1, len(seqs) + 1))
        assert points(texts) == ["b:start", *(f"b:n:{point}" for point in POINTS), "b:end"]


@pytest.mark.parametrize("where", ["file"], indirect=True)
@pytest.mark.slow
def test_restored_session_holds_set_values(where: str) -> None:
    async def hold(url: str) -> None:
        async with asyncio.timeout(LIMIT), connect(f"{url}?session=held") as client:
            await client.send(json.dumps({"type": "set", "aus": {"12L": 0.5}}))
            await client.send('<bml id="m"><faceLexeme id="f" lexeme="SMILE" end="0.2"/></bml>')
            await read_feedback(client, "m:end")

    async def state(url: str) -> dict[str, float]:
        async with asyncio.timeout(LIMIT), connect(f"{url}?session=held") as client:
            await client.send(json.dumps({"type": "state"}))
            async for message in client:
                if isinstance(message, str) and '"state"' in message:
                    aus: dict[str, float] = json.loads(message)["characters"][0]["aus"]
                    return aus
        raise AssertionError("no state")

    with serving("--journal", where) as (url, _):
        asyncio.run(hold(url))
    for _again in range(2):  # the one that went on with it is killed too
        with serving("--journal", where) as (url, _):
            assert asyncio.run(state(url))["12L"] == 0.5


@pytest.mark.slow
def test_restored_session_belongs_to_the_last_process(where: str) -> None:
    async def test(one: str, other: str) -> None:
        async with asyncio.timeout(LIMIT), connect(f"{one}?session=torn") as first:
            await first.send(NEXT)
            await read_feedback(first, "b:start")
            async with connect(f"{other}?session=torn&seen=0") as second:
                await read_feedback(second, "b:end")
                with contextlib.suppress(
                    ConnectionClosed
                ):  # services look regularly: it may be closed already
                    await first.send('<bml id="c"><head id="n" lexeme="NOD"/></bml>')
                with pytest.raises(ConnectionClosed) as closed:
                    await drained(first)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1012
        assert "torn" in closed.value.rcvd.reason

    with serving("--journal", where) as (one, _), serving("--journal", where) as (other, _):
        asyncio.run(test(one, other))


@asynccontextmanager
async def two_that_share(where: str) -> AsyncIterator[tuple[Server, Server]]:
    """Two services with one journal, for so long at most."""
    settings = Settings(port=0, voice="silent", journal=where)
    async with asyncio.timeout(LIMIT), Server(settings) as one, Server(settings) as other:
        yield one, other


async def smiles(client: ClientConnection) -> None:
    """Wait until AU 12L has risen to 0.5."""
    value = 0.0
    while value < 0.5:
        await client.send('{"type": "state"}')
        layers = json.loads(await client.recv())["characters"][0]["layers"]
        value = layers.get("direct", {"aus": {}})["aus"].get("12L", 0.0)


def test_restored_session_is_unchanged_by_connections_that_still_leave(
    where: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_host, "EXPIRY_INTERVAL", 0.05)
    monkeypatch.setattr(protocols, "GOODBYE", LIMIT)

    async def run() -> None:
        async with (
            two_that_share(where) as (one, other),
            connect(f"{one.url}?session=deaf") as deaf,
        ):
            deaf.transport.pause_reading()  # it does not notice that it is disconnected
            async with connect(f"{other.url}?session=deaf") as second:
                await second.send('{"type": "set", "aus": {"12L": 0.5}}')
                while not one._sessions._registry.sessions["deaf"].closed:
                    await asyncio.sleep(0)
                await smiles(second)
            async with connect(f"{one.url}?session=deaf") as back:
                await smiles(back)
            deaf.transport.resume_reading()

    asyncio.run(run())


def test_restored_session_disconnects_viewers_of_the_old_process(
    where: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_host, "EXPIRY_INTERVAL", 0.05)

    async def run() -> None:
        async with (
            two_that_share(where) as (one, other),
            connect(f"{one.url}?session=seen") as watching,
            connect(f"{one.url}?session=stays") as stays,
        ):
            await watching.send(NEXT)
            await read_feedback(watching, "b:end")
            async with connect(f"{other.url}?session=seen") as second:
                await second.send('{"type": "set", "aus": {"12L": 0.5}}')
                await smiles(second)  # before the first process takes the session back
                with pytest.raises(ConnectionClosed) as closed:
                    await drained(watching)  # without a message to the first process
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1012
            assert "seen" in closed.value.rcvd.reason
            async with connect(f"{one.url}?session=seen") as back:  # to the process that had lost it
                await smiles(back)
            await stays.send(NEXT)
            await read_feedback(stays, "b:end")

    asyncio.run(run())


def test_restored_session_catches_up_for_a_second_client_without_a_gap(clock: Clock, kept: Settings) -> None:
    block = '<bml id="b"><head id="n" lexeme="NOD"/><wait id="w" duration="3"/></bml>'

    async def run() -> None:
        async with asyncio.timeout(LIMIT):
            async with Server(kept) as server, connect(f"{server.url}?session=s") as client:
                await client.send(block)
                received = await read_feedback(client, "b:n:end")
            clock.step = -3600.0  # what has passed since is not known
            async with Server(kept) as server, connect(f"{server.url}?session=s&seen=1") as first:
                seen = seq_numbers(received)[-1]
                async with connect(f"{server.url}?session=s&seen={seen}") as second:
                    rest = await read_feedback(second, "b:end")
                others = await read_feedback(first, "b:end")
        assert seq_numbers(received + rest) == list(range(1, len(received + rest) + 1))
        assert others == received[1:] + rest

    asyncio.run(run())


@pytest.mark.parametrize("where", ["file"], indirect=True)
@pytest.mark.slow
def test_restored_session_is_not_replaced_by_a_hello(where: str) -> None:
    async def play(url: str) -> list[str]:
        async with asyncio.timeout(LIMIT), connect(f"{url}?session=kept") as client:
            await client.send(NEXT)
            return await read_feedback(client, "b:end")

    async def resume(url: str) -> list[str]:
        async with asyncio.timeout(LIMIT), connect(url) as client:
            await client.send(json.dumps({"type": "hello", "version": 1, "session": "kept", "seen": 0}))
            refused = json.loads(await client.recv())
            assert refused["code"] == "invalid"
            assert refused["message"].endswith("connect to /ws?session=kept&seen=0 instead")
        async with asyncio.timeout(LIMIT), connect(f"{url}?session=kept&seen=0") as client:
            return await read_feedback(client, "b:end")

    with serving("--journal", where) as (url, _):
        received = asyncio.run(play(url))
    with serving("--journal", where) as (url, _):
        assert asyncio.run(resume(url)) == received


NOD = '<bml id="{}"><head id="n" lexeme="NOD" end="0.1"/></bml>'
SLOW = document("linked", 800, "head")  # takes about a second to plan


def noted(where: str) -> ReplayNote | None:
    """Return the note of the session, without a claim."""
    if where.startswith("redis:"):
        text = Redis.from_url(where, decode_responses=True).hget("realizer:{s}:parts", NOTE)
    else:
        with contextlib.closing(sqlite3.connect(where)) as file:
            row = file.execute("SELECT text FROM parts WHERE name = ?", (NOTE,)).fetchone()
        text = None if row is None else row[0]
    return None if text is None else ReplayNote.read({NOTE: str(text)})


def entry_of(where: str, word: str) -> int:
    """Return the index of the text with a word, while no service runs."""
    saved = journal_at(where).claim("s")
    assert saved is not None
    return next(k for k, entry in enumerate(saved.entries) if word in str(entry.body))


async def killed_at(where: str, note: ReplayNote) -> None:
    """Start a service that restores the session, and kill it when it has written a note."""
    with serving("--journal", where) as (url, service):
        async with connect(f"{url}?session=s&seen=0"):
            while noted(where) != note:
                await asyncio.sleep(0)
            service.kill()


@pytest.mark.parametrize("where", ["file"], indirect=True)
@pytest.mark.slow
def test_watch_of_a_document_whose_replay_is_killed_twice_puts_it_aside(where: str) -> None:
    async def test() -> None:
        async with asyncio.timeout(LIMIT):
            with serving("--journal", where) as (url, service):
                async with connect(f"{url}?session=s") as client:
                    await client.send(NOD.format("before"))
                    told = await read_feedback(client, "before:end")
                    await client.send(SLOW)
                    told.append(str(await client.recv()))  # the document is in the journal
                    service.kill()
            entry = entry_of(where, "worst")
            for begun in (1, 2):
                await killed_at(where, ReplayNote(entry, begun))
            with serving("--journal", where) as (url, service):
                async with connect(f"{url}?session=s&seen={len(told)}") as client:
                    (warning,) = [str(await client.recv())]
                    assert re.search(r'<warningFeedback .*id="worst" type="CANNOT_CREATE_BEHAVIOR"', warning)
                    assert "it is put aside" in warning
                    await client.send(NOD.format("after"))
                    rest = [warning, *await read_feedback(client, "after:end")]
                    assert seq_numbers(told + rest) == list(range(1, len(told + rest) + 1))
                page = url.replace("ws://", "http://").removesuffix("/ws")
                with urllib.request.urlopen(f"{page}/metrics") as answer:
                    assert "realizer_quarantined_total 1.0\n" in answer.read().decode()
            with serving("--journal", where) as (url, _):  # it stays aside
                async with connect(f"{url}?session=s&seen={len(told)}") as client:
                    assert await read_feedback(client, "after:end") == rest

    asyncio.run(test())


def notes_of(entries: list[Entry], last: ReplayNote | None = None) -> list[tuple[int, int] | None]:
    """Return the notes of a replay: entry and number of beginnings; None where the note was deleted."""
    notes: list[str | None] = []
    session = Session("s", Settings(idle=False), 0.0, named=True)
    restore_session(session, SavedSession(0.0, entries), lambda _: spoken(), ReplayWatch(notes.append, last))
    found = (None if text is None else ReplayNote.read({NOTE: text}) for text in notes)
    return [None if note is None else (note.entry, note.begun) for note in found]


def entries(*rows: tuple[str, str]) -> list[Entry]:
    return [Entry(float(k), kind, 1, body) for k, (kind, body) in enumerate(rows)]  # type: ignore[arg-type]


JOIN, A, B, TICK = ("join", ""), ("text", NOD.format("a")), ("text", NOD.format("b")), ("tick", "")
READ = (TICK, TICK)  # a document is planned, and its end is found
TALK = ("text", '<bml id="t"><speech id="s"><text>Hello</text></speech></bml>')


def test_watch_notes_each_document_until_it_is_planned() -> None:
    assert notes_of(entries(JOIN, A, *READ, B, *READ)) == [(1, 1), (4, 1), None]


def test_watch_keeps_the_note_of_a_document_that_is_not_planned_yet() -> None:
    assert notes_of(entries(JOIN, A, *READ, B)) == [(1, 1), (4, 1)]
    assert notes_of(entries(JOIN, TALK)) == [(1, 1)]
    assert notes_of(entries(JOIN, TALK, ("spoken", ""), *READ)) == [(1, 1), None]


def test_watch_notes_the_first_of_several_unread_documents() -> None:
    assert notes_of(entries(JOIN, A, B)) == [(1, 1)]
    assert notes_of(entries(JOIN, A, B, *READ, *READ))[-1] is None


def test_watch_counts_how_often_a_replay_of_the_same_entry_was_begun() -> None:
    assert notes_of(entries(JOIN, A, *READ, B), ReplayNote(4, 1)) == [(1, 1), (4, 2)]
    assert notes_of(entries(JOIN, A, *READ, B), ReplayNote(1, 2)) == [(1, 3), (4, 1)]


@pytest.mark.parametrize("last", [None, ReplayNote(1, 1)])
def test_watch_withdraws_the_note_of_a_replay_that_ends_in_order(last: ReplayNote | None) -> None:
    now, notes = 0.0, list[str | None]()
    session = Session("s", Settings(idle=False), 0.0, named=True)
    watch = ReplayWatch(notes.append, last, lambda: now)
    restore_session(session, SavedSession(0.0, entries(JOIN, A)), lambda _: spoken(), watch)
    assert notes[-1] != (before := None if last is None else last.text())
    now = STALLS - 0.1
    watch.withdraw(notes.append)
    assert notes[-1] == before
    count, now = len(notes), STALLS
    watch.withdraw(notes.append)
    assert len(notes) == count, "a document that stalls has failed"


def test_watch_of_a_session_without_documents_writes_nothing() -> None:
    assert notes_of(entries(JOIN, TICK)) == []


@pytest.mark.parametrize("text", ["", "x", "[]", "{}", '{"entry": null, "begun": 1}'])
def test_note_that_is_damaged_is_none(text: str) -> None:
    assert ReplayNote.read({NOTE: text}) is None
    assert ReplayNote.read({}) is None
