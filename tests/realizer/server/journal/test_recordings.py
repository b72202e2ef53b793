"""Recordings: files that are resumed, replaced by new ones, or refused."""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from realizer.cli import cli
from realizer.server.journal import Entry, JournalError, SavedSession
from realizer.server.journal.recordings import RecordingFolder, read_recording
from tests.programs import running

ENTRIES = [Entry(0.1 * k, "text", 1, f"message {k}") for k in range(6)]
HEAD = {"settings": {"fps": 25.0}, "scene": None}
HOLDS = """
import sys
from pathlib import Path
from realizer.server.journal.recordings import RecordingFolder
record = RecordingFolder(Path(sys.argv[1]), {"settings": {"fps": 25.0}, "scene": None})
record.begin("s", 1e9)
print("holds", flush=True)
sys.stdin.read()
"""


def wrote(folder: Path, entries: list[Entry], parts: dict[str, str] | None = None) -> Path:
    """The record of a process that has died since."""
    record = RecordingFolder(folder, HEAD)
    if parts:
        record.resume("s", SavedSession(1e9, entries, parts))
    else:
        record.begin("s", 1e9)
        for entry in entries:
            record.add("s", entry)
    record.close()
    (path,) = folder.iterdir()
    return path


def gone_on(folder: Path, kept: SavedSession) -> list[Path]:
    """The records there are when a session was taken over and one thing more was done."""
    record = RecordingFolder(folder, HEAD)
    record.resume("s", kept)
    record.add("s", Entry(9.0, "tick"))
    record.close()
    return sorted(folder.iterdir(), key=lambda path: (len(path.name), path.name))


@pytest.mark.parametrize("written", [0, 4, 5, 6])
def test_recording_resumes_with_the_entries_it_lacks(written: int, tmp_path: Path) -> None:
    path = wrote(tmp_path, ENTRIES[:written])
    with path.open("a") as broken:
        broken.write('{"at": 0.')
    assert gone_on(tmp_path, SavedSession(1e9, ENTRIES)) == [path]
    assert read_recording(path).entries == [*ENTRIES, Entry(9.0, "tick")]


def test_recording_resumes_after_a_checkpoint_it_does_not_contain(tmp_path: Path) -> None:
    path = wrote(tmp_path, ENTRIES[:5])
    assert gone_on(tmp_path, SavedSession(1e9, ENTRIES[3:], {"state": "{}"})) == [path]
    assert read_recording(path).entries == [*ENTRIES, Entry(9.0, "tick")]
    assert not read_recording(path).parts


def test_recording_that_began_with_a_checkpoint_resumes(tmp_path: Path) -> None:
    path = wrote(tmp_path, ENTRIES[:2], {"state": "{}"})
    assert gone_on(tmp_path, SavedSession(1e9, ENTRIES, {"state": "{}"})) == [path]
    assert read_recording(path).entries == [*ENTRIES, Entry(9.0, "tick")]
    assert read_recording(path).parts == {"state": "{}"}


@pytest.mark.parametrize(
    ("written", "kept"),
    [
        (ENTRIES, SavedSession(1e9, ENTRIES[:3])),  # more than in the journal
        ([ENTRIES[0], ENTRIES[2]], SavedSession(1e9, ENTRIES)),  # a hole
        (
            ENTRIES[:2],
            SavedSession(1e9, ENTRIES[4:], {"state": "{}"}),
        ),  # the entries before the checkpoint are missing
        (ENTRIES, SavedSession(1e9, [], {"state": "{}"})),  # it cannot be known whether they are
    ],
)
def test_recording_that_lacks_other_entries_stays_and_another_begins(
    written: list[Entry], kept: SavedSession, tmp_path: Path
) -> None:
    path = wrote(tmp_path, written)
    before = path.read_bytes()
    _, other = gone_on(tmp_path, kept)
    assert path.read_bytes() == before
    record = read_recording(other)
    assert record.entries == [*kept.entries, Entry(9.0, "tick")]
    assert record.parts == kept.parts


def test_recording_of_other_settings_stays_and_another_begins(tmp_path: Path) -> None:
    path = wrote(tmp_path, ENTRIES)
    path.write_bytes(path.read_bytes().replace(b"25.0", b"30.0"))
    path.with_stem(path.stem + "-2").write_bytes(b"\xff\xfe\n")
    assert len(gone_on(tmp_path, SavedSession(1e9, ENTRIES))) == 3
    assert len(gone_on(tmp_path, SavedSession(1e9, [*ENTRIES, Entry(9.0, "tick")]))) == 3


def test_recording_that_another_process_writes_is_not_touched(tmp_path: Path) -> None:
    command = [sys.executable, "-c", HOLDS, str(tmp_path)]
    with running(command, stdin=subprocess.PIPE) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "holds\n"
        first, second = gone_on(tmp_path, SavedSession(1e9, ENTRIES))
    assert read_recording(first).entries == []
    assert read_recording(second).entries == [*ENTRIES, Entry(9.0, "tick")]


def test_recording_on_a_full_disk_has_whole_lines_only(tmp_path: Path) -> None:
    journal = RecordingFolder(tmp_path, {})
    journal.begin("s", 0.0)
    first, refused, last = (Entry(at, "text", 1, "x" * 100) for at in (1.0, 2.0, 3.0))
    journal.add("s", first)
    (path,) = tmp_path.iterdir()
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size + 50, hard))  # room for half a line
    try:
        with pytest.raises(JournalError, match="the recording"):
            journal.add("s", refused)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    journal.add("s", last)
    journal.close()
    assert read_recording(path).entries == [first, last]


