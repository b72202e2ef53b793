"""Notes and tasks of the Xface protocol as bytes."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from realizer.server.transports.xface.wire import (
    Note,
    Status,
    Task,
    TaskReader,
    pack_note,
    pack_task,
    read_notes,
)

NAMES = st.from_regex(r"[A-Z][A-Z_]{0,20}", fullmatch=True)
NUMBERS = st.integers(0, 999_999_999)
NOTES = st.lists(st.builds(Note, NAMES, NUMBERS, NUMBERS, st.integers(0, 7)), max_size=5)
PARAMS = st.lists(st.text(st.characters(codec="utf-8", exclude_characters="<\0"), max_size=50), max_size=3)


def test_pack_note_is_the_literal_that_clients_compare() -> None:
    note = pack_note("CONNECTION_OK", 1, 0, Status.UNKNOWN)
    assert note == b'<notify name="CONNECTION_OK" ownerId="1" taskId="0" status="0"/>\0\0'


def test_pack_task_ends_as_the_player_s_own_client_does() -> None:
    task = pack_task(Task("UPLOAD_FAP", 1, 7, ("2.1 x 25 0\n",)))
    assert task == b'<task name="UPLOAD_FAP" ownerId="1" taskId="7"><param>2.1 x 25 0\n</param></task>\0'


@given(NOTES, st.sampled_from([b"", b"\0", b"\0\0", b"\n"]), st.integers(1, 50))
def test_read_notes_accepts_any_end_and_cut(notes: list[Note], end: bytes, cut: int) -> None:
    sent = b"".join(pack_note(n.name, n.owner, n.id, n.status).rstrip(b"\0") + end for n in notes)
    data, got = bytearray(), []
    for begin in range(0, len(sent), cut):
        data += sent[begin : begin + cut]
        got += read_notes(data)
    assert got == notes


def test_read_notes_does_not_store_other_data_for_ever() -> None:
    data = bytearray(b"x" * 10_000)
    assert read_notes(data) == []
    assert len(data) < 1000
    data += pack_note("STOP_PLAYBACK", 1, 2, 3)
    assert read_notes(data) == [Note("STOP_PLAYBACK", 1, 2, 3)]


@given(st.integers(1, 60))
def test_read_notes_keeps_the_begin_of_a_note_behind_other_data(cut: int) -> None:
    note = pack_note("STOP_PLAYBACK", 1, 2, 3)
    data = bytearray(b"x" * 10_000 + note[:cut])
    assert read_notes(data) == []
    data += note[cut:]
    assert read_notes(data) == [Note("STOP_PLAYBACK", 1, 2, 3)]


@given(NAMES.filter(lambda name: name != "UPLOAD_WAV"), NUMBERS, NUMBERS, PARAMS)
def test_pack_task_round_trip(name: str, owner: int, id: int, params: list[str]) -> None:
    task = Task(name, owner, id, tuple(params))
    assert TaskReader(10_000).feed(pack_task(task)) == [task]
