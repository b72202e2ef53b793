"""The Design tab in a real browser, on the real service: gestures, rules, files, and what goes wrong."""

from __future__ import annotations

import re
import sys
import urllib.request
from collections.abc import Iterator
from contextlib import suppress
from http.client import HTTPException
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from realizer.animation.fap.fap_reader import read_fap
from realizer.expressions.library import builtin
from realizer.expressions.timeline import Entry, Timeline, Track
from realizer.expressions.timeline_file import read_timeline, write_timeline
from tests.accessibility import serious_faults
from tests.browser.test_page import ARGUMENTS, CHROMIUM, PATIENCE, browser, pytestmark, serving
from tests.waiting import LIMIT

__all__ = ["ARGUMENTS", "CHROMIUM", "browser", "pytestmark"]

CHANNELS = "realizerPage.design.model.shown.channel"
SPANS = f"""{CHANNELS}.map((one) => realizerPage.design.model.blocks(one).map(({{ start, end, entry }}) =>
  [entry.expression.replace("template:", ""), +start.toFixed(2), +end.toFixed(2)]))"""
FIRST = "realizerPage.design.model.blocks(realizerPage.design.model.shown.channel[0])[0].start"
# An edit is shown when vertices that were computed after it are on the face.
SHOWN = """async (key) => {
  const { stage, design } = realizerPage;
  const before = stage.shown;
  const began = performance.now();
  document.activeElement.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
  while (stage.shown === before) await new Promise((next) => setTimeout(next, 1));
  return performance.now() - began;
}"""


@pytest.fixture(scope="module")
def edits(tmp_path_factory) -> Path:  # type: ignore[no-untyped-def]
    return tmp_path_factory.mktemp("edits")


@pytest.fixture(scope="module")
def address(edits: Path) -> Iterator[str]:
    command = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent", "--no-idle"]
    with serving([*command, "--edit", str(edits)]) as address:
        for path in ("faces/ada", "look.json?face=ada", "mirror?light=portrait"):
            warm(f"{address}/{path}")
        yield address


def warm(url: str) -> None:
    """Get what the page will get: on a busy machine the first answer may take longer than a request may."""
    for _ in range(5):
        with suppress(OSError, HTTPException), urllib.request.urlopen(url, timeout=LIMIT):
            return


@pytest.fixture(scope="module")
def opened(browser, address):  # type: ignore[no-untyped-def]
    page = browser.new_page(viewport={"width": 1280, "height": 900}, bypass_csp=True)
    page.set_default_timeout(PATIENCE)
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    page.goto(f"{address}#design")
    page.wait_for_selector("#lights button")
    page.wait_for_selector(".d-card")
    yield page, faults
    page.close()


@pytest.fixture
def page(opened):  # type: ignore[no-untyped-def]
    """The tab without blocks; any error on its console fails the test."""
    page, faults = opened
    faults.clear()
    page.evaluate("realizerPage.design.model.clear()")
    page.click("#design-views button:first-child")
    page.fill("#design-find", "")
    page.wait_for_function("document.querySelectorAll('.d-card').length > 30")
    yield page
    page.evaluate("realizerPage.design.tool.socket")
    assert faults == []


def add(page, *names: str) -> None:  # type: ignore[no-untyped-def]
    for name in names:
        page.click(f'.d-card[title^="template:{name}:"]')


def spans(page) -> list[list[tuple[str, float, float]]]:  # type: ignore[no-untyped-def]
    """Name, start and end of the blocks of each channel."""
    return [[tuple(block) for block in lane] for lane in page.evaluate(SPANS)]


def drag(page, selector: str, across: float, down: float = 0, keys: str = "") -> None:  # type: ignore[no-untyped-def]
    box = page.locator(selector).bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    if keys:
        page.keyboard.down(keys)
    page.mouse.move(x + across / 2, y + down / 2, steps=3)
    page.mouse.move(x + across, y + down, steps=3)
    page.mouse.up()
    if keys:
        page.keyboard.up(keys)


