"""Tests of `realizer.core.atomic_files`."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from realizer.core.atomic_files import lock, replacing, write_bytes, write_text


def test_write_text_writes_utf8_with_unchanged_line_ends(tmp_path: Path) -> None:
    write_text(tmp_path / "x.txt", "é\r\nb\n")
    assert (tmp_path / "x.txt").read_bytes() == "é\r\nb\n".encode()


def test_write_bytes_replaces_a_file_and_keeps_its_mode(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_bytes(b"old")
    path.chmod(0o640)
    write_bytes(path, b"new")
    assert path.read_bytes() == b"new"
    assert path.stat().st_mode & 0o777 == 0o640
    assert list(tmp_path.iterdir()) == [path]


def test_write_bytes_gives_a_new_file_the_usual_mode(tmp_path: Path) -> None:
    mask = os.umask(0o027)
    try:
        write_bytes(tmp_path / "x", b"")
    finally:
        os.umask(mask)
    assert (tmp_path / "x").stat().st_mode & 0o777 == 0o640


def test_write_bytes_replaces_the_target_of_a_link(tmp_path: Path) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "folder" / "x")
    write_bytes(tmp_path / "link", b"new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "folder" / "x").read_bytes() == b"new"


def test_write_bytes_writes_directly_to_what_is_no_regular_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    write_bytes(tmp_path / "pipe", b"new")
    assert os.read(reader, 9) == b"new"
    os.close(reader)


def test_replacing_leaves_the_old_file_when_the_block_fails(tmp_path: Path) -> None:
    path = tmp_path / "x.mp4"
    path.write_bytes(b"old")

    def fail() -> None:
        with replacing(path) as draft:
            assert draft.suffix == ".mp4"
            draft.write_bytes(b"half")
            raise OSError(errno.ENOSPC, "disk full")

    with pytest.raises(OSError, match="disk full") as failed:
        fail()
    assert failed.value.filename == str(path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_replacing_names_the_folder_that_is_missing(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError), replacing(tmp_path / "no" / "x"):
        pass


def test_lock_is_exclusive_until_its_file_is_closed(tmp_path: Path) -> None:
    with (tmp_path / "x").open("w") as first, (tmp_path / "x").open("w") as second:
        assert lock(first)
        assert not lock(second)
        first.close()
        assert lock(second)
