"""The page of a study in a real browser, opened as a file: mouse, keyboard, reload, answers as CSV."""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realizer_studio.study.answers import inattentive, read_answers, read_key
from realizer_studio.study.items import Item, checks
from tests.browser.test_page import ARGUMENTS, CHROMIUM, PATIENCE, browser, pytestmark
from tests.studies import displaced, kit, matches, named

__all__ = ["ARGUMENTS", "CHROMIUM", "browser", "pytestmark"]


@pytest.fixture
def study(tmp_path: Path) -> Path:
    every: list[Item] = []
    for items in (matches(3), matches(2, kind="emotional"), named(), displaced([True, False])):
        every += [*items, *checks(items, np.random.default_rng(1))]
    kit(tmp_path / "s", every)
    return tmp_path / "s"


@pytest.fixture
def page(browser, study: Path) -> Iterator[Any]:  # type: ignore[no-untyped-def]
    """The page's first screen; an error on its console fails the test."""
    context = browser.new_context(viewport={"width": 390, "height": 844}, accept_downloads=True)
    page = context.new_page()
    page.set_default_timeout(PATIENCE)
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    page.goto(f"{(study / 'index.html').as_uri()}#2")
    yield page
    assert faults == []
    context.close()


def start(page: Any) -> None:
    page.get_by_role("button", name="I have read this and agree. Start").click()


def wanted(page: Any, study: Path) -> str | None:
    """Return the answer that the key holds to what is shown; None on introductions."""
    item = page.evaluate("steps[judge.place]?.item?.id ?? null")
    truth = read_key(study.with_name("s.key.json"))["items"].get(item)
    if truth is None:
        return None
    role = truth.get("check") or truth.get("emotion") or ("right" if truth["options"] else "2")
    return {role: file for file, role in truth["options"].items()}.get(role, role)


def place(page: Any) -> int:
    return int(page.evaluate("judge.place"))


def answers_of(page: Any, study: Path) -> Any:
    with page.expect_download() as waiting:
        page.get_by_role("button", name="Save answers").click()
    path = study.with_name("answers.csv")
    waiting.value.save_as(path)
    return read_answers([path], read_key(study.with_name("s.key.json")))


def test_mouse_answers_all_and_goes_on_after_a_reload(page: Any, study: Path) -> None:
    start(page)
    reloaded = False
    while page.evaluate("judge.place < steps.length"):
        answer, before = wanted(page, study), place(page)
        if answer is None:
            page.get_by_role("button", name="Begin").click()
            continue
        assert page.get_by_role("button", name="Next").is_disabled()
        page.wait_for_function("[...document.images].every((image) => image.complete && image.naturalWidth)")
        names = page.evaluate(
            "[...latin(steps[judge.place].item.options, steps[judge.place].row), "
            "...ANSWERS[steps[judge.place].kind]]"
        )
        page.locator(".choice").nth(names.index(answer)).click()
        if page.locator(".wheel").count():
            page.locator(".wheel").click(position={"x": 185, "y": 60})
        page.get_by_role("button", name="Next").click()
        if before == 8 and not reloaded:
            reloaded = True
            page.reload()
            assert "answers of this number" in page.get_by_role("status").text_content()
            start(page)
            assert place(page) == 9
    found = answers_of(page, study)
    assert len(found) == 3 + 2 + 6 + 2 + 4 * 2
    assert not inattentive(found)
    assert all(one.right for one in found if one.kind in ("visual", "naming") and "check" not in one.truth)
    assert {one.judge for one in found} == {"2"}
    # Above the middle is surprise, at 90 degrees.
    assert all(abs(one.angle - 90) < 6 for one in found if one.kind == "naming")


def test_keyboard_answers_all(page: Any, study: Path) -> None:
    page.locator("select").select_option("de")
    page.locator("input[name=judge]").fill("3")
    page.keyboard.press("Enter")
    while page.evaluate("judge.place < steps.length"):
        kind = page.evaluate("steps[judge.place].item && steps[judge.place].kind")
        if kind == "displacements":
            page.keyboard.press("2")
        elif kind:
            page.keyboard.press("1")
        before = place(page)
        page.keyboard.press("Enter")
        assert place(page) == before + 1
    page.keyboard.press("Tab")
    page.get_by_role("button", name="Zurück").press("Enter")
    page.keyboard.press("Backspace")
    page.get_by_role("button", name="Weiter").click()
    page.get_by_role("button", name="Weiter").click()
    page.get_by_role("button", name="Antworten speichern").wait_for()
    saved = page.evaluate("csv()")
    assert len(saved.splitlines()) == 22
    assert ",person," in saved


def test_judges_see_each_option_and_item_at_each_place(page: Any, study: Path) -> None:
    orders = page.evaluate("[1, 2, 3, 4, 5, 6].map((row) => latin(['a', 'b', 'c', 'd', 'e', 'f'], row))")
    assert all(len(set(column)) == 6 for column in zip(*orders, strict=True))
    pairs = [pair for order in orders for pair in itertools.pairwise(order)]
    assert len(set(pairs)) == 30, "each follows each other one once (Williams)"
    kinds = page.evaluate(
        "[1, 2, 3, 4].map((judge) => planned(judge).filter((s) => !s.item).map((s) => s.kind))"
    )
    assert all(len(set(column)) == 4 for column in zip(*kinds, strict=True))


def test_page_holds_no_right_answer(page: Any, study: Path) -> None:
    text = json.dumps(page.evaluate("STUDY"))
    assert not any(f'"{word}"' in text for word in ("right", "removed", "added", "emotion", "salt", "seed"))
