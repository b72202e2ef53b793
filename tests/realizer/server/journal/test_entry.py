"""An entry is a line that can be read back."""

from __future__ import annotations

from typing import get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.server.journal.entry import Entry, JournalError, Kind

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
