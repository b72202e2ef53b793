"""Tests of `realizer_studio.corpus.report`."""

import csv
from pathlib import Path

from realizer_studio.corpus.recording import Annotation, Recording
from realizer_studio.corpus.report import describe, html
from realizer_studio.corpus.statistics import Study, Table


def test_describe_writes_a_table_each_and_one_report(tmp_path: Path) -> None:
    labels = tuple(Annotation(k, k + 0.48, "anger", by) for k in range(8) for by in ("eva", "otto"))
    names = describe(tmp_path / "out", Study([Recording("r", {}, labels)]), tmp_path)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted(names)
    assert {"6.3.csv", "6.14.csv", "agreement.csv", "knowledge.toml", "report.html"} <= set(names)
    with (tmp_path / "out" / "6.3.csv").open() as file:
        rows = list(csv.reader(file))
    assert rows[:2] == [["expression", "segments", "frames", "percent"], ["anger", "8", "96", "51.34"]]
    assert "<td>anger<td>1" in (tmp_path / "out" / "report.html").read_text()


def test_html_escapes_names_and_shows_the_picture() -> None:
    page = html("Title", [Table("x", "a < b", ("<c>",), ((None,), (0.12345,)))], {"a > b": [b"png"]})
    assert "a &lt; b" in page
    assert "<th>&lt;c&gt;" in page
    assert "<td>0.1235" in page or "<td>0.1234" in page
    assert "data:image/png;base64,cG5n" in page
    assert "a &gt; b" in page
    assert "<img" not in html("Title", [], {})
