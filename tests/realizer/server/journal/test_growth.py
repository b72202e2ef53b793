"""A session that lives long grows neither its journal nor the time in which another process takes it over."""

from __future__ import annotations

import json
import sqlite3
from pathlib import Path

import numpy as np
import pytest

from realizer.core.settings import Settings
from realizer.protocol.wire import ClipPiece, pack_clip
from realizer.server.journal import Journal, JournalError, SavedSession, journal_at
from realizer.server.journal.replay import restore_checkpoint, restore_session
from realizer.server.journal.session_journal import ENTRIES, LONG
from realizer.server.session.connections import LAST
from realizer.server.session.effects import Send, Speak
from realizer.server.session.session import Session
from tests.feedback_log import seq_numbers
from tests.interleavings import Memory, spoken
from tests.wake_times import next_wake

SETTINGS = Settings(voice="silent")
DOCUMENTS = 600  # which takes several checkpoints
APART = 6.0  # s; the face is still between two of them
TALK = '<bml id="b"><speech id="s"><text>Yes</text></speech></bml>'
WAIT = '<bml id="b"><wait id="w" duration="0.5"/></bml>'


def opened(journal: Journal | None) -> Session:
    session = Session("long", SETTINGS, 0.0, named=True, epoch=0.0)
    session.journal.open(journal)
    session.journal.begin(0.0)
    session.connect(1, 0.0)
    return session


def play(session: Session, message: str | bytes, begin: float, until: float) -> None:
    """A message comes, and what follows from it is done as a shell does it."""
    session.receive(1, message, begin)
    now = begin
    while True:
        for effect in session.take_effects():
            if isinstance(effect, Speak):
                session.on_speech(effect.id, spoken(effect), now)
                break
        else:
            if (due := next_wake(session)) > until:
                return
            now = max(now, due)
            session.tick(now)


def talked(session: Session, documents: int) -> float:
    """Play so many documents in a session, and return when it has."""
    for k in range(documents):
        play(session, TALK if k % 100 == 0 else WAIT, APART * k, APART * (k + 1))
    return APART * documents


@pytest.mark.slow
def test_journal_has_no_more_entries_after_hundreds_of_documents(where: str) -> None:
    journal = journal_at(where)
    session = opened(journal)
    most = size = 0
    for k in range(DOCUMENTS):
        play(session, TALK if k % 100 == 0 else WAIT, APART * k, APART * (k + 1))
        if k % 50 == 49:
            kept = journal.claim("long")
            assert kept is not None
            most = max(most, len(kept.entries))
            size = max(size, sum(map(len, kept.parts.values())))
    assert most < ENTRIES + 20
    assert size < 2**20
    assert session.feedback_log.newest > 4 * DOCUMENTS
    kept = journal.claim("long")
    assert kept is not None
    again = Session("long", SETTINGS, 0.0, named=True, epoch=0.0)
    at, owed = restore_session(again, kept, spoken)
    assert not owed
    assert at <= APART * DOCUMENTS
    for one in (session, again):
        play(one, WAIT, APART * DOCUMENTS, APART * (DOCUMENTS + 1))
    assert again.feedback_log.since(again.feedback_log.newest - 5) == session.feedback_log.since(
        session.feedback_log.newest - 5
    )
    assert again.feedback_log.newest == session.feedback_log.newest
    journal.end("long")


def test_journal_file_does_not_grow_with_the_number_of_documents(tmp_path: Path) -> None:
    path = tmp_path / "journal.db"
    session = opened(journal_at(str(path)))
    pages = []
    for k in range(600):
        play(session, WAIT, APART * k, APART * (k + 1))
        if k % 200 == 199:
            with sqlite3.connect(path) as file:
                pages.append(file.execute("PRAGMA page_count").fetchone()[0])
            file.close()
    assert pages[2] == pages[1]


def test_checkpoint_with_less_feedback_than_a_client_missed_sends_a_gap() -> None:
    journal = Memory()
    session = opened(journal)
    end = talked(session, 400)
    kept = journal.claim("long")
    assert kept is not None
    assert len(json.loads(kept.parts["state"])["told"]) <= LAST
    again = Session("long", SETTINGS, 0.0, named=True, epoch=0.0)
    restore_session(again, kept, spoken)
    again.connect(9, end, seen=1)
    gap, *rest = [str(effect.data) for effect in again.take_effects() if isinstance(effect, Send)]
    answer = json.loads(gap)
    assert (answer["type"], answer["seen"]) == ("gap", 1)
    assert answer["first"] > 2
    assert seq_numbers(rest) == list(range(answer["first"], again.feedback_log.newest + 1))


