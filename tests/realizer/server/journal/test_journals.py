"""The contract of every journal: SQLite and Redis."""

from __future__ import annotations

import threading
import uuid

import pytest

from realizer.server.journal import Entry, JournalError, SavedSession, TakenOver, journal_at

pytestmark = pytest.mark.usefixtures("clock")

ENTRIES = [
    Entry(0.0, "join", 1),
    Entry(0.25, "text", 1, '<bml id="b"><speech id="s"><text>Grüße\n\u2028</text></speech></bml>'),
    Entry(0.5, "sound", 1, bytes(range(256))),
    Entry(0.75, "spoken", 3, "the voice failed"),
    Entry(0.875, "tick"),
]


@pytest.fixture
def session() -> str:
    return f"s-{uuid.uuid4()}"


def test_journal_gives_all_entries_to_the_process_that_claims_a_session(where: str, session: str) -> None:
    one, other = journal_at(where), journal_at(where)
    one.begin(session, 1234.5)
    for entry in ENTRIES:
        one.add(session, entry)
    assert other.claim(session) == SavedSession(1234.5, ENTRIES)
    one.close()
    other.close()


def test_journal_refuses_entries_of_a_session_taken_over(where: str, session: str) -> None:
    one, other = journal_at(where), journal_at(where)
    one.begin(session, 0.0)
    assert other.claim(session) == SavedSession(0.0, [])
    with pytest.raises(TakenOver, match=session):
        one.add(session, ENTRIES[0])
    other.add(session, ENTRIES[1])
    one.end(session)  # which is not its any more
    assert one.claim(session) == SavedSession(0.0, [ENTRIES[1]])


def test_journal_finds_sessions_taken_over_and_changes_nothing(where: str, session: str) -> None:
    one, other = journal_at(where), journal_at(where)
    mine, gone, never = session, f"{session}-gone", f"{session}-never"
    one.begin(mine, 0.0)
    one.begin(gone, 0.0)
    other.claim(gone)
    found: list[set[str]] = []
    looking = threading.Thread(target=lambda: found.append(one.taken_over([mine, gone, never])))
    looking.start()
    looking.join()
    assert found == [{gone}]
    assert one.taken_over([]) == one.taken_over([mine]) == set()
    assert other.taken_over([gone]) == set()
    one.add(mine, ENTRIES[0])
    assert other.claim(mine) == SavedSession(0.0, ENTRIES[:1])
    one.close()
    other.close()


def test_journal_has_no_session_that_ended_or_never_began(where: str, session: str) -> None:
    journal = journal_at(where)
    assert journal.claim(session) is None
    journal.begin(session, 0.0)
    journal.add(session, ENTRIES[0])
    journal.end(session)
    assert journal.claim(session) is None


def test_journal_begins_a_session_again_without_its_old_entries(where: str, session: str) -> None:
    journal = journal_at(where)
    journal.begin(session, 1.0)
    journal.add(session, ENTRIES[0])
    journal.begin(session, 2.0)
    assert journal.claim(session) == SavedSession(2.0, [])


def test_journal_replaces_entries_by_the_parts_of_a_checkpoint(where: str, session: str) -> None:
    journal = journal_at(where)
    journal.begin(session, 1.0)
    journal.add(session, ENTRIES[0])
    journal.compact(session, {"state": "one", "clip:a": "Grüße\n\u2028", "clip:b": "b"})
    assert journal.claim(session) == SavedSession(
        1.0, [], {"state": "one", "clip:a": "Grüße\n\u2028", "clip:b": "b"}
    )
    journal.add(session, ENTRIES[1])
    journal.add(session, ENTRIES[2])
    journal.compact(session, {"state": "two", "clip:b": None, "clip:never": None})
    journal.add(session, ENTRIES[3])
    assert journal_at(where).claim(session) == SavedSession(
        1.0, [ENTRIES[3]], {"state": "two", "clip:a": "Grüße\n\u2028"}
    )


def test_journal_deletes_the_checkpoint_of_a_session_that_ends(where: str, session: str) -> None:
    journal = journal_at(where)
    for end in (lambda: journal.begin(session, 2.0), lambda: journal.end(session)):
        journal.begin(session, 1.0)
        journal.compact(session, {"state": "old"})
        end()
        journal.begin(session, 2.0)
        assert journal.claim(session) == SavedSession(2.0, [])


