"""Tests of `realizer explain`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.commands import run

BML = '<bml id="b"><faceLexeme id="f" lexeme="SMILE" start="0" end="1"/></bml>'


def test_explain_prints_the_eight_steps() -> None:
    done = run("explain", "-", stdin=BML)
    assert done.returncode == 0
    assert [line[0] for line in done.stdout.splitlines() if line[0] != " "] == list("12345678")


def test_explain_speaks_a_text() -> None:
    assert "speech speech" in run("explain", "Hello there", "--voice", "silent").stdout


@pytest.mark.gl
def test_explain_writes_a_page(tmp_path: Path) -> None:
    page = tmp_path / "x.html"
    assert run("explain", "-", "-o", str(page), stdin=BML).returncode == 0
    assert page.read_text().startswith("<!doctype html>")
    assert run("explain", "-", "-o", str(tmp_path / "x.txt"), stdin=BML).returncode == 2


def test_explain_draws_the_steps(tmp_path: Path) -> None:
    drawing = tmp_path / "x.svg"
    assert run("explain", "-", "-o", str(drawing), stdin=BML).returncode == 0
    text = drawing.read_text()
    assert all(f">{number} {name}<" in text for number, name in ((1, "parse"), (3, "schedule"), (8, "draw")))
    assert text.count("<path") + text.count("<polyline") > 10  # the timeline and the curves


def test_explain_reports_a_document_that_is_refused() -> None:
    done = run("explain", "-", stdin="<bml/>")
    assert (done.returncode, done.stdout) == (1, "")
    assert "id: wanted one" in done.stderr