def scale(page) -> float:  # type: ignore[no-untyped-def]
    """Pixels a second."""
    return float(page.evaluate("realizerPage.design.lanes.scale"))


def state(page, text: str) -> None:  # type: ignore[no-untyped-def]
    """Wait for the state of the first block."""
    page.wait_for_function(f"document.querySelector('.d-block')?.dataset.state === '{text}'")


def saved(page, form: str) -> str:  # type: ignore[no-untyped-def]
    with page.expect_download() as download:
        page.select_option("#design-form", form)
    return Path(download.value.path()).read_text("utf-8")


def test_design_makes_the_sequences_of_figure_5_14_with_the_mouse(page) -> None:  # type: ignore[no-untyped-def]
    add(page, "surprise", "astonishment", "surprise")
    page.click("#design-lane")
    add(page, "anger", "disgust", "anger")
    page.click("#design-lane")
    add(page, "happiness", "regret")
    assert [[name for name, *_ in lane] for lane in spans(page)] == [
        ["surprise", "astonishment", "surprise"],
        ["anger", "disgust", "anger"],
        ["happiness", "regret"],
    ]
    assert all(one[2] == other[1] for lane in spans(page) for one, other in pairwise(lane))
    file = read_timeline(saved(page, "toml").encode())
    assert [len(track.entries) for track in file.tracks] == [3, 3, 2]


def test_design_moves_resizes_and_shapes_a_block_with_the_mouse(page) -> None:  # type: ignore[no-untyped-def]
    add(page, "surprise")
    ((first,),) = spans(page)
    drag(page, ".d-block", scale(page) * 1.0)
    ((moved,),) = spans(page)
    assert moved[1] - first[1] == pytest.approx(1.0, abs=0.06)
    assert moved[2] - moved[1] == pytest.approx(first[2] - first[1], abs=0.01)
    drag(page, ".d-end", scale(page) * 0.5)
    ((longer,),) = spans(page)
    assert longer[2] - moved[2] == pytest.approx(0.5, abs=0.06)
    drag(page, ".d-start", -scale(page) * 0.4)
    ((earlier,),) = spans(page)
    assert (earlier[1], earlier[2]) == pytest.approx((longer[1] - 0.4, longer[2]), abs=0.06)
    drag(page, ".d-onset", scale(page) * 0.3)
    drag(page, ".d-offset", -scale(page) * 0.2)
    drag(page, ".d-amount", 0, 22)
    (entry,) = page.evaluate(f"{CHANNELS}[0].entries")
    assert entry["onset"] == pytest.approx(builtin()["template:surprise"].onset + 0.3, abs=0.06)
    assert entry["offset"] == pytest.approx(builtin()["template:surprise"].offset + 0.2, abs=0.06)
    assert entry["intensity"] == pytest.approx(0.5, abs=0.05)
    page.click("#design-lane")
    drag(page, ".d-block > span", 0, 54)
    assert [len(lane) for lane in spans(page)] == [0, 1]


def test_design_escape_takes_a_drag_back(page) -> None:  # type: ignore[no-untyped-def]
    add(page, "surprise")
    before = spans(page)
    box = page.locator(".d-block").bounding_box()
    page.mouse.move(box["x"] + 30, box["y"] + 25)
    page.mouse.down()
    page.mouse.move(box["x"] + 130, box["y"] + 25, steps=3)
    assert spans(page) != before
    page.keyboard.press("Escape")
    page.mouse.up()
    assert spans(page) == before


