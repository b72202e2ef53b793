"""Tests of `realizer.server.editors`."""

from __future__ import annotations

import json

import pytest

from realizer.core.errors import PluginError
from realizer.core.settings import Settings
from realizer.server import editors
from realizer.server.editors import EDITORS, MissingEditor, answer_of, editor_of


def test_editors_of_the_page_are_found_by_entry_points() -> None:
    assert list(EDITORS) == ["design", "label", "studio"]
    assert "--corpus DIR" in editor_of("label", Settings(), may_save=True).answer('{"id": 1, "type": "list"}')


def test_editor_that_cannot_be_loaded_says_so_in_each_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    class Broken(dict[str, object]):
        def __missing__(self, name: str) -> object:
            raise PluginError(f"{name} needs the package x")

    monkeypatch.setattr(editors, "EDITORS", Broken())
    editor = editor_of("label", Settings(), may_save=True)
    fault = "label needs the package x"
    assert json.loads(editor.answer('{"id": 7}')) == {"id": 7, "error": fault}
    assert json.loads(editor.answer(b'\x09\x00\x00\x00{"id": 8}' + bytes(9))) == {"id": 8, "error": fault}
    for text in ("{", "[]", b"", "[" * 100_000):
        assert json.loads(editor.answer(text)) == {"id": None, "error": fault}
    editor.close()
    assert isinstance(editor, MissingEditor)


@pytest.mark.parametrize("name", ["design", "label", "studio"])
def test_editor_answers_whatever_a_page_sends(name: str) -> None:
    editor = editor_of(name, Settings(), may_save=True)
    numbers = "9" * 5000
    for text in (
        "[" * 100_000,
        "[" * 950 + "]" * 950,
        numbers,
        '{"id": 1, "type": ' + numbers + "}",
        "",
        b"",
        "7",
    ):
        assert json.loads(answer_of(editor, text))["error"]
    for body in (
        '"type": "open", "name": 1e999',
        '"type": "list", "recording": {}',
        '"tool": []',
        '"tool": {}',
    ):
        answer = json.loads(answer_of(editor, '{"id": 5, ' + body + "}"))
        assert answer["id"] == 5
        assert answer["error"]
    editor.close()


def test_editor_that_fails_costs_one_message(caplog: pytest.LogCaptureFixture) -> None:
    class Failing(MissingEditor):
        def answer(self, message: str | bytes) -> str:
            raise ZeroDivisionError

    answer = json.loads(answer_of(Failing(""), '{"id": 3}'))
    assert answer == {"id": 3, "error": "an error of the service (ZeroDivisionError): its log says which"}
    assert "ZeroDivisionError" in caplog.text