def test_recording_that_cannot_begin_leaves_no_file(tmp_path: Path) -> None:
    record = RecordingFolder(tmp_path, HEAD)
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20, hard))
    try:
        with pytest.raises(JournalError, match=r"the recording .*File too large"):
            record.begin("s", 1e9)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    record.add("s", ENTRIES[0])
    assert list(tmp_path.iterdir()) == []


BEGIN = b'{"session": "s", "epoch": 0}\n'
TICK = b'{"at": 5, "kind": "tick"}\n'


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (b"", "1: wanted the head of a recording, got ''"),
        (b"\x89PNG\r\n\x1a\n\0\0\xff", "1: wanted the head of a recording"),
        (b"[]\n", "1: wanted the head of a recording"),
        (b"[" * 100_000, "1: wanted the head of a recording"),
        (b'{"session": "s", "epoch": NaN}\n', "1: wanted the head of a recording"),
        (b'{"session": "s", "epoch": 0, "parts": {"state": 7}}\n', "1: wanted the head of a recording"),
        (b'{"session": "s", "epoch": 0, "parts": {"state": "{}"}}\n', "checkpoint of session s cannot be"),
        (BEGIN + b"\xff\xfe\n", "2: wanted UTF-8"),
        (BEGIN + b'{"at": NaN, "kind": "tick"}\n', "2: at: wanted seconds"),
        (BEGIN + b'{"at": 1e999, "kind": "tick"}\n', "2: at: wanted seconds"),
        (BEGIN + TICK + b'{"at": 1, "kind": "tick"}\n', "3: at: wanted seconds, not before 5, got 1"),
        (BEGIN + TICK + b"BML\n", "3: wanted an entry of a journal"),
    ],
)
def test_read_recording_names_the_faulty_line(content: bytes, fault: str, tmp_path: Path) -> None:
    path = tmp_path / "x.jsonl"
    path.write_bytes(content)
    done = CliRunner().invoke(cli, ["replay", str(path)])
    assert done.exit_code == 1
    assert fault in done.output


def test_read_recording_reads_a_file_of_version_1(tmp_path: Path) -> None:
    path = tmp_path / "x.jsonl"
    path.write_text(
        '{"session": "s", "epoch": 1000.5, "settings": {"fps": 25.0}, "scene": {"cup": [0.2, 0, 0.5]}, '
        '"parts": {"state": "{}"}}\n'
        '{"at": 1.0, "kind": "join", "number": 2}\n'
        '{"at": 1.25, "kind": "text", "number": 2, "body": "<bml id=\'b\'/>"}\n'
        '{"at": 1.5, "kind": "sound", "number": 2, "sound": "AAEC"}\n'
        '{"at": 2.0, "kind": "spoken", "number": 3, "body": "the voice failed"}\n'
        '{"at": 2.0, "kind": "leave", "number": 2}\n'
    )
    assert read_recording(path) == SavedSession(
        1000.5,
        [
            Entry(1.0, "join", 2),
            Entry(1.25, "text", 2, "<bml id='b'/>"),
            Entry(1.5, "sound", 2, b"\0\1\2"),
            Entry(2.0, "spoken", 3, "the voice failed"),
            Entry(2.0, "leave", 2),
        ],
        {"state": "{}"},
        {"session": "s", "settings": {"fps": 25.0}, "scene": {"cup": [0.2, 0, 0.5]}},
    )


@pytest.mark.parametrize("content", [BEGIN, BEGIN[:-1], BEGIN + TICK, BEGIN + TICK + b'{"at": 7, "ki'])
def test_read_recording_accepts_a_last_line_cut_short(content: bytes, tmp_path: Path) -> None:
    path, out = tmp_path / "x.jsonl", tmp_path / "x.wav"
    path.write_bytes(content)
    assert CliRunner().invoke(cli, ["replay", str(path)]).output == ""
    assert CliRunner().invoke(cli, ["replay", str(path), "-o", str(out)]).exit_code == 0
    assert out.stat().st_size == 44 + (2 * 22050 * 5 if TICK in content else 0)


def test_read_recording_accepts_a_folder_with_one_file(tmp_path: Path) -> None:
    with pytest.raises(JournalError, match=r"wanted one recording .*, got 0"):
        read_recording(tmp_path)
    path = wrote(tmp_path, ENTRIES)
    (tmp_path / "notes.txt").write_text("something else")
    assert read_recording(tmp_path) == read_recording(path)
    other = tmp_path / "other.jsonl"
    other.write_bytes(BEGIN)
    done = CliRunner().invoke(cli, ["replay", str(tmp_path)])
    assert done.exit_code == 1
    assert f"got 2\n  {other}\n  {path}" in done.output


def test_replay_of_a_recording_that_lasts_too_long_gives_feedback_only(tmp_path: Path) -> None:
    path = tmp_path / "x.jsonl"
    path.write_bytes(BEGIN + b'{"at": 1e9, "kind": "tick"}\n')
    out = CliRunner().invoke(cli, ["replay", str(path), "-o", str(tmp_path / "x.fap")])
    assert "at most 360000 frames" in str(out.exception)
    assert CliRunner().invoke(cli, ["replay", str(path)]).exit_code == 0
