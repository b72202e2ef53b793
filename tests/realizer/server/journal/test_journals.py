"""What every journal holds to, wherever it keeps its entries."""

from __future__ import annotations

import threading
import uuid
from pathlib import Path

import pytest

from realizer.server.journal import Entry, JournalError, SavedSession, TakenOver, journal_at
from realizer.server.journal.entry import RETENTION
from realizer.server.journal.sqlite_journal import SqliteJournal

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


class Clock:
    """What the journals take for the time."""

    now = 1000.0


@pytest.fixture(autouse=True)
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr("realizer.server.journal.sqlite_journal.time", lambda: clock.now)
    return clock


def test_what_was_kept_is_there_for_whoever_takes_the_session_over(where: str, session: str) -> None:
    one, other = journal_at(where), journal_at(where)
    one.begin(session, 1234.5)
    for entry in ENTRIES:
        one.add(session, entry)
    assert other.claim(session) == SavedSession(1234.5, ENTRIES)
    one.close()
    other.close()


def test_who_has_lost_a_session_is_told_when_it_writes(where: str, session: str) -> None:
    one, other = journal_at(where), journal_at(where)
    one.begin(session, 0.0)
    assert other.claim(session) == SavedSession(0.0, [])
    with pytest.raises(TakenOver, match=session):
        one.add(session, ENTRIES[0])
    other.add(session, ENTRIES[1])
    one.end(session)  # which is not its any more
    assert one.claim(session) == SavedSession(0.0, [ENTRIES[1]])


def test_who_looks_finds_which_sessions_are_another_s_now_and_changes_nothing(
    where: str, session: str
) -> None:
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


def test_a_session_that_ended_or_never_was_is_not_taken(where: str, session: str) -> None:
    journal = journal_at(where)
    assert journal.claim(session) is None
    journal.begin(session, 0.0)
    journal.add(session, ENTRIES[0])
    journal.end(session)
    assert journal.claim(session) is None


def test_a_session_that_begins_again_has_nothing_of_the_one_before(where: str, session: str) -> None:
    journal = journal_at(where)
    journal.begin(session, 1.0)
    journal.add(session, ENTRIES[0])
    journal.begin(session, 2.0)
    assert journal.claim(session) == SavedSession(2.0, [])


def test_a_checkpoint_stands_for_what_came_before_and_says_what_has_changed(where: str, session: str) -> None:
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


def test_a_session_that_begins_again_or_ends_has_no_checkpoint(where: str, session: str) -> None:
    journal = journal_at(where)
    for end in (lambda: journal.begin(session, 2.0), lambda: journal.end(session)):
        journal.begin(session, 1.0)
        journal.compact(session, {"state": "old"})
        end()
        journal.begin(session, 2.0)
        assert journal.claim(session) == SavedSession(2.0, [])


def test_who_has_lost_a_session_changes_nothing_by_a_checkpoint(where: str, session: str) -> None:
    one, other = journal_at(where), journal_at(where)
    one.begin(session, 0.0)
    one.add(session, ENTRIES[0])
    other.claim(session)
    with pytest.raises(TakenOver, match=session):
        one.compact(session, {"state": "mine"})
    assert other.claim(session) == SavedSession(0.0, [ENTRIES[0]])


def test_a_checkpoint_that_cannot_be_written_leaves_all_as_it_was(tmp_path: Path, session: str) -> None:
    journal = SqliteJournal(tmp_path / "journal.db")
    journal.begin(session, 0.0)
    journal.add(session, ENTRIES[0])
    (used,) = journal._file.execute("PRAGMA page_count").fetchone()
    journal._file.execute(f"PRAGMA max_page_count = {used}")
    with pytest.raises(JournalError, match="full"):
        journal.compact(session, {"state": "small", "clip:a": "x" * 100_000})
    assert journal.claim(session) == SavedSession(0.0, [ENTRIES[0]])


def test_sessions_have_nothing_to_do_with_each_other(where: str, session: str) -> None:
    journal = journal_at(where)
    for name, entry in ((session, ENTRIES[0]), (session + "~", ENTRIES[1])):
        journal.begin(name, 0.0)
        journal.add(name, entry)
    assert journal.claim(session) == SavedSession(0.0, [ENTRIES[0]])


@pytest.mark.parametrize(
    "where", ["/nowhere/at/all.db", "redis://127.0.0.1:1/0", "redis://:hush@127.0.0.1:1/0"]
)
def test_a_journal_that_cannot_be_had_says_so_without_its_password(where: str) -> None:
    with pytest.raises(JournalError, match=r"^the journal \S+: \w") as fault:
        journal_at(where)
    assert "hush" not in str(fault.value)


def test_sessions_that_nobody_came_back_to_are_forgotten_in_the_end(tmp_path: Path, clock: Clock) -> None:
    begin, path = clock.now, str(tmp_path / "journal.db")
    journal = journal_at(path)
    for name in ("left", "entry", "checkpoint", "both"):
        journal.begin(name, begin)
    journal.add("entry", Entry(100.0, "sound", 1, b"x"))
    journal.compact("checkpoint", {"state": '{"at": 100.0}', "clip:c": "{}"})
    journal.compact("both", {"state": '{"at": 50.0}'})
    journal.add("both", Entry(100.0, "tick"))
    clock.now = begin + RETENTION + 1
    journal = journal_at(path)
    assert journal.claim("left") is None
    assert all(journal.claim(name) is not None for name in ("entry", "checkpoint", "both"))
    clock.now = begin + RETENTION + 101
    journal = journal_at(path)
    assert not any(journal.claim(name) for name in ("entry", "checkpoint", "both"))


def test_a_file_that_is_no_journal_is_not_written_to(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("something of mine, of more than a few bytes\n" * 40)
    with pytest.raises(JournalError, match="not a database"):
        journal_at(str(path))
    assert path.read_text().startswith("something of mine")


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
def test_an_address_that_is_no_journals_is_refused_without_its_password(where: str, says: str) -> None:
    with pytest.raises(JournalError, match=says) as refused:
        journal_at(where)
    assert "hunter2" not in str(refused.value)
