"""Tests of `realizer_studio.study.results`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realizer_studio.corpus.statistics import Table
from realizer_studio.study.answers import Answer, read_answers
from realizer_studio.study.items import EMOTIONS, Item
from realizer_studio.study.results import PAUL, matching, scores, tables, write_report
from tests.studies import displaced, key, kit, line, matches, named, picture, simulated, write


def answered(tmp_path: Path, found: dict[str, Any], rows: list[list[object]]) -> list[Answer]:
    return read_answers([write(tmp_path / "answers.csv", rows)], found)


def row(table: Table, *cells: str) -> dict[str, Any]:
    (found,) = [line for line in table.rows if set(cells) <= set(map(str, line))]
    return dict(zip(table.columns, found, strict=True))


def table(found: list[Table], name: str) -> Table:
    return next(one for one in found if one.name == name)


def test_matching_is_the_published_table(tmp_path: Path) -> None:
    found = key(matches(4))
    roles = {1: "right right right removed", 2: "right right added none"}
    rows = [
        line(found, f"i{k}", role, j) for j, every in roles.items() for k, role in enumerate(every.split())
    ]
    shown = row(matching(answered(tmp_path, found, rows)), "people")
    assert [shown[role] for role in ("right", "removed", "added", "none")] == [0.625, 0.125, 0.125, 0.125]
    assert shown["from"] < 0.625 < shown["to"]
    assert shown["chi-square"] == pytest.approx((25 + 1 + 1) / (7 / 3) - 7)
    published = row(matching([]), "Wojdel 2005", "visual")
    assert published["right"] == 0.698


def test_intervals_hold_judges_of_known_accuracy(tmp_path: Path) -> None:
    found, chance = key(matches(36)), np.random.default_rng(5)
    held = 0
    for _ in range(20):
        answers = answered(tmp_path, found, simulated(found, 15, 0.7, 0.1, chance))
        shown = row(matching(answers), "people")
        held += shown["from"] <= 0.7 <= shown["to"]
    assert held >= 18


def test_scores_give_the_published_means_of_faceeditor(tmp_path: Path) -> None:
    """Without and with displacements that are not implemented, of the same weights."""
    found = key(displaced([True] * 4 + [False]))
    rows = [line(found, f"i{k}", score) for k, score in enumerate("33210")]
    shown = row(scores(answered(tmp_path, found, rows)), "people")
    assert shown["without unimplemented"] == pytest.approx((3 + 6 + 6 + 1) / 7)
    assert shown["with unimplemented"] == pytest.approx(16 / 9)
    assert sum(PAUL["FaceEditor"][1:5]) == PAUL["FaceEditor"][0]


def test_confusion_counts_names_and_leaves_no_reward_for_one_name(tmp_path: Path) -> None:
    found = key(named(2))
    rows = [line(found, f"i{k}", "joy", judge) for k in range(12) for judge in (1, 2)]
    shown = row(table(tables(answered(tmp_path, found, rows)), "confusion"), "joy")
    assert (shown["hit rate"], shown["anger"]) == (1, 0)
    assert shown["unbiased"] == pytest.approx(1 / 6)


def test_wheel_measures_the_short_way_round(tmp_path: Path) -> None:
    found = key(named())
    rows = [line(found, f"i{k}", "joy", angle=(45 * k + 350) % 360) for k in range(len(EMOTIONS))]
    shown = row(table(tables(answered(tmp_path, found, rows)), "wheel"), "all")
    assert shown["error"] == pytest.approx(-10)
    assert shown["size of error"] == pytest.approx(10)


def test_films_count_no_difference_for_both(tmp_path: Path) -> None:
    pair = {"variant": "ada", "text": "x", "pair": ["enriched", "plain"]}
    films = [Item("films", pair, {}, {"enriched": picture(k), "plain": picture(k + 9)}) for k in range(4)]
    found = key(films)
    rows = [line(found, f"i{k}", role) for k, role in enumerate(("enriched", "enriched", "plain", "same"))]
    shown = row(table(tables(answered(tmp_path, found, rows)), "films"), "enriched")
    assert (shown["one preferred"], shown["same"], shown["share"]) == (2, 1, 0.625)


def test_comparisons_find_the_better_variant(tmp_path: Path) -> None:
    found = key([*matches(6, "ada"), *matches(6, "ben")])
    rows = [
        line(found, f"i{k}", "right" if k < 6 or k - 6 <= judge % 3 else "added", judge)
        for k in range(12)
        for judge in range(6)
    ]
    shown = row(table(tables(answered(tmp_path, found, rows)), "comparisons"), "people")
    assert (shown["one"], shown["other"]) == ("ada", "ben")
    assert shown["difference"] == pytest.approx(2 / 3)
    assert 0.4 < shown["from"] < 2 / 3 < shown["to"] < 0.9


def test_tables_keep_machines_apart_and_leave_out_the_inattentive(tmp_path: Path) -> None:
    check = Item("visual", {"check": "none"}, {}, {"right": picture(1)}, check="none")
    found = key([*matches(2), check])
    rows = [line(found, f"i{k}", role, 1) for k, role in enumerate(("right", "right", "none"))]
    rows += [line(found, f"i{k}", role, 2) for k, role in enumerate(("added", "added", "right"))]
    rows += [line(found, f"i{k}", "removed", "tracking", by="machine") for k in range(2)]
    answers = answered(tmp_path, found, rows)
    assert row(table(tables(answers), "5.1"), "people")["right"] == 1
    assert row(table(tables(answers), "5.1"), "machine")["removed"] == 1
    assert row(table(tables(answers, keep=True), "5.1"), "people")["right"] == 0.5
    assert row(table(tables(answers), "judges"), "failed")["judge"] == "2"
    assert "4.4" not in {one.name for one in tables(answers)}


def test_agreement_of_scores_counts_their_distance(tmp_path: Path) -> None:
    found = key(displaced([True] * 3))
    rows = [line(found, f"i{k}", score, 1) for k, score in enumerate("320")]
    rows += [line(found, f"i{k}", score, 2) for k, score in enumerate("310")]
    shown = row(table(tables(answered(tmp_path, found, rows)), "agreement"), "people")
    assert shown["alpha"] == pytest.approx(1 - 5 * 2 / (2 * (9 * 4 + 4 * 2 + 1 * 2 + 4 + 1 + 1)), abs=0.2)
    assert shown["judges"] == 2
    assert row(table(tables(answered(tmp_path, found, rows)), "4.4"), "people")["score 1"] == 1


def test_write_report_shows_the_items_answered_worst_with_their_pictures(tmp_path: Path) -> None:
    key = json.loads(kit(tmp_path / "s", matches(20)).read_text())
    names = list(key["items"])
    rows = [line(key, name, "right" if k else "added") for k, name in enumerate(names)]
    answers = read_answers([write(tmp_path / "a.csv", rows)], key)
    written = write_report(tmp_path / "out", key, answers, tmp_path / "s", keep=False)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted(written)
    page = (tmp_path / "out" / "report.html").read_text()
    assert page.index("answers: added 1") < page.index("answers: right 1")
    assert page.count("<figure>") == 12
    assert page.count("data:image/webp") == 12 * 5
    write_report(tmp_path / "out", key, answers, tmp_path / "none", keep=False)
    assert "<img" not in (tmp_path / "out" / "report.html").read_text()