def test_design_drops_a_card_on_a_lane(page) -> None:  # type: ignore[no-untyped-def]
    card, lane = (page.locator(s).first.bounding_box() for s in (".d-card", ".d-track"))
    page.mouse.move(card["x"] + 40, card["y"] + 40)
    page.mouse.down()
    page.mouse.move(lane["x"] + 2 * scale(page), lane["y"] + 20, steps=5)
    page.mouse.up()
    ((block,),) = spans(page)
    assert block[1] == pytest.approx(2.0, abs=0.05)
    assert page.locator(".d-shade").count() == 0


def test_design_does_everything_by_keyboard(page) -> None:  # type: ignore[no-untyped-def]
    page.focus("#design-find")
    page.keyboard.type("question")
    page.wait_for_function("document.querySelectorAll('.d-card').length < 10")
    page.locator(".d-card").first.focus()
    page.keyboard.press("Enter")
    page.keyboard.press("Enter")
    page.locator(".d-block[tabindex='0']").focus()
    ((one, two),) = spans(page)
    page.keyboard.press("Shift+ArrowRight")
    assert spans(page)[0][1][1] == pytest.approx(two[1] + 0.04, abs=0.011)
    page.keyboard.press("ArrowLeft")
    assert page.evaluate(f"document.activeElement.entry === {CHANNELS}[0].entries[0]")
    for keys, field, expected in (("-", "intensity", 0.95), ("+", "intensity", 1.0)):
        page.keyboard.press(keys)
        assert page.evaluate(f"{CHANNELS}[0].entries[0].{field}") == pytest.approx(expected)
    page.keyboard.press("Control+ArrowRight")
    assert spans(page)[0][0][2] == pytest.approx(one[2] + 0.04, abs=0.011)
    page.keyboard.press("d")
    assert len(spans(page)[0]) == 3
    page.keyboard.press("Delete")
    assert len(spans(page)[0]) == 2
    page.keyboard.press("Shift+ArrowDown")
    assert [len(lane) for lane in spans(page)] == [1, 1]
    page.keyboard.press("ArrowUp")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    assert page.evaluate("document.activeElement.ariaLabel") == "Start, seconds"
    page.keyboard.press("ArrowUp")
    page.keyboard.press("Tab")
    page.locator(".d-block[aria-selected='true']").focus()
    page.keyboard.press("Space")
    assert page.evaluate("realizerPage.design.preview.playing")
    page.keyboard.press("Space")
    assert not page.evaluate("realizerPage.design.preview.playing")
    page.focus(".d-ruler")
    page.keyboard.press("Home")
    page.keyboard.press("PageDown")
    assert page.get_attribute(".d-ruler", "aria-valuenow") == "1.00"


@pytest.mark.long
def test_design_undoes_and_redoes_without_end(page) -> None:  # type: ignore[no-untyped-def]
    add(page, "surprise")
    page.focus(".d-block")
    states = [spans(page)]
    for _ in range(120):
        page.keyboard.press("Shift+ArrowRight")
        states.append(spans(page))
    for expected in reversed(states[:-1]):
        page.keyboard.press("Control+z")
        assert spans(page) == expected
    for _ in range(120):
        page.keyboard.press("Control+y")
    assert spans(page) == states[-1]


def test_design_is_dragged_by_a_finger(browser, address) -> None:  # type: ignore[no-untyped-def]
    context = browser.new_context(viewport={"width": 820, "height": 1180}, has_touch=True, bypass_csp=True)
    page = context.new_page()
    page.set_default_timeout(PATIENCE)
    page.goto(f"{address}#design")
    page.wait_for_selector("#lights button")
    page.locator(".d-card").first.tap()
    page.wait_for_selector(".d-block")
    page.locator(".d-block").scroll_into_view_if_needed()
    before, box = spans(page), page.locator(".d-block").bounding_box()
    touch = page.context.new_cdp_session(page)
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] - 8
    for kind, points in (
        ("touchStart", [{"x": x, "y": y}]),
        ("touchMove", [{"x": x + 40, "y": y}]),
        ("touchMove", [{"x": x + 90, "y": y}]),
        ("touchEnd", []),
    ):
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    page.wait_for_function("realizerPage.design.model.past.length === 2")
    assert spans(page)[0][0][1] == pytest.approx(before[0][0][1] + 90 / scale(page), abs=0.08)
    context.close()