def test_checkpoint_writes_a_clip_once_and_deletes_it_with_its_session() -> None:
    journal = Memory()
    session = opened(journal)
    sounds = []
    for k in range(4):
        session.receive(1, pack_clip(ClipPiece(f"c{k % 2}", 0, 8000, bytes([k, 1]) * 800)), APART * k)
        talked_until = APART * k
        for _ in range(ENTRIES):
            session.receive(1, '{"type": "scene", "objects": null}', talked_until)
        session.compact_journal(talked_until + 1)
        kept = journal.claim("long")
        assert kept is not None
        assert journal.compacted == k + 1
        sounds.append({name: text for name, text in kept.parts.items() if name != "state"})
    assert [sorted(parts) for parts in sounds] == [["clip:c0"], *3 * [["clip:c0", "clip:c1"]]]
    assert sounds[0]["clip:c0"] == sounds[1]["clip:c0"] != sounds[2]["clip:c0"]
    assert sounds[2]["clip:c1"] is sounds[1]["clip:c1"]  # it was not written again


def test_checkpoint_is_written_while_only_emotions_and_idle_motion_move() -> None:
    journal, apart = Memory(), 0.75  # s; the next block comes before the last one's blinks are past
    session = opened(journal)
    for k in range(LONG * ENTRIES // 3 + 10):  # a text and two ticks each
        play(session, TALK if k % 100 == 0 else WAIT, apart * k, apart * (k + 1))
    assert journal.compacted == 1
    kept = journal.claim("long")
    assert kept is not None
    assert len(kept.entries) < ENTRIES
    again = Session("long", SETTINGS, 0.0, named=True, epoch=0.0)
    restore_session(again, kept, spoken)
    tied = '<bml id="c"><head id="n" lexeme="NOD" start="b:w:end+2"/></bml>'
    for one in (session, again):
        play(one, tied, apart * k + 0.7, apart * k + 20)
    assert again.feedback_log.newest == session.feedback_log.newest
    assert again.feedback_log.since(session.feedback_log.newest - 12) == session.feedback_log.since(
        session.feedback_log.newest - 12
    )
    times = apart * k + 10 + np.arange(50) / 25
    assert np.array_equal(again.player.frames(times).faps, session.player.frames(times).faps)


def test_checkpoint_waits_for_pending_blocks_and_open_speeches() -> None:
    preplanned = '<bml id="p" xmlns:bmla="http://www.asap-project.org/bmla" bmla:preplan="true"/>'
    for holds, ends in (
        (preplanned, '{"type": "stop"}'),
        (
            '{"type": "speech", "id": "turn", "append": "Well. "}',
            '{"type": "speech", "id": "turn", "close": true}',
        ),
    ):
        journal = Memory()
        session = opened(journal)
        play(session, holds, 0.0, 100.0)
        for _ in range(ENTRIES):
            play(session, '{"type": "scene", "objects": null}', 100.0, 100.0)
        session.compact_journal(200.0)
        assert not journal.compacted
        play(session, ends, 200.0, 300.0)
        session.compact_journal(300.0)
        assert journal.compacted == 1


@pytest.mark.parametrize(
    ("state", "why"),
    [
        ("{", "Expecting property name"),
        ("[]", "TypeError"),
        ("{}", "KeyError: 'version'"),
        ('{"version": 2}', "wanted one of version 1, got 2"),
        ('{"version": 1}', "KeyError"),
    ],
)
def test_checkpoint_that_cannot_be_read_is_an_error(state: str, why: str) -> None:
    session = Session("s", SETTINGS, 0.0, named=True)
    with pytest.raises(JournalError, match=f"the checkpoint of session s.*{why}"):
        restore_checkpoint(session, {"state": state})
    with pytest.raises(JournalError, match="the checkpoint of session s"):
        restore_session(session, SavedSession(0.0, [], {"clip:c": "{}"}), spoken)
