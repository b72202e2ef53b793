"""The Mirror tab in a real browser: a film of a face moves the face of the service."""

from __future__ import annotations

import csv
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import realizer
from tests.browser.test_page import ARGUMENTS, CHROMIUM, PATIENCE, browser, pytestmark, serving

__all__ = ["ARGUMENTS", "CHROMIUM", "browser", "pytestmark"]

pytest.importorskip("ai_edge_litert", reason="needs the track extra")
SMILE = (
    '<bml id="b"><faceFacs id="a" au="12" amount="1" start="0" attackPeak="0.2" relax="6" end="6"/>'
    '<faceFacs id="c" au="6" amount="1" start="0" attackPeak="0.2" relax="6" end="6"/></bml>'
)


@pytest.fixture(scope="module")
def film(tmp_path_factory) -> Path:  # type: ignore[no-untyped-def]
    """Six seconds of a smile."""
    path = tmp_path_factory.mktemp("film") / "smile.webm"
    return realizer.realize(SMILE, face="ida", fps=8, voice="silent").save(path, size=(256, 256))


def play(page, film: Path) -> None:  # type: ignore[no-untyped-def]
    """Show a film again and again, so that a busy machine sees it in time."""
    page.evaluate("document.getElementById('mirror-video').loop = true")
    page.set_input_files("#mirror-file", film)
    page.wait_for_selector("#mirror-units li")


def saved(page, path: Path) -> list[dict[str, str]]:  # type: ignore[no-untyped-def]
    """Return the rows of the table that the page saves."""
    with page.expect_download() as csv_file:
        page.click("#mirror-record")
    csv_file.value.save_as(path)
    return list(csv.DictReader(path.open()))


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    command = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent", "--no-idle"]
    with serving(command) as address:
        yield address


@pytest.fixture
def page(browser, address):  # type: ignore[no-untyped-def]
    opened = browser.new_page(viewport={"width": 1280, "height": 800}, bypass_csp=False)
    opened.set_default_timeout(PATIENCE)
    faults: list[str] = []
    opened.on("pageerror", lambda error: faults.append(str(error)))
    opened.goto(f"{address}#mirror")
    opened.wait_for_selector('#status[data-state="live"]')
    yield opened
    opened.close()
    assert faults == []


def test_mirror_is_open_by_its_address(page) -> None:  # type: ignore[no-untyped-def]
    assert page.is_visible("#mirror")
    page.click("#tab-aus")
    assert page.evaluate("location.hash") == "#aus"
    page.evaluate("location.hash = '#mirror'")
    page.wait_for_selector("#mirror", state="visible")


def test_mirror_shows_the_units_of_a_film_and_saves_them(page, film, tmp_path) -> None:  # type: ignore[no-untyped-def]
    play(page, film)
    page.locator("#mirror-units", has_text="AU 12").wait_for()
    assert re.search("head -?[0-9]+° down", page.text_content("#mirror-seen"))
    held = page.evaluate("realizerPage.link.ask({ type: 'state' })")["characters"][0]["aus"]
    assert any(name.startswith("12") for name in held)
    page.click("#mirror-record")
    page.wait_for_function("() => realizerPage.mirror.rows.length >= 2")
    rows = saved(page, tmp_path / "mirror.csv")
    assert len(rows) >= 2
    assert max(float(row["12L"]) for row in rows) > 0.4
    page.click("#mirror-stop")
    assert page.is_hidden("#mirror-video")
    assert page.text_content("#mirror-units") == ""


def test_mirror_saves_what_it_recorded_up_to_the_end_of_a_film(page, film, tmp_path) -> None:  # type: ignore[no-untyped-def]
    play(page, film)
    page.click("#mirror-record")
    page.wait_for_function("() => realizerPage.mirror.rows.length >= 1")
    page.evaluate("document.getElementById('mirror-video').loop = false")
    page.wait_for_selector("#mirror-stop:disabled")
    assert page.text_content("#mirror-record") == "Save"
    assert saved(page, tmp_path / "mirror.csv")
    assert page.is_disabled("#mirror-record")


def test_mirror_says_what_it_cannot_open(page, tmp_path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "no.webm").write_bytes(b"no film")
    page.set_input_files("#mirror-file", tmp_path / "no.webm")
    page.locator("#log", has_text="film cannot be shown").wait_for()
    page.click("#mirror-camera")  # there is none here
    page.locator("#log", has_text="camera cannot be used").wait_for()
