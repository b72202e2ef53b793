"""Tests of `realizer.server.runtime.edit_folder`."""

from __future__ import annotations

import base64
import errno
import os
from pathlib import Path
from typing import Any

import pytest

from realizer.core import atomic_files
from realizer.expressions.library import library_of
from realizer.protocol.messages.replies import ErrorMessage, Saved
from realizer.protocol.messages.requests import Save
from realizer.server.runtime.edit_folder import LOCK, EditError, EditFolder, save, version_of
from realizer.server.session.effects import Write


def files(folder: Path) -> dict[str, bytes]:
    """Return the contents of the files in a folder, without the lock."""
    found = (path for path in folder.rglob("*") if path.is_file() and path.name != LOCK)
    return {str(path.relative_to(folder)): path.read_bytes() for path in found}


def write(folder: EditFolder, *names: str, suffix: str, content: bytes, version: str | None) -> str:
    return folder.write(folder.path(*names, suffix=suffix), content, version)


def test_write_makes_folders_and_replaces_the_version_it_names(tmp_path: Path) -> None:
    folder = EditFolder(tmp_path)
    first = write(folder, "faces", "ada2", "mpeg4", suffix=".toml", content=b"1", version=None)
    assert first == version_of(b"1")
    second = write(folder, "faces", "ada2", "mpeg4", suffix=".toml", content=b"2", version=first)
    assert second != first
    assert files(tmp_path) == {"faces/ada2/mpeg4.toml": b"2"}


def test_write_refuses_to_replace_what_somebody_has_changed(tmp_path: Path) -> None:
    folder = EditFolder(tmp_path)
    opened = write(folder, "a", suffix=".xml", content=b"1", version=None)
    write(folder, "a", suffix=".xml", content=b"of another", version=opened)
    cases = {opened: "it was changed since it was opened", None: "wanted a new name, as there is such a file"}
    for version, says in cases.items():
        with pytest.raises(EditError, match=says) as refused:
            write(folder, "a", suffix=".xml", content=b"mine", version=version)
        assert refused.value.code == "conflict"
    (tmp_path / "a.xml").rename(tmp_path / "b.xml")
    with pytest.raises(EditError, match="is gone"):
        write(folder, "a", suffix=".xml", content=b"mine", version=opened)
    assert files(tmp_path) == {"b.xml": b"of another"}


@pytest.mark.parametrize(
    "name", ["../out", "..", "a/b", "/etc/passwd", "a\\b", "", "A", "a.b", "a\0", "x" * 65]
)
def test_write_refuses_names_that_could_lead_elsewhere(tmp_path: Path, name: str) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    with pytest.raises(EditError, match="name: wanted a-z"):
        write(EditFolder(inside), "expressions", name, suffix=".toml", content=b"", version=None)
    assert files(tmp_path) == {}


def test_write_follows_no_link_out_of_the_folder(tmp_path: Path) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "expressions").symlink_to(tmp_path)
    with pytest.raises(EditError, match="got a link to another"):
        write(EditFolder(inside), "expressions", "a", suffix=".toml", content=b"", version=None)
    assert files(tmp_path) == {}


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EROFS, errno.EACCES])
def test_write_says_why_the_disk_takes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    folder = EditFolder(tmp_path)
    version = write(folder, "a", suffix=".toml", content=b"old", version=None)

    def refuse(self: Path, content: bytes) -> int:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(Path, "write_bytes", refuse)
    with pytest.raises(EditError, match=f"a.toml: cannot be saved: {os.strerror(number)}"):
        write(folder, "a", suffix=".toml", content=b"new", version=version)
    assert files(tmp_path) == {"a.toml": b"old"}


def test_write_does_not_compete_with_another_process(tmp_path: Path) -> None:
    with (tmp_path / LOCK).open("a") as held:
        assert atomic_files.lock(held)
        with pytest.raises(EditError, match="try again"):
            write(EditFolder(tmp_path), "a", suffix=".toml", content=b"", version=None)
    assert files(tmp_path) == {}


SMIRK = 'name = "Wry smirk"\naus = { 12L = 0.6 }\n'


def saved(folder: Path, content: str = SMIRK, name: str = "smirk", **fields: Any) -> Saved | ErrorMessage:
    message = Save(type="save", kind="expression", name=name, content=content, **fields)
    reply = save(Write(1, message, folder))
    assert isinstance(reply, Saved | ErrorMessage)
    return reply


def test_save_writes_an_expression_that_open_libraries_have_at_once(tmp_path: Path) -> None:
    library = library_of(tmp_path / "expressions")
    assert "wry smirk" not in library
    reply = saved(tmp_path)
    assert isinstance(reply, Saved)
    assert reply.file == "expressions/smirk.toml"
    assert (tmp_path / reply.file).read_text("utf-8") == SMIRK
    library_of(tmp_path / "expressions")  # as the next client does
    assert library["wry smirk"].aus == {(12, "LEFT"): 0.6}
    again = saved(tmp_path, SMIRK.replace("0.6", "0.25"), version=reply.version)
    assert isinstance(again, Saved)
    assert library_of(tmp_path / "expressions")["wry smirk"].aus == {(12, "LEFT"): 0.25}


def test_save_takes_base64(tmp_path: Path) -> None:
    content = base64.b64encode(SMIRK.encode()).decode()
    assert isinstance(saved(tmp_path, content, encoding="base64"), Saved)
    assert (tmp_path / "expressions" / "smirk.toml").read_text("utf-8") == SMIRK


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"content": "aus = { 99 = 1 }"}, "expressions/smirk.toml: aus: wanted an action unit such as"),
        ({"content": "aus = "}, "expressions/smirk.toml: wanted TOML"),
        ({"content": "%", "encoding": "base64"}, "content: wanted base64"),
        ({"content": SMIRK, "name": "other"}, "wanted one of its own, got 'Wry smirk'"),
    ],
)
def test_save_refuses_what_a_library_could_not_load(
    tmp_path: Path, fields: dict[str, Any], says: str
) -> None:
    if "name" in fields:
        saved(tmp_path)
    before = sorted(tmp_path.rglob("*.toml"))
    reply = saved(tmp_path, **fields)
    assert isinstance(reply, ErrorMessage)
    assert says in reply.message
    assert str(tmp_path) not in reply.message
    assert (reply.code, reply.where) == ("edit", "save")
    assert sorted(tmp_path.rglob("*.toml")) == before


def test_save_refuses_the_later_of_two_people(tmp_path: Path) -> None:
    opened = saved(tmp_path)
    assert isinstance(opened, Saved)
    saved(tmp_path, SMIRK + 'means = ["irony"]\n', version=opened.version)
    reply = saved(tmp_path, SMIRK + "onset = 1\n", version=opened.version)
    assert isinstance(reply, ErrorMessage)
    assert reply.code == "conflict"
    assert "irony" in (tmp_path / "expressions" / "smirk.toml").read_text("utf-8")