# The rules of Wojdel 2005, 6.5.


def test_design_turns_a_block_amber_outside_its_probable_length(page) -> None:  # type: ignore[no-untyped-def]
    add(page, "surprise")
    state(page, "")
    drag(page, ".d-end", scale(page) * 2)
    state(page, "unusual")
    got = page.get_attribute(".d-block", "title")
    assert re.fullmatch(
        r"surprise is visible for [\d.]+ s, which is unusually long; it mostly .* table 6\.15\)", got
    )
    assert "unusually long" in page.inner_text("#design-status")
    assert "unusually long" in page.inner_text("#design-inspector")


def test_design_stops_a_block_at_its_possible_length_unless_alt_is_held(page) -> None:  # type: ignore[no-untyped-def]
    add(page, "grief")
    drag(page, ".d-end", scale(page) * 9)
    ((block,),) = spans(page)
    grief = builtin()["template:grief"]
    most = 4 + (grief.onset + grief.offset) / 2
    assert block[2] - block[1] == pytest.approx(most, abs=0.01)
    assert "grief was never seen for another time than 0.25 to 4 s" in page.inner_text("#design-status")
    drag(page, ".d-end", scale(page) * 2, keys="Alt")
    ((longer,),) = spans(page)
    assert longer[2] - longer[1] > most + 0.5
    state(page, "impossible")
    page.keyboard.press("Control+z")
    page.focus(".d-block")
    page.keyboard.press("Control+ArrowRight")
    assert spans(page)[0][0][2] == pytest.approx(block[2], abs=0.01)
    page.keyboard.press("Control+Alt+ArrowRight")
    assert spans(page)[0][0][2] > block[2] + 0.03


@pytest.mark.parametrize(
    ("name", "other"),
    [
        ("astonishment", "surprise"),
        ("disgust", "anger"),
        ("disbelief", "anger"),
        ("happiness", "surprise"),
        ("grief", "surprise"),
    ],
)
def test_design_offers_missing_company_that_a_click_accepts(page, name: str, other: str) -> None:  # type: ignore[no-untyped-def]
    page.evaluate("realizerPage.design.preview.look(1.5)")
    add(page, name)
    ghost = page.locator(".d-ghost")
    ghost.wait_for()
    assert ghost.inner_text() == f"+ {other}"
    assert "Wojdel" in ghost.get_attribute("title")
    ghost.click()
    page.wait_for_function("!document.querySelector('.d-ghost')")
    names = [block[0] for lane in spans(page) for block in lane]
    assert sorted(names) == sorted([name, other])
    ((start, end),) = [b[1:] for lane in spans(page) for b in lane if b[0] == name]
    ((first, last),) = [b[1:] for lane in spans(page) for b in lane if b[0] == other]
    if name in ("astonishment", "disgust"):
        assert (first, last) == pytest.approx((start - 0.12, end + 0.12), abs=0.011)
    assert page.evaluate(
        f"{CHANNELS}.flatMap((one) => one.entries).some(({{ because }}) => /Wojdel/.test(because))"
    )
    page.keyboard.press("Control+z")
    ghost.wait_for()


def test_design_accepts_company_by_keyboard(page) -> None:  # type: ignore[no-untyped-def]
    add(page, "astonishment")
    page.wait_for_selector(".d-ghost")
    page.focus(".d-block")
    page.keyboard.press("a")
    page.wait_for_function("!document.querySelector('.d-ghost')")
    assert sum(map(len, spans(page))) == 2


def test_design_warns_of_sadness_right_after_another_expression(page) -> None:  # type: ignore[no-untyped-def]
    add(page, "regret", "sadness")
    page.wait_for_function("document.querySelectorAll('.d-block')[1].dataset.state === 'unusual'")
    assert "does not follow another expression within 1 s" in page.locator(".d-block").nth(1).get_attribute(
        "title"
    )


