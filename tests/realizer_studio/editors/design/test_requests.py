"""Tests of `realizer_studio.editors.design.requests`."""

from __future__ import annotations

import json
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import pytest

from realizer.core.settings import Settings
from realizer.expressions.library import builtin
from realizer_studio.editors.design import requests
from realizer_studio.editors.design.requests import Designer

TIMELINE = {
    "channel": [
        {"name": "1", "entries": [{"expression": "template:astonishment", "duration": 3.0}]},
        {"name": "1", "start": 5, "entries": [{"expression": "smile"}]},
    ]
}


def asked(settings: Settings | None = None, **request: Any) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(
        Designer(settings or Settings(voice="silent"), True).answer(json.dumps(request))
    )
    return found


def test_designer_checks_a_timeline() -> None:
    found = asked(tool="check", timeline=TIMELINE)
    assert found["duration"] == pytest.approx(5 + builtin()["smile"].duration)
    assert found["spans"][0] == [pytest.approx([0.0, 0.3, 2.5, 3.0])]
    long, alone = found["advice"]
    assert (long["place"], long["impossible"]) == ([0, 0], True)
    assert "never observed so long" in long["text"]
    assert "0.25 to 2 s" in long["hint"]
    assert (alone["place"], alone["impossible"]) == ([0, 0], False)
    (companion,) = found["companions"]
    assert (companion["track"], companion["expression"]) == (0, "template:surprise")


def test_designer_considers_role_and_mood() -> None:
    smile = {"channel": [{"entries": [{"expression": "template:happiness"}]}]}
    hints = [one["hint"] for one in asked(tool="check", timeline=smile, role="listener")["advice"]]
    assert any("listeners rather show" in hint for hint in hints)
    assert "mood" in asked(tool="check", timeline=smile, mood="wobbly")["error"]


@pytest.mark.parametrize(
    ("request_", "says"),
    [
        ({"tool": "nothing"}, "tool: wanted one of library, check"),
        ({"tool": "check"}, "wanted a timeline in TOML or JSON"),
        ({"tool": "check", "timeline": {"channel": []}}, "wanted channels"),
        (
            {"tool": "check", "timeline": {"channel": [{"entries": [{"expression": "smlie"}]}]}},
            "wanted a name of `realizer expressions list`, got 'smlie', did you mean SMILE?",
        ),
        ({"tool": "frames", "timeline": TIMELINE, "count": 10**6}, "count 1..50"),
        ({"tool": "frames", "timeline": TIMELINE, "face": "../x"}, "face: wanted one of"),
        ({"tool": "frames", "aus": {"99": 1}}, "wanted an action unit"),
        ({"tool": "export", "timeline": TIMELINE, "form": "doc"}, "form: wanted one of toml"),
        ({"tool": "enrich", "text": " "}, "wanted a text"),
        ({"tool": "enrich", "text": "x" * 9000}, "wanted at most 5000 characters"),
        ({"tool": "open", "text": "<bml"}, "wanted <bml>"),
        ({"tool": "sound", "says": [[0, "x" * 9000]]}, "wanted at most 5000 characters"),
        ({"tool": "sound", "says": [[-1, "x"]]}, "wanted starts of 0..3600 s"),
        ({"tool": "library", "find": "AU99"}, "wanted an action unit"),
    ],
)
def test_designer_says_what_is_wrong(request_: dict[str, Any], says: str) -> None:
    assert says in asked(**request_)["error"]


@pytest.mark.parametrize(
    "text", ["{", "[]", "{}", '{"tool": []}', '{"tool": "check", "timeline": ' + "[" * 99_000]
)
def test_designer_survives_what_is_no_request(text: str) -> None:
    assert json.loads(Designer(Settings(), True).answer(text))["error"]


def test_designer_refuses_what_is_too_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(requests, "MAX_REQUEST", 10)
    assert "wanted at most 10 characters" in asked(tool="library")["error"]


def test_designer_finds_expressions_by_word_and_by_action_units() -> None:
    assert [row["name"] for row in asked(tool="library")["expressions"]] == list(builtin())
    assert asked(tool="library", find="sorry")["expressions"][0]["name"] == "template:regret"
    assert asked(tool="library", find="AU1+2")["expressions"][0]["units"] == "1+2"
    assert asked(tool="library", find="xyzzy")["expressions"] == []
    assert "cheerfulness" in asked(tool="library")["moods"]


def test_designer_names_files_of_expressions_without_their_folder(tmp_path: Path) -> None:
    (tmp_path / "expressions").mkdir()
    (tmp_path / "expressions" / "wry.toml").write_text("aus = { 12L = 0.6 }")
    found = asked(Settings(edit=tmp_path), tool="library", find="wry")["expressions"]
    assert (found[0]["file"], found[0]["onset"]) == ("wry", 0.3)
    assert len(found[0]["version"]) == 16
    assert str(tmp_path) not in json.dumps(found)


def test_designer_asks_to_wait_while_pictures_of_expressions_are_drawn(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    drawn: Future[bytes] = Future()
    monkeypatch.setattr(requests, "_sheet", lambda face, settings, edition: drawn)
    assert asked(tool="pictures") == {"id": None, "drawing": True}
    drawn.set_result(b"RIFF")
    assert asked(tool="pictures", face="ada", id=3) == {"id": 3, "picture": "UklGRg=="}
    assert "wanted one of ada" in asked(tool="pictures", face="nobody")["error"]
