"""Documents that end or stall the service whenever a session is restored."""

from __future__ import annotations

import asyncio
import contextlib
import re
import sqlite3
import urllib.request

import pytest
from redis import Redis
from websockets.asyncio.client import connect

from realizer.core.settings import Settings
from realizer.server.journal import Entry, SavedSession, journal_at
from realizer.server.journal.entry import NOTE
from realizer.server.journal.replay import STALLS, ReplayNote, ReplayWatch, restore_session
from realizer.server.session.session import Session
from tests.feedback_log import read_feedback, seq_numbers
from tests.programs import serving
from tests.realizer.server.conftest import spoken
from tests.worst_documents import document

LIMIT = 120  # s; a hung test ends
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
                    assert "realizer_quarantined_total 1\n" in answer.read().decode()
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