def test_design_says_how_calm_a_listener_is(page) -> None:  # type: ignore[no-untyped-def]
    page.select_option("#design-role", "listener")
    add(page, "happiness", "happiness", "happiness", "happiness")
    page.wait_for_function("document.querySelector('.d-block').title.includes('a listener shows happiness')")
    page.select_option("#design-role", "speaker")


def test_design_fills_lanes_with_what_a_text_needs_and_snaps_to_its_words(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#design-text", "Are you sure? That is nonsense!")
    page.press("#design-text", "Enter")
    page.wait_for_selector(".d-word")
    assert page.locator(".d-word").all_inner_texts() == ["Are", "you", "sure", "That", "is", "nonsense"]
    because = page.evaluate(f"{CHANNELS}.flatMap((one) => one.entries).map((one) => one.because)")
    assert any("question" in one for one in because)
    assert any("disapproval" in one for one in because)
    (start, *_), *_ = page.evaluate(
        "realizerPage.design.model.speech.words.filter(([, , word]) => word === 'nonsense')"
    )
    block = page.evaluate(FIRST)
    drag(page, ".d-block >> nth=0", (start - block) * scale(page) + 4)
    assert page.evaluate(FIRST) == pytest.approx(start, abs=1e-3)


# Picture, files, library.


def test_design_shows_an_edit_on_the_face(page) -> None:  # type: ignore[no-untyped-def]
    add(page, "surprise")
    page.evaluate("realizerPage.design.look(0.6)")
    page.wait_for_function("realizerPage.design.preview.last?.length")
    page.focus(".d-block")
    page.wait_for_function("!realizerPage.design.preview.waits")
    seconds = [page.evaluate(SHOWN, "-") / 1000 for _ in range(5)]
    print("an edit is shown after", *(f"{one:.3f}" for one in seconds), "s")
    page.click("#tab-script")
    assert page.is_visible("#time")
    assert page.evaluate("realizerPage.design.frames()") is None
    page.click("#tab-design")


def test_design_saves_files_that_come_back_with_every_field(page, tmp_path) -> None:  # type: ignore[no-untyped-def]
    timeline = Timeline(
        (
            Track("brows", (Entry("template:surprise", 0.8, 1.2, 0.2, 0.4, "a question"), Entry("neutral"))),
            Track("mood", (Entry("Smile"),), "onset", "smooth", 0.5),
        ),
        "successive",
        (4, 1),
    )
    (tmp_path / "t.toml").write_text(write_timeline(timeline), "utf-8")
    page.set_input_files("#design-file", tmp_path / "t.toml")
    page.wait_for_selector(".d-block >> nth=1")
    assert read_timeline(saved(page, "toml").encode()) == timeline
    (tmp_path / "t.bml").write_text(saved(page, "bml"), "utf-8")
    (tmp_path / "t.fap").write_text(saved(page, "fap"), "utf-8")
    bml = (tmp_path / "t.bml").read_text("utf-8").replace("</bml>", '<head id="h" lexeme="NOD"/></bml>')
    (tmp_path / "t.bml").write_text(bml, "utf-8")
    page.set_input_files("#design-file", tmp_path / "t.bml")
    page.wait_for_function("document.querySelector('#design-status').textContent.startsWith('Left out')")
    assert page.inner_text("#design-status") == "Left out: h: a timeline holds expressions, got <head>"
    assert sum(map(len, spans(page))) == 2
    page.set_input_files("#design-file", tmp_path / "t.fap")
    page.wait_for_function(f"{SPANS}.flat(2).includes('RAISE_BROWS')")
    assert {"RAISE_BROWS", "SMILE"} <= {name for lane in spans(page) for name, *_ in lane}


def test_design_keeps_keyframes_of_faps_that_no_expression_shows(page, tmp_path) -> None:  # type: ignore[no-untyped-def]
    rows = np.random.default_rng(1).integers(-300, 300, (40, 3))
    rows[:5] = rows[-5:] = 0
    lines = [f"{' '.join(str(int(k in (17, 40, 53))) for k in range(1, 69))}"] * 40
    text = "2.1 odd 25 40\n" + "".join(
        f"{mask}\n{k} {' '.join(map(str, row))}\n"
        for k, (mask, row) in enumerate(zip(lines, rows, strict=True))
    )
    (tmp_path / "odd.fap").write_text(text, "utf-8")
    page.set_input_files("#design-file", tmp_path / "odd.fap")
    page.wait_for_selector(".d-block.keys")
    assert page.inner_text(".d-block.keys > span") == "FAP 17, 40, 53"
    assert page.locator("#design-inspector [aria-label='Onset, seconds']").count() == 0
    played = read_fap(saved(page, "fap"))
    assert np.array_equal(played.values[:36, [16, 39, 52]], rows[:36])
    file = read_timeline(saved(page, "toml").encode())
    (tmp_path / "odd.toml").write_text(write_timeline(file), "utf-8")
    drag(page, ".d-block.keys", scale(page) * 0.5)
    page.wait_for_function(f"Math.abs({FIRST} - 0.66) < 0.05")
    page.set_input_files("#design-file", tmp_path / "odd.toml")
    page.wait_for_function(f"{FIRST} < 0.2")
    assert read_timeline(saved(page, "toml").encode()) == file
    assert "FaceInterpolator" in saved(page, "bml")


def test_design_is_heard_in_step_with_the_picture(browser) -> None:  # type: ignore[no-untyped-def]
    with serving([sys.executable, "-m", "realizer", "serve", "--port", "0", "--no-idle"]) as address:
        page = browser.new_page(viewport={"width": 1280, "height": 900}, bypass_csp=True)
        page.set_default_timeout(PATIENCE)
        page.goto(f"{address}#design")
        page.wait_for_selector(".d-card")
        page.fill("#design-text", "Are you sure? That is nonsense!")
        page.click("text=Fill lanes")
        page.wait_for_function("realizerPage.design.voice.buffer")
        ends = page.evaluate("realizerPage.design.model.speech.words.at(-1)[1]")
        assert page.evaluate("realizerPage.design.voice.duration") == pytest.approx(ends, abs=0.5)
        page.click("#design-play")
        page.wait_for_function("realizerPage.design.voice.time > 0.3")
        assert page.inner_text("#sound").strip() == "Sound on"
        apart = page.evaluate(
            "[realizerPage.design].map(({ preview, voice }) => (preview.now(), preview.time - voice.time))[0]"
        )
        assert abs(apart) < 0.02
        page.click("#design-play")
        assert page.evaluate("realizerPage.design.voice.source") is None
        page.focus(".d-ruler")
        page.keyboard.press("ArrowRight")
        assert page.evaluate("realizerPage.design.voice.source !== null")
        page.click("#sound")
        page.click("#design-play")
        page.wait_for_function("realizerPage.design.preview.time > 0.2")
        page.close()


def test_design_films_the_timeline(page) -> None:  # type: ignore[no-untyped-def]
    add(page, "surprise")
    with page.expect_download() as download:
        page.select_option("#design-form", "film")
    assert re.fullmatch(r"face\.(webm|mp4)", download.value.suggested_filename)
    assert Path(download.value.path()).stat().st_size > 1000
    assert page.evaluate("realizerPage.design.preview.loop")


def test_design_edits_an_expression_and_saves_it_to_the_library(page, edits) -> None:  # type: ignore[no-untyped-def]
    page.click("#design-views button:last-child")
    page.evaluate("realizerPage.design.expression.pose.set({ aus: { '12L': 0.9, '12R': 0.9, '15L': 0.9 } })")
    page.wait_for_selector("#design-rules li")
    assert page.locator("#design-rules li").all_inner_texts() == ["AU12L 0.90 shows as 0.20"]
    page.fill("#design-name", "Half smile")
    page.fill("#design-means", "so so, hm")
    page.click("#design-save-expression")
    page.wait_for_function("document.querySelector('#design-status').textContent.startsWith('Saved')")
    path = edits / "expressions" / "half-smile.toml"
    assert "aus = { 12 = 0.9, 15L = 0.9 }" in path.read_text("utf-8")
    page.click("#design-save-expression")
    page.wait_for_function("document.querySelector('#design-status').textContent.startsWith('Saved')")
    path.write_text(path.read_text("utf-8") + 'source = "of another"\n', "utf-8")
    page.click("#design-save-expression")
    page.wait_for_function("document.querySelector('#design-status').textContent.includes('it was changed')")
    assert "of another" in path.read_text("utf-8")
    page.click("#design-views button:first-child")
    page.wait_for_selector('.d-card[title^="Half smile:"]').click()
    assert spans(page)[0][0][0] == "Half smile"
    state(page, "")


# What goes wrong.


def test_design_keeps_a_timeline_with_an_unknown_expression(page, tmp_path) -> None:  # type: ignore[no-untyped-def]
    timeline = Timeline((Track("a", (Entry("smile"), Entry("template:wonder", 0.5, 1.0))),))
    (tmp_path / "t.toml").write_text(write_timeline(timeline), "utf-8")
    page.set_input_files("#design-file", tmp_path / "t.toml")
    page.wait_for_selector(".d-block[data-state='unknown']")
    page.wait_for_function(
        "document.querySelector('#design-status').textContent.includes('wanted a name of')"
    )
    assert page.evaluate("realizerPage.design.model.file.channel[0].entries[1]") == {
        "expression": "template:wonder", "intensity": 0.5, "duration": 1.0,
    }  # fmt: skip
    (tmp_path / "t.toml").write_text("[[channel]]\nentriess = []", "utf-8")
    page.set_input_files("#design-file", tmp_path / "t.toml")
    page.wait_for_function("document.querySelector('#design-status').textContent.includes('entriess')")
    assert len(spans(page)[0]) == 2


def test_design_loses_nothing_with_the_connection(browser, address) -> None:  # type: ignore[no-untyped-def]
    page = browser.new_page(viewport={"width": 1280, "height": 900}, bypass_csp=True)
    page.set_default_timeout(PATIENCE)
    page.goto(f"{address}#design")
    page.wait_for_selector("#lights button")
    add(page, "surprise")
    box = page.locator(".d-block").bounding_box()
    page.mouse.move(box["x"] + 40, box["y"] + 25)
    page.mouse.down()
    page.mouse.move(box["x"] + 90, box["y"] + 25, steps=3)
    page.context.set_offline(True)
    page.evaluate("realizerPage.design.tool.socket.close()")
    page.mouse.move(box["x"] + 180, box["y"] + 25, steps=3)
    page.mouse.up()
    page.wait_for_function(
        "document.querySelector('#design-status').textContent.includes('cannot be reached')"
    )
    moved = spans(page)
    assert moved[0][0][1] > 0.3
    page.context.set_offline(False)
    page.reload()
    page.wait_for_selector(".d-block")
    assert spans(page) == moved
    state(page, "")
    page.close()


def test_design_has_no_serious_accessibility_fault(page) -> None:  # type: ignore[no-untyped-def]
    add(page, "astonishment", "regret")
    page.wait_for_selector(".d-ghost")
    for view in ("first", "last"):
        page.click(f"#design-views button:{view}-child")
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme)
            assert serious_faults(page) == [], f"{view} view, {scheme}"
    page.emulate_media(color_scheme="light")
