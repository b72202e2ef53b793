"""The Label tab in a real browser, on the real service: films, points, labels of two annotators, files."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import realizer
from realizer_studio.corpus.recording import Annotation, Recording, read_recording, write_recording
from tests.accessibility import serious_faults
from tests.browser.test_design import drag, warm
from tests.browser.test_page import ARGUMENTS, CHROMIUM, PATIENCE, browser, pytestmark, serving

__all__ = ["ARGUMENTS", "CHROMIUM", "browser", "pytestmark"]

SMILE = '<bml id="b"><faceFacs id="c" au="12" amount="1" start="1" end="3"/></bml>'
LABELS = "realizerPage.label.model.labels"
TOM: list[Any] = [[0.4, 1.6, "surprise"], [1.2, 2.0, "doubt"]]
WORDS = (Annotation(0.0, 0.6, "Are", "subject"), Annotation(0.6, 1.48, "you", "subject"))


@pytest.fixture(scope="module")
def corpus(tmp_path_factory) -> Path:  # type: ignore[no-untyped-def]
    """A recording with a film and labels of two people, one with points, and one that is half written."""
    folder: Path = tmp_path_factory.mktemp("films")
    (folder / "corpus.toml").write_text("version = 1\n")
    (folder / "anna").mkdir()
    played = realizer.realize(SMILE, face="ida", fps=12.5, voice="silent")
    played.save(folder / "anna" / "film.webm", size=(128, 128))
    labels = [Annotation(0.52, 1.6, "surprise", "eva"), *(Annotation(a, b, c, "tom") for a, b, c in TOM)]
    write_recording(folder / "anna", Recording("anna", {"fps": 25.0, "frames": 75}, tuple(labels), WORDS))
    angle = np.linspace(0, 6, 12)
    places = (
        np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1) * np.linspace(1, 2, 50)[:, None, None]
    )
    write_recording(
        folder / "ben", Recording("ben", {"fps": 20.0}, points=(tuple(map(str, range(12))), places))
    )
    (folder / "cora").mkdir()
    (folder / "cora" / "labels.csv").write_text("start,end,expression,annotator\n")
    return folder


@pytest.fixture(scope="module")
def address(corpus: Path) -> Iterator[str]:
    command = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent", "--no-idle"]
    with serving([*command, "--corpus", str(corpus)]) as address:
        for path in ("faces/ada", "look.json?face=ada", "mirror?light=portrait"):
            warm(f"{address}/{path}")
        yield address


def opened(browser, address: str, **more):  # type: ignore[no-untyped-def]
    page = browser.new_page(**({"viewport": {"width": 1280, "height": 900}, "bypass_csp": True} | more))
    page.set_default_timeout(PATIENCE)
    page.goto(f"{address}#label")
    page.wait_for_selector("#label-names button")
    page.wait_for_function("document.getElementById('label-film').videoWidth > 0")
    return page


@pytest.fixture
def page(browser, address):  # type: ignore[no-untyped-def]
    """The tab with the recording anna; any error on its console fails the test."""
    faults: list[str] = []
    page = opened(browser, address)
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    yield page
    page.close()
    assert faults == []


def annotate(page, name: str) -> None:  # type: ignore[no-untyped-def]
    page.fill("#label-who", name)
    page.press("#label-who", "Enter")
    page.evaluate("document.activeElement.blur()")


def labels(page) -> list[list[object]]:  # type: ignore[no-untyped-def]
    return page.evaluate(LABELS)  # type: ignore[no-any-return]


def press(page, *keys: str) -> None:  # type: ignore[no-untyped-def]
    for key in keys:
        page.keyboard.press(key)


def told(page, words: str) -> None:  # type: ignore[no-untyped-def]
    page.wait_for_function(f"document.getElementById('label-status').textContent.includes({words!r})")


def block(name: str) -> str:
    return f'#label-score .d-lane:not(.fixed) .d-block[aria-label^="{name},"]'


def test_label_marks_frames_with_the_keyboard(page) -> None:  # type: ignore[no-untyped-def]
    annotate(page, "key")
    press(page, *["ArrowRight"] * 3, "i", "Shift+ArrowRight", "o")
    name = page.get_attribute('#label-names [aria-pressed="true"]', "value")
    assert labels(page) == [[0.12, 0.56, name]], "from the third frame to the end of the thirteenth"
    assert "frame 13" in page.inner_text("#label-now")
    assert page.evaluate("document.getElementById('label-film').currentTime") == pytest.approx(0.54, abs=1e-3)
    press(page, "Control+z")
    assert labels(page) == []
    press(page, "Control+y")
    page.focus(block(name))
    press(page, "Shift+ArrowRight", "Control+ArrowRight", "3")
    other = page.get_attribute('#label-names [aria-pressed="true"]', "value")
    assert other != name
    assert labels(page) == [[0.16, 0.64, other]]
    press(page, "]")
    assert labels(page) == [[0.16, 0.56, other]], "to the frame that is shown"
    press(page, "Delete")
    assert labels(page) == []


def test_label_moves_and_stretches_labels_with_the_mouse(page) -> None:  # type: ignore[no-untyped-def]
    annotate(page, "tom")
    scale = page.evaluate("realizerPage.label.rows.scale")
    page.keyboard.down("Shift")  # no snapping
    drag(page, block("surprise"), 0.2 * scale)
    assert labels(page) == [[0.6, 1.8, "surprise"], TOM[1]], "the label of the other expression stays"
    drag(page, f"{block('doubt')} .d-end", 0.4 * scale)
    page.keyboard.up("Shift")
    assert labels(page) == [[0.6, 1.8, "surprise"], [1.2, 2.4, "doubt"]]
    page.click("#label-undo")
    page.click("#label-undo")
    assert labels(page) == TOM


def test_label_leaves_the_lanes_of_the_other_annotator_alone(page) -> None:  # type: ignore[no-untyped-def]
    annotate(page, "tom")
    page.select_option("#label-other", "eva")
    before = page.evaluate("realizerPage.label.model.shown")
    drag(page, "#label-score .fixed .d-block", 60)
    press(page, "Delete")
    assert page.evaluate("realizerPage.label.model.shown") == before


def test_label_shows_the_agreement_of_two_annotators_live(page) -> None:  # type: ignore[no-untyped-def]
    annotate(page, "tom")
    page.select_option("#label-other", "eva")
    row = "[...document.querySelectorAll('#label-agreement tr')].map((row) => row.textContent)"
    page.wait_for_function(f"{row}.some((text) => /^surprise0\\.9/.test(text))")
    page.click(block("surprise"))
    page.fill("#label-start", "0.52")
    press(page, "Tab")
    page.wait_for_function(f"{row}.includes('surprise1.00')")


def test_label_refuses_two_labels_of_one_expression_at_once(page) -> None:  # type: ignore[no-untyped-def]
    annotate(page, "tom")
    page.fill("#label-find", "surprise")
    page.wait_for_function("document.querySelector('#label-names button').value === 'surprise'")
    press(page, "Enter", "Tab")
    page.evaluate("document.activeElement.blur()")
    press(page, *["Shift+ArrowRight"] * 2, "i", "ArrowRight", "o")
    told(page, "Labels of one expression cannot overlap")
    assert labels(page) == TOM


def test_label_finds_names_by_meaning_and_takes_new_ones(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#label-find", "sorry")
    page.wait_for_function(
        "[...document.querySelectorAll('#label-names button')].some((b) => b.value === 'regret')"
    )
    page.fill("#label-find", "tongue in cheek xyz")
    page.wait_for_selector('#label-names button:last-child[value="tongue in cheek xyz"]')


def test_label_saves_into_the_corpus_and_keeps_the_labels_of_others(page, corpus: Path) -> None:  # type: ignore[no-untyped-def]
    annotate(page, "saver")
    press(page, "i", "ArrowRight", "o", "Control+s")
    told(page, "Saved 1 labels of saver")
    kept = read_recording(corpus / "anna").labels
    assert [(one.start, one.end) for one in kept if one.by == "saver"] == [(0.0, 0.08)]
    assert [[one.start, one.end, one.text] for one in kept if one.by == "tom"] == TOM
    assert page.is_disabled("#label-save")


def test_label_asks_before_it_replaces_what_somebody_else_saved(page, corpus: Path) -> None:  # type: ignore[no-untyped-def]
    annotate(page, "two")
    press(page, "i", "o")
    found = read_recording(corpus / "anna")
    more = (*found.labels, Annotation(2.0, 2.4, "fear", "two"))
    write_recording(corpus / "anna", Recording("anna", found.meta, more, found.words))
    press(page, "Control+s")
    told(page, "were changed since you opened them")
    assert any(one.text == "fear" for one in read_recording(corpus / "anna").labels)
    press(page, "Control+s")
    told(page, "Saved 1 labels of two")


def test_label_keeps_a_draft_when_the_corpus_cannot_be_written(browser, address, corpus: Path) -> None:  # type: ignore[no-untyped-def]
    page = opened(browser, address)
    annotate(page, "draft")
    press(page, "i", "ArrowRight", "o")
    before = (corpus / "anna" / "labels.csv").read_bytes()
    lock = corpus / "anna" / ".lock"
    lock.unlink(missing_ok=True)
    lock.mkdir()  # what refuses root, too
    press(page, "Control+s")
    told(page, "cannot be saved")
    lock.rmdir()
    assert (corpus / "anna" / "labels.csv").read_bytes() == before
    made = labels(page)
    page.reload()
    told(page, "Your labels that were not saved are here again")
    assert labels(page) == made
    press(page, "Control+s")
    told(page, "Saved 1 labels of draft")
    page.context.close()


def test_label_draws_points_where_there_is_no_film(page) -> None:  # type: ignore[no-untyped-def]
    page.select_option("#label-recording", "ben")
    page.wait_for_selector("#label-points")
    first = page.locator("#label-points").screenshot()
    page.focus("#label-score .d-ruler")
    press(page, "PageDown")
    page.wait_for_function("realizerPage.label.film.time === 1")
    page.wait_for_function("realizerPage.label.film.shown.startsWith('20 ')")
    assert page.locator("#label-points").screenshot() != first
    press(page, "ArrowRight")
    assert page.evaluate("realizerPage.label.film.time") == pytest.approx(1.05), "a frame further"


def test_label_plays_the_chosen_label_again_and_again(page) -> None:  # type: ignore[no-untyped-def]
    annotate(page, "tom")
    page.click(block("surprise"))
    page.evaluate(
        "{ const { film } = realizerPage.label; const seek = film.seek.bind(film);"
        "  globalThis.sought = []; film.seek = (time) => { sought.push(time); seek(time); }; }"
    )
    page.click("#label-play")
    page.wait_for_function("sought.filter((time) => time === 0.4).length >= 2")
    page.click("#label-play")
    assert page.evaluate("realizerPage.label.film.video.paused")


def test_label_works_with_a_finger_on_a_phone(browser, address) -> None:  # type: ignore[no-untyped-def]
    size = {"width": 390, "height": 844}
    context = browser.new_context(viewport=size, has_touch=True, is_mobile=True, bypass_csp=True)
    page = context.new_page()
    page.set_default_timeout(PATIENCE)
    page.goto(f"{address}#label")
    page.wait_for_selector("#label-names button")
    page.wait_for_function("document.getElementById('label-film').videoWidth > 0")
    assert page.evaluate("[scrollY, document.documentElement.scrollWidth]") == [0, 390]
    annotate(page, "finger")
    page.tap("#label-begin")
    box = page.locator("#label-score .d-ruler").bounding_box()
    page.touchscreen.tap(box["x"] + page.evaluate("realizerPage.label.rows.scale"), box["y"] + 8)
    page.tap("#label-end")
    name = page.get_attribute('#label-names [aria-pressed="true"]', "value")
    assert [[start, text] for start, _, text in labels(page)] == [[0, name]]
    assert labels(page)[0][1] == pytest.approx(1.04, abs=0.05)
    page.tap(block(name))
    page.tap("#label-delete")
    assert labels(page) == []
    context.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_label_has_no_serious_accessibility_fault(browser, address, scheme: str) -> None:  # type: ignore[no-untyped-def]
    page = opened(browser, address, color_scheme=scheme)
    annotate(page, "tom")
    page.click(block("surprise"))
    assert serious_faults(page) == []
    page.close()
