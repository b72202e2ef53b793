"""Tests of `realizer_studio.study.answers`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from realizer.core.errors import TableError
from realizer_studio.study.answers import inattentive, read_answers, read_key
from realizer_studio.study.items import Item
from tests.studies import key, line, matches, named, write

KEY = key([*matches(2), *named()])


def test_read_answers_says_what_pictures_were(tmp_path: Path) -> None:
    rows = [line(KEY, "i0", "right"), line(KEY, "i1", "none"), line(KEY, "i2", "anger", angle=225)]
    found = read_answers([write(tmp_path / "a.csv", rows)], KEY)
    assert [(one.role, one.right, one.angle) for one in found] == [
        ("right", True, None),
        ("none", False, None),
        ("anger", True, 225.0),
    ]
    assert {one.group for one in found} == {"people"}


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([], "at least one answer"),
        ([line({**KEY, "study": "s2"}, "i0", "right")], "line 2: wanted answers of the study s1, got s2"),
        (
            [["s1", "1", "person", "x", "visual", "right", "", "", "", "", ""]],
            "line 2, item: wanted one of the study, got 'x'",
        ),
        ([line(KEY, "i0", "joy")], "line 2, answer: wanted a choice of this item, got 'joy'"),
        ([line(KEY, "i0", "right")] * 2, "line 3: judge 1 has answered this at"),
        ([line(KEY, "i2", "joy", angle="up")], "wanted numbers"),
    ],
)
def test_read_answers_refuses_what_does_not_belong(
    rows: list[list[object]], said: str, tmp_path: Path
) -> None:
    with pytest.raises(TableError) as error:
        read_answers([write(tmp_path / "a.csv", rows)], KEY)
    assert said in str(error.value)


def test_read_answers_refuses_another_table(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("a,b\n1,2\n")
    (tmp_path / "b.csv").write_bytes(b"\xff\xfe\x00")
    for name in ("a.csv", "b.csv", "none.csv"):
        with pytest.raises(TableError, match=name):
            read_answers([tmp_path / name], KEY)


def test_read_answers_names_the_empty_file(tmp_path: Path) -> None:
    (tmp_path / "a.csv").touch()
    with pytest.raises(TableError, match=r"a\.csv: wanted answers with the columns .*, got an empty file"):
        read_answers([tmp_path / "a.csv"], KEY)
    with pytest.raises(TableError, match=r"b\.csv: wanted at least one answer, got none"):
        read_answers(iter([write(tmp_path / "b.csv", [])]), KEY)


def test_read_key_refuses_another_file(tmp_path: Path) -> None:
    for text in ("", "[]", "{}", json.dumps({"study": "s", "items": []})):
        (tmp_path / "k.json").write_text(text)
        with pytest.raises(TableError, match=r"k\.json: wanted the key"):
            read_key(tmp_path / "k.json")


def test_inattentive_judges_failed_a_quarter_of_their_checks(tmp_path: Path) -> None:
    checks = [Item("naming", {"check": "joy"}, {}, check="joy") for _ in range(4)]
    found = key([*named(), *checks])
    rows = [line(found, f"i{6 + k}", "joy" if k else "fear", judge) for judge in (1, 2) for k in range(4)]
    rows[1] = line(found, "i7", "anger", 1)
    answers = read_answers([write(tmp_path / "a.csv", rows)], found)
    assert inattentive(answers) == [("people", "1")]
