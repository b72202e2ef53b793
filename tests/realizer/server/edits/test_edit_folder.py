"""Tests of `realizer.server.edits.edit_folder`."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from realizer.core import atomic_files
from realizer.server.edits import edit_folder
from realizer.server.edits.edit_folder import LOCK, EditError, EditFolder, version_of


def files(folder: Path) -> dict[str, bytes]:
    """Return the contents of the files in a folder, without the lock."""
    found = (path for path in folder.rglob("*") if path.is_file() and path.name != LOCK)
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


def test_write_makes_folders_and_replaces_the_version_it_names(tmp_path: Path) -> None:
    folder = EditFolder(tmp_path)
    first = folder.write("faces", "ada2", "mpeg4", suffix=".toml", content=b"1", version=None)
    assert first == version_of(b"1")
    second = folder.write("faces", "ada2", "mpeg4", suffix=".toml", content=b"2", version=first)
    assert second != first
    assert files(tmp_path) == {"faces/ada2/mpeg4.toml": b"2"}


def test_write_refuses_to_replace_what_somebody_has_changed(tmp_path: Path) -> None:
    folder = EditFolder(tmp_path)
    opened = folder.write("a", suffix=".xml", content=b"1", version=None)
    folder.write("a", suffix=".xml", content=b"of another", version=opened)
    cases = {opened: "it was changed since it was opened", None: "wanted a new name, as there is such a file"}
    for version, says in cases.items():
        with pytest.raises(EditError, match=says) as refused:
            folder.write("a", suffix=".xml", content=b"mine", version=version)
        assert refused.value.code == "conflict"
    (tmp_path / "a.xml").rename(tmp_path / "b.xml")
    with pytest.raises(EditError, match="is gone"):
        folder.write("a", suffix=".xml", content=b"mine", version=opened)
    assert files(tmp_path) == {"b.xml": b"of another"}


@pytest.mark.parametrize(
    "name", ["../out", "..", "a/b", "/etc/passwd", "a\\b", "", "A", "a.b", "a\0", "x" * 65]
)
def test_write_refuses_names_that_could_lead_elsewhere(tmp_path: Path, name: str) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    with pytest.raises(EditError, match="name: wanted a-z"):
        EditFolder(inside).write("expressions", name, suffix=".toml", content=b"", version=None)
    assert files(tmp_path) == {}


def test_write_refuses_a_suffix_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(EditError, match="a suffix such as"):
        EditFolder(tmp_path).write("a", suffix="/../b", content=b"", version=None)


def test_write_follows_no_link_out_of_the_folder(tmp_path: Path) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "expressions").symlink_to(tmp_path)
    with pytest.raises(EditError, match="got a link to another"):
        EditFolder(inside).write("expressions", "a", suffix=".toml", content=b"", version=None)
    assert files(tmp_path) == {}


def test_write_refuses_too_many_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(edit_folder, "MAX_FILE", 3)
    with pytest.raises(EditError, match="wanted at most 3 bytes, got 4"):
        EditFolder(tmp_path).write("a", suffix=".glb", content=b"1234", version=None)


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS, errno.EACCES])
def test_write_says_why_the_disk_takes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    folder = EditFolder(tmp_path)
    version = folder.write("a", suffix=".toml", content=b"old", version=None)

    def refuse(self: Path, content: bytes) -> int:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(Path, "write_bytes", refuse)
    with pytest.raises(EditError, match=f"a.toml: cannot be saved: {os.strerror(number)}"):
        folder.write("a", suffix=".toml", content=b"new", version=version)
    assert files(tmp_path) == {"a.toml": b"old"}


def test_write_does_not_compete_with_another_process(tmp_path: Path) -> None:
    with (tmp_path / LOCK).open("a") as held:
        assert atomic_files.lock(held)
        with pytest.raises(EditError, match="try again"):
            EditFolder(tmp_path).write("a", suffix=".toml", content=b"", version=None)
    assert files(tmp_path) == {}
