"""Notes and tasks of the Xface protocol as bytes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.server.transports.xface.wire import (
    Fault,
    Note,
    Status,
    Task,
    TaskReader,
    pack_note,
    pack_task,
    read_notes,
)
from tests.rows import each_row

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


LIMIT = 2000
STOP = Task("STOP_PLAYBACK", 1, 9)
NEXT = b'<task name="STOP_PLAYBACK" ownerId="1" taskId="9"></task>'


def found(data: bytes, cut: int = 10_000) -> list[Task | Fault]:
    reader = TaskReader(LIMIT)
    out: list[Task | Fault] = []
    for begin in range(0, len(data), cut):
        out += reader.feed(data[begin : begin + cut])
    return out


@pytest.mark.parametrize("end", [b"", b"\0", b"\0\0", b"\r\n\0"])
def test_reader_accepts_tasks_with_and_without_nuls(end: bytes) -> None:
    assert found(2 * (NEXT + end)) == [STOP, STOP]


@pytest.mark.parametrize(
    ("text", "task"),
    [
        (b'<task name="STOP_PLAYBACK" ownerId="1" taskId="9"/>', STOP),
        (b'<task name="STOP_PLAYBACK" ownerId="1" taskId="9" />', STOP),
        (b"<task taskId='9' name='STOP_PLAYBACK' status='0' ownerId='1' ></task >", STOP),
        (b'\xef\xbb\xbf<?xml version="1.0"?>\n' + NEXT, STOP),
        (b'<task name="A" ownerId="x" taskId="-1"></task>', Task("A")),
        (b'<task name="A"><param/><param>1 &amp; 2</param></task>', Task("A", params=("", "1 &amp; 2"))),
        (
            b'<task name="A"><param><![CDATA[<bml id="b"/>]]></param></task>',
            Task("A", params=('<bml id="b"/>',)),
        ),
        (
            b'<task name="A"><param><s><param>1</param></s></param></task>',
            Task("A", params=("<s><param>1</param></s>",)),
        ),
        (b'<task name="A"><param><taskless/></param></task>', Task("A", params=("<taskless/>",))),
        (b'<task name="A"><param>\xff</param></task>', Task("A", params=("\ufffd",))),
    ],
)
def test_reader_accepts_tasks_in_many_spellings(text: bytes, task: Task) -> None:
    assert found(text) == [task]
    assert found(text, 1) == [task]


BAD = {
    "rubbish": (b"hello", "wanted <task name=...>, got 'hello'"),
    "binary": (bytes(range(1, 256)), "wanted <task name=...>"),
    "another element": (b"<notify/>", "wanted <task name=...>, got '<notify/>'"),
    "half a task": (b'<task name="A"><param>1', "wanted </task>, got a NUL: half a task"),
    "half a tag": (b'<task name="A" owner', "wanted > at the end of <task, got another beginning"),
    "no name": (b'<task ownerId="1"></task>', "wanted <task> with the name of a task, got ''"),
    "no name of one": (b'<task name="a b"></task>', "wanted <task> with the name of a task, got 'a b'"),
    "too long a tag": (b"<task " + b"x" * 5000, "wanted <task ...> of at most 4096 bytes, got more"),
    "too long": (
        b'<task name="A"><param>' + b"x" * 3000 + b"</param></task>",
        "wanted a task of at most 2000 bytes",
    ),
}


@each_row("data, says", BAD.values())
@each_row("cut", [1, 7, 10_000])
def test_reader_reports_one_fault_and_reads_the_next_task(data: bytes, says: str, cut: int) -> None:
    fault, *rest = found(data + b"\0" + NEXT, cut)
    assert isinstance(fault, Fault)
    assert (says if cut > len(data) else says.partition(", got")[0]) in fault.text
    assert rest == [STOP]


def test_reader_returns_the_head_of_a_task_that_is_too_large() -> None:
    head = b'<task name="A" ownerId="1" taskId="7">'
    for cut in (50, 10_000):
        fault, *rest = found(head + b"x" * 3000 + b"</task>\0" + NEXT, cut)
        assert fault == Fault("wanted a task of at most 2000 bytes, got more", Task("A", 1, 7))
        assert rest == [STOP]


def test_reader_returns_the_ids_of_a_task_without_a_name() -> None:
    (fault,) = found(b'<task name="a b" ownerId="2" taskId="7"/>')
    assert fault == Fault("wanted <task> with the name of a task, got 'a b'", Task("", 2, 7))


def test_reader_ends_half_a_task_at_the_next_one_without_a_nul() -> None:
    fault, *rest = found(b'<task name="A" taskId="3"><param>1' + NEXT)
    assert fault == Fault("wanted </task>, got another <task: half a task", Task("A", 0, 3))
    assert rest == [STOP]


@pytest.mark.parametrize("nul", [b"", b"\0"])
@pytest.mark.parametrize("cut", [1, 5, 10_000])
def test_reader_skips_the_bytes_of_an_announced_file(nul: bytes, cut: int) -> None:
    head = b'<task name="UPLOAD_WAV" ownerId="1" taskId="3"><param>a.wav</param><param>12</param></task>'
    task, after = found(head + nul + b"RIFF<task \0\0" + NEXT, cut)
    assert task == Task("UPLOAD_WAV", 1, 3, ("a.wav", "12"))
    assert after == STOP


@pytest.mark.parametrize("size", ["0", "-1", "many", "3000", "9" * 50])
def test_reader_reports_an_absurd_size_and_does_not_wait(size: str) -> None:
    head = f'<task name="UPLOAD_WAV"><param>a.wav</param><param>{size}</param></task>'
    _, fault, after = found(head.encode() + NEXT)
    assert isinstance(fault, Fault)
    assert "wanted 1..2000 bytes to follow" in fault.text
    assert after == STOP


def test_reader_takes_linear_time_for_a_tag_that_never_ends() -> None:
    # A search from each letter would take a minute.
    everything = found(b"<task " + b"x" * 100_000 + b">" + b"y" * 3000 + b"\0" + NEXT)
    assert everything[-1] == STOP


@given(st.binary(max_size=300), st.integers(1, 100))
def test_reader_turns_any_bytes_into_tasks_or_faults(data: bytes, cut: int) -> None:
    everything = found(data.replace(b"UPLOAD_WAV", b"") + b"\0" + NEXT, cut)
    assert everything[-1] == STOP


@given(st.lists(st.sampled_from([NEXT, b"x\0", b"\0", b"<task name='B'/>"]), max_size=8), st.integers(1, 60))
def test_reader_does_not_depend_on_how_a_stream_is_cut(parts: list[bytes], cut: int) -> None:
    data = b"".join(parts)

    def kinds(items: list[Task | Fault]) -> list[object]:
        return [item if isinstance(item, Task) else type(item) for item in items]

    assert kinds(found(data, cut)) == kinds(found(data))