def test_journal_refuses_the_checkpoint_of_a_session_taken_over(where: str, session: str) -> None:
    one, other = journal_at(where), journal_at(where)
    one.begin(session, 0.0)
    one.add(session, ENTRIES[0])
    other.claim(session)
    with pytest.raises(TakenOver, match=session):
        one.compact(session, {"state": "mine"})
    assert other.claim(session) == SavedSession(0.0, [ENTRIES[0]])


def test_journal_stores_and_deletes_the_note_about_a_replay(where: str, session: str) -> None:
    one, other = journal_at(where), journal_at(where)
    one.begin(session, 0.0)
    one.add(session, ENTRIES[0])
    for text in ("first", "second"):
        one.note(session, text)
        assert one.claim(session) == SavedSession(0.0, [ENTRIES[0]], {"replay": text})
    one.note(session, None)
    assert other.claim(session) == SavedSession(0.0, [ENTRIES[0]])
    with pytest.raises(TakenOver, match=session):
        one.note(session, "mine")


def test_journal_replaces_an_entry_and_deletes_the_note(where: str, session: str) -> None:
    one, other, aside = journal_at(where), journal_at(where), Entry(0.25, "aside", 1, "<bml/>")
    one.begin(session, 0.0)
    other.begin(session + "~", 0.0)
    for entry in ENTRIES[:3]:
        one.add(session, entry)
        other.add(session + "~", entry)
    one.note(session, "second")
    one.replace(session, 1, aside)
    assert one.claim(session) == SavedSession(0.0, [ENTRIES[0], aside, ENTRIES[2]])
    with pytest.raises(JournalError):
        one.replace(session, 3, aside)
    one.add(session, ENTRIES[4])
    assert other.claim(session) == SavedSession(0.0, [ENTRIES[0], aside, ENTRIES[2], ENTRIES[4]])
    with pytest.raises(TakenOver, match=session):
        one.replace(session, 1, ENTRIES[1])


def test_journal_keeps_sessions_apart(where: str, session: str) -> None:
    journal = journal_at(where)
    for name, entry in ((session, ENTRIES[0]), (session + "~", ENTRIES[1])):
        journal.begin(name, 0.0)
        journal.add(name, entry)
    assert journal.claim(session) == SavedSession(0.0, [ENTRIES[0]])


@pytest.mark.parametrize(
    "where", ["/nowhere/at/all.db", "redis://127.0.0.1:1/0", "redis://:hush@127.0.0.1:1/0"]
)
def test_journal_at_raises_without_the_password(where: str) -> None:
    with pytest.raises(JournalError, match=r"^the journal \S+: \w") as fault:
        journal_at(where)
    assert "hush" not in str(fault.value)


@pytest.mark.parametrize(
    ("where", "says"),
    [
        ("redis://:hunter2@127.0.0.1:1/0", r"the journal redis://127\.0\.0\.1:1/0: .*refused"),
        ("redis://127.0.0.1:1/0?password=hunter2", r"the journal redis://127\.0\.0\.1:1/0: .*refused"),
        ("redis://127.0.0.1:1/0?pasword=hunter2", "unexpected keyword argument 'pasword'"),
        ("redis://127.0.0.1:1/0?db=hunter2", "Invalid value for 'db'"),
        ("redis://:hunter2#x@127.0.0.1:1/0", "wanted redis://"),
        ("redis://:x#hunter2@127.0.0.1:1/0", "wanted redis://"),
        ("redis://joe:1/hunter2@127.0.0.1:1/0", "wanted redis://"),
        ("redis://:hunter2@127.0.0.1:1/first", "wanted redis://"),
        ("unix://joe:hunter2@/no/such/socket", "the journal unix:///no/such/socket: "),
        ("postgres://joe:hunter2@127.0.0.1/it", "wanted a file, or redis://"),
        ("Redis://:hunter2@127.0.0.1", "wanted a file, or redis://"),
        ("sqlite:///no/such/folder/x.db", "the journal /no/such/folder/x.db: unable to open"),
    ],
)
def test_journal_at_refuses_other_addresses_without_the_password(where: str, says: str) -> None:
    with pytest.raises(JournalError, match=says) as refused:
        journal_at(where)
    assert "hunter2" not in str(refused.value)
