"""An entry is a line that can be read back."""

from __future__ import annotations

from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.server.journal.entry import Entry, JournalError, Kind, SavedSession

SECONDS = st.floats(0, 1e9)


@given(
    SECONDS,
    st.sampled_from(get_args(Kind)),
    st.integers(0, 2**31),
    st.text(st.characters(codec="utf-8")) | st.binary(min_size=1),
)
def test_entry_reads_the_lines_it_writes(at: float, kind: Kind, number: int, body: str | bytes) -> None:
    entry = Entry(at, kind, number, body)
    assert "\n" not in entry.line()
    assert Entry.read(entry.line()) == entry


NONE = """
{
[]
7
{}
{"at": 1}
{"at": 1, "kind": "walk"}
{"at": "x", "kind": "tick"}
{"at": 1, "kind": "sound", "sound": "?"}
{"at": 1, "kind": "text", "body": {}}
"""


@pytest.mark.parametrize("line", NONE.split("\n"))
def test_entry_refuses_other_lines_and_quotes_them(line: str) -> None:
    with pytest.raises(JournalError, match="wanted an entry of a journal, got"):
        Entry.read(line)


def test_saved_session_sets_damaged_entries_aside_one_by_one(caplog: pytest.LogCaptureFixture) -> None:
    good = [Entry(1.0, "join", 1), Entry(2.0, "text", 1, "<bml/>"), Entry(3.0, "leave", 1)]
    lines: list[str | bytes] = [entry.line() for entry in good]
    early = Entry(0.5, "text", 1, "<bml id='b'/>").line()
    damaged = [
        b"\xff\xfe",
        "{",
        "[" * 100_000,
        '{"at": ' + "1" * 5000 + "}",
        '{"at": 1' + "0" * 400 + "}",
        early,
    ]
    lines[2:2] = damaged
    saved = SavedSession.read(0.0, lines, {}, place="entry ")
    aside = [Entry(2.0, "tick")] * 5
    assert saved.entries == [*good[:2], *aside, Entry(2.0, "text", 1, "<bml id='b'/>"), good[2]]
    assert [f"entry {n} is damaged" in caplog.text for n in range(1, 10)] == [False] * 2 + [True] * 6 + [
        False
    ]


def test_saved_session_refuses_a_recording_with_a_damaged_entry() -> None:
    lines = [Entry(1.0, "join", 1).line(), "{"]
    with pytest.raises(JournalError, match=r"^file:3: wanted an entry"):
        SavedSession.read(0.0, lines, {}, {"session": "s"}, "file:")
