"""Tests of `realizer_studio.study.report`."""

from __future__ import annotations

import json
from pathlib import Path

from realizer_studio.study.answers import read_answers
from realizer_studio.study.report import write_report
from tests.studies import kit, line, matches, write


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
