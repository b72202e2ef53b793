"""The tools of the page: faults, emotions and poses, and their errors."""

from __future__ import annotations

import json

import numpy as np
import pytest

from realizer.animation.fap.fap_reader import read_fap
from realizer.core.settings import Settings
from realizer.server.http.page_tools import MAX_TEXT, ToolError, export_pose, lint, preview_emotion
from realizer.tables import faps

NAMES = [row.name for row in faps()]


def faults_of(text: str) -> list[dict]:
    return json.loads(lint(text, Settings()))["faults"]


def test_lint_gives_the_place_of_a_fault() -> None:
    text = '<bml id="a">\n  <head id="n" lexeme="NIX"/>\n</bml>'
    (fault,) = faults_of(text)
    (spot,) = fault["spots"]
    line = text.split("\n")[spot["line"] - 1]
    assert line[spot["column"] - 1 :][: spot["length"]] == "NIX"
    assert "NOD" in fault["notes"][0]
    assert faults_of(text.replace("NIX", "NOD")) == []


def test_lint_marks_advice() -> None:
    (fault,) = faults_of('<bml id="a"><head id="n" lexeme="NOD" start="300"/></bml>')
    assert fault["type"] == "ADVICE"


def test_lint_names_a_hundred_faults_at_most() -> None:
    nods = "".join(f'<head id="n{k}" lexeme="NIX"/>' for k in range(102))
    assert len(faults_of(f'<bml id="a">{nods}</bml>')) == 100


@pytest.mark.parametrize(
    "text", ["Hello **there**.", "5 < 6", "I <3 *you*", "<b>Important</b>", '{"type": "stop"}']
)
def test_lint_finds_no_fault_in_a_text(text: str) -> None:
    assert faults_of(text) == []


def test_lint_says_what_is_left_out_of_a_text() -> None:
    (fault,) = faults_of("Hello.\n\nThat is <breeak/> it.")
    assert (fault["type"], fault["spots"]) == ("ADVICE", [])
    assert "<breeak>" in fault["text"]


@pytest.mark.parametrize("text", ["", "no markup", "<", "<bml", "\ud800", "<bml id='a'>" * 300])
def test_lint_answers_any_text(text: str) -> None:
    assert isinstance(faults_of(text), list)


def test_lint_says_that_a_text_is_too_long() -> None:
    answer = json.loads(lint("x" * (MAX_TEXT + 1), Settings()))
    assert answer["faults"] == []
    assert str(MAX_TEXT) in answer["skipped"]


def test_preview_emotion_returns_action_units_or_faps() -> None:
    own = json.loads(preview_emotion('{"angle": 45, "activation": 7}'))
    assert own["shares"] == {"fear": 1.0}
    assert own["values"]["20L"] == own["values"]["20R"] > 0.5
    published = json.loads(preview_emotion('{"angle": 45, "activation": 5, "profile": "published"}'))
    assert set(published["values"]) <= set(NAMES)
    one = json.loads(preview_emotion('{"name": "fear 8", "profile": "published"}'))
    assert one["values"] != published["values"]


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ("", "JSON"),
        ("[]", "got list"),
        ('{"angle": 9, "activation": 70}', "wanted 0..7, got 70"),
        ('{"angle": "north"}', "feeling: "),
        ('{"name": "hangry"}', "wanted one of"),
        ("{}", "wanted one of a name"),
    ],
)
def test_preview_emotion_refuses_what_is_no_emotion(asked: str, said: str) -> None:
    with pytest.raises(ToolError, match=said):
        preview_emotion(asked)


def test_export_pose_returns_a_fap_file_of_one_frame() -> None:
    text = export_pose(
        '{"type": "set", "aus": {"12L": 1}, "faps": {"open_jaw": 300, "53": 20}}', "ben", Settings()
    )
    clip = read_fap(text)
    assert clip.notes == ()
    assert clip.values.shape == (1, 68)
    row = dict(zip(NAMES, clip.values[0].tolist(), strict=True))
    assert (row["open_jaw"], row["stretch_l_cornerlip_o"]) == (300, 20)
    assert row["raise_l_cornerlip_o"] > 100
    assert row["raise_r_cornerlip_o"] == 0


def test_export_pose_of_nothing_is_the_neutral_face() -> None:
    assert not np.any(read_fap(export_pose('{"type": "set"}', None, Settings())).values)


@pytest.mark.parametrize(
    ("asked", "face", "said"),
    [
        ('{"type": "stop"}', None, "type set"),
        ('{"type": "set", "aus": {"99": 1}}', None, "'99'"),
        ('{"type": "set", "aus": {"12": 7}}', None, "aus"),
        ('{"type": "set"}', "nobody", "nobody"),
    ],
)
def test_export_pose_refuses_other_messages(asked: str, face: str | None, said: str) -> None:
    with pytest.raises(ToolError, match=said):
        export_pose(asked, face, Settings())
