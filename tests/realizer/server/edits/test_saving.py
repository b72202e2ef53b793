"""Tests of `realizer.server.edits.edit_folder`."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import pytest

from realizer.expressions.library import library_of
from realizer.protocol.messages.replies import ErrorMessage, Saved
from realizer.protocol.messages.requests import Save
from realizer.server.edits.edit_folder import save
from realizer.server.session.effects import Write

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
