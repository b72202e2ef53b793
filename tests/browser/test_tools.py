"""The page's tools in a real browser: editor, timeline, sliders, wheel, film; one page for all of them."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from realizer.animation.fap.fap_reader import read_fap
from realizer.tables import action_units, faps
from tests.accessibility import serious_faults
from tests.browser.test_page import ARGUMENTS, CHROMIUM, PATIENCE, browser, pytestmark, serving

__all__ = ["ARGUMENTS", "CHROMIUM", "browser", "pytestmark"]

COLUMN = {row.name: row.fap - 1 for row in faps()}
NOD = '<bml id="{}"><head id="n" lexeme="NOD" end="0.8"/><faceLexeme id="f" lexeme="SMILE" end="0.9"/></bml>'


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    command = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--no-idle", "--voice", "silent"]
    with serving(command) as address:
        yield address


@pytest.fixture(scope="module")
def opened(browser, address):  # type: ignore[no-untyped-def]
    """The page, with the errors of its console."""
    context = browser.new_context(viewport={"width": 1100, "height": 760}, bypass_csp=True)
    page = context.new_page()
    page.set_default_timeout(PATIENCE)
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    page.goto(address)
    page.wait_for_function("realizerPage.stage.shownFrames > 0")
    page.wait_for_selector(".row.fap", state="attached")
    yield page, faults
    context.close()


@pytest.fixture
def page(opened):  # type: ignore[no-untyped-def]
    """The page, on its first tab and with nothing held; an error on its console fails the test."""
    page, faults = opened
    faults.clear()
    page.evaluate("() => { realizerPage.timeline.look(null); realizerPage.pose.clear(); }")
    page.click("#tab-script")
    page.click("#clear")
    yield page
    assert faults == []


def shown(page, **aus: float) -> None:  # type: ignore[no-untyped-def]
    """Wait until the service shows these action units, and 0 of those that are 0."""
    page.wait_for_function(
        """async (wanted) => {
          const { characters } = await realizerPage.link.ask({ type: "state" });
          const near = ([au, value]) => Math.abs((characters[0].aus[au] ?? 0) - value) < 0.02;
          return Object.entries(wanted).every(near);
        }""",
        arg={name.removeprefix("au"): value for name, value in aus.items()},
    )


def slide(page, label: str, value: float) -> None:  # type: ignore[no-untyped-def]
    page.locator(f'input[type="range"][aria-label="{label}"]:visible').fill(str(value))


def write(page, text: str, cursor: str = "|") -> None:  # type: ignore[no-untyped-def]
    """Put a text into the editor, the cursor where the bar is."""
    place = text.index(cursor)
    page.evaluate(
        """([text, place]) => {
          const { editor } = realizerPage;
          editor.text = text;
          editor.view.dispatch({ selection: { anchor: place } });
          editor.view.focus();
        }""",
        [text.replace(cursor, ""), place],
    )


def offered(page) -> list[str]:  # type: ignore[no-untyped-def]
    page.wait_for_selector(".cm-tooltip-autocomplete li")
    return page.locator(".cm-tooltip-autocomplete .cm-completionLabel").all_text_contents()  # type: ignore[no-any-return]


def accept(page, label: str) -> str:  # type: ignore[no-untyped-def]
    """Take what is offered under that name; the text then."""
    labels = page.locator(".cm-tooltip-autocomplete .cm-completionLabel")
    labels.nth(labels.all_text_contents().index(label)).click()
    page.wait_for_selector(".cm-tooltip-autocomplete", state="detached")
    return page.evaluate("realizerPage.editor.text")  # type: ignore[no-any-return]


# the editor ---------------------------------------------------------------------------------------


def test_editor_underlines_faults_and_shows_advice(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#document", '<bml id="a">\n<head id="n" lexeme="NIX"/>\n<wait id="w" duration="400"/>\n</bml>')
    page.wait_for_selector("#problems[data-state='bad']")
    assert page.locator(".cm-lintRange-error").all_text_contents() == ["NIX"]
    assert page.locator(".cm-lintRange-warning").all_text_contents() == ["400"]
    assert "1 fault, 1 advice: line 2: " in page.locator("#problems-text").text_content()
    page.click("#problems")
    assert page.evaluate("getSelection().toString()") == "NIX"
    page.keyboard.type("NOD")
    page.wait_for_selector("#problems[data-state='advice']")
    assert page.locator(".cm-lintRange-error").count() == 0


def test_editor_counts_columns_in_characters(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#document", '<bml id="a"><!-- 😀𝒳 --><head id="n" lexeme="NIX"/></bml>')
    page.wait_for_selector(".cm-lintRange-error:has-text('NIX')")
    assert page.locator(".cm-lintRange-error").all_text_contents() == ["NIX"]


def test_editor_highlights_the_text(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#document", '<bml id="a"></bml>')
    colour = "e => getComputedStyle(e).color"
    parts = {text: page.locator(f"#document span:text-is('{text}')").first for text in ("bml", "id", '"a"')}
    assert len({part.evaluate(colour) for part in parts.values()}) == 3


def test_editor_completes_elements_where_they_are_valid(page) -> None:  # type: ignore[no-untyped-def]
    write(page, '<bml id="a">\n|\n</bml>')
    page.keyboard.type("<")
    names = offered(page)
    assert {"faceLexeme", "speech", "realizer:emotion"} <= set(names)
    assert "text" not in names
    page.keyboard.type("faceLex")
    assert "<faceLexeme " in accept(page, "faceLexeme")


def test_editor_adds_the_namespace_of_an_extension(page) -> None:  # type: ignore[no-untyped-def]
    write(page, '<bml id="a">\n|\n</bml>')
    page.keyboard.type("<realizer:emo")
    offered(page)
    text = accept(page, "realizer:emotion")
    assert text.startswith('<bml xmlns:realizer="urn:bml-realizer:1" id="a">')
    assert "<realizer:emotion " in text


@pytest.mark.parametrize(
    ("before", "typed", "wanted", "taken", "then"),
    [
        ('<head id="n" |/>', "le", {"lexeme"}, "lexeme", 'lexeme=""'),
        ('<head id="n" lexeme="|"/>', "N", {"NOD"}, "NOD", 'lexeme="NOD"'),
        ('<faceFacs id="f" au="|"/>', "1", {"12", "15"}, "12", 'au="12"'),
        ('<gaze id="g" offsetDirection="|"/>', "U", {"UPLEFT", "UP"}, "UPLEFT", 'offsetDirection="UPLEFT"'),
        ('<head id="n" stroke="|"/>', "s", {"s1:word", "s1:end", "s1:start"}, "s1:word", 'stroke="s1:word"'),
    ],
)
def test_editor_completes_attributes_values_and_sync_points(page, before, typed, wanted, taken, then) -> None:  # type: ignore[no-untyped-def]
    speech = '<speech id="s1"><text>One <sync id="word"/>two</text></speech>'
    write(page, f'<bml id="a">{speech}\n{before}\n</bml>')
    page.keyboard.type(typed)
    names = offered(page)
    assert wanted <= set(names)
    assert not any(name.startswith("n:") for name in names), "a behaviour is not tied to itself"
    assert then in accept(page, taken)


# the timeline -------------------------------------------------------------------------------------


def test_timeline_draws_scheduled_and_actual_times(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#document", NOD.format("drawn"))
    page.press("#document", "Control+Enter")
    page.wait_for_selector("#log li:has-text('drawn ends')")
    page.wait_for_function("document.querySelectorAll('#score .happened').length === 2")
    # Changes are drawn with the next picture.
    page.wait_for_function("document.querySelectorAll('#score .track:not(.curve) i.dot').length === 11")
    assert page.text_content("#playing") == "drawn"
    rows = page.locator("#score .track:not(.curve)")
    assert rows.locator("> span").all_text_contents() == ["n", "f"]
    for row, points in zip(rows.all(), (7, 4), strict=True):
        ticks, dots = (row.locator(name) for name in ("i.tick", "i.dot"))
        assert ticks.count() == dots.count() == points
        left = "all => all.map((e) => parseFloat(e.style.left))"
        assert dots.evaluate_all(left) == pytest.approx(ticks.evaluate_all(left), abs=1.0)


def test_curves_show_moving_aus_or_faps(page) -> None:  # type: ignore[no-untyped-def]
    page.click("#tab-aus")
    slide(page, "AU 12 Lip corner puller, left", 1)
    page.wait_for_selector("#score .curve:has-text('12 Lip corner puller') canvas")
    page.click("#curves button:has-text('FAPs')")
    page.wait_for_selector("#score .curve:has-text('raise l cornerlip o') canvas")
    drawn = "e => e.getContext('2d').getImageData(0, 0, e.width, e.height).data.some(Boolean)"
    assert page.locator("#score .curve canvas").first.evaluate(drawn)
    page.click("#curves button:has-text('AUs')")


def test_timeline_scrubs_by_mouse_and_keyboard(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#document", NOD.format("past"))
    page.click("#play")
    page.wait_for_selector("#log li:has-text('past ends')")
    over = "() => { const { current, now } = realizerPage.timeline; return now > current?.ended; }"
    page.wait_for_function(over)
    peak = page.evaluate("realizerPage.timeline.current.happened.get('f')[1].time")
    box = page.locator("#score .scrub").bounding_box()
    begin, end = page.evaluate("realizerPage.timeline.range")
    page.mouse.click(box["x"] + box["width"] * (peak - begin) / (end - begin), box["y"] + 40)
    assert page.evaluate("realizerPage.timeline.scrub") == pytest.approx(peak, abs=0.05)
    page.wait_for_selector("#live:visible")
    same = """(time) => {
      const { stage } = realizerPage;
      const shown = stage.frames.findLast((frame) => frame.time <= time);
      return stage.shown === shown.values;
    }"""
    page.wait_for_function(same, arg=page.evaluate("realizerPage.timeline.scrub"))
    page.press("#score .scrub", "ArrowLeft")
    assert page.evaluate("realizerPage.timeline.scrub") == pytest.approx(peak - 0.1, abs=0.05)
    page.keyboard.press("End")
    assert page.evaluate("realizerPage.timeline.scrub") is None
    assert page.locator("#live").is_hidden()


def test_timeline_shows_whole_rows_and_whole_words(page) -> None:  # type: ignore[no-untyped-def]
    page.fill(
        "#document",
        '<bml id="w"><speech id="s"><text>Hello there, it is nice to see you.</text></speech></bml>',
    )
    page.click("#play")
    page.wait_for_selector("#score .word:has-text('you')")
    words = """() => [...document.querySelectorAll('#score .word')].map((word) => {
      const { left, right, top, bottom } = word.getBoundingClientRect();
      return { left, right, top, bottom, whole: word.scrollWidth <= word.clientWidth };
    })"""
    boxes = page.evaluate(words)
    assert all(box["whole"] for box in boxes)
    for one in boxes:
        for other in boxes:
            apart = one["right"] <= other["left"] + 0.5 or one["bottom"] <= other["top"] + 0.5
            assert (
                one is other
                or apart
                or other["right"] <= one["left"] + 0.5
                or other["bottom"] <= one["top"] + 0.5
            )
    row = "document.querySelector('#score .track:not(.speech)')?.offsetHeight ?? 24"
    assert page.evaluate("document.getElementById('score').clientHeight") % page.evaluate(row) == 0


# what is held -------------------------------------------------------------------------------------


def test_sliders_set_action_units_on_both_sides_or_one(page) -> None:  # type: ignore[no-untyped-def]
    page.click("#tab-aus")
    assert page.locator("#au-sliders .row.au").count() == len(action_units())
    slide(page, "AU 12 Lip corner puller, left", 0.8)
    shown(page, au12L=0.8, au12R=0.8)
    page.click("button[aria-label='AU 12: both sides together']")
    slide(page, "AU 12 Lip corner puller, right", 0)
    shown(page, au12L=0.8, au12R=0)
    page.click("#neutral")
    shown(page, au12L=0, au12R=0)
    page.click("button[aria-label='AU 12: both sides together']")


def test_sliders_show_what_an_emotion_moves(page) -> None:  # type: ignore[no-untyped-def]
    page.click("#tab-aus")
    page.evaluate("realizerPage.pose.set({ emotion: { name: 'sadness' } })")
    left = page.locator("#au-sliders input[aria-label='AU 1 Inner brow raiser, left']")
    page.wait_for_function("(input) => Number(input.value) > 0.5", arg=left.element_handle())
    assert page.locator(".row.au.held").count() == 0
    slide(page, "AU 1 Inner brow raiser, left", 0.3)
    assert page.locator(".row.au.held").count() == 1
    page.click("#neutral")
    page.wait_for_function("(input) => Number(input.value) === 0", arg=left.element_handle())


def test_sliders_are_found_by_number_and_name(page) -> None:  # type: ignore[no-untyped-def]
    page.click("#tab-aus")
    page.fill("#find-aus", "dimpl")
    assert page.locator(".row.au:visible").count() == 1
    page.fill("#find-aus", "no such unit")
    words = "getComputedStyle(document.querySelector('#au-sliders'), '::before').content"
    assert page.evaluate(words) == '"Nothing has this name."'
    page.fill("#find-aus", "")
    assert page.evaluate(words) == "none"
    page.click("#tab-faps")
    page.fill("#find-faps", "f31")
    assert page.locator(".row.fap:visible > span").all_text_contents() == ["raise l i eyebrow"]
    page.fill("#find-faps", "")


def test_sliders_set_faps_and_save_them_as_a_file(page) -> None:  # type: ignore[no-untyped-def]
    page.click("#tab-faps")
    slide(page, "FAP 3 open jaw", 400)
    number = page.locator("input[aria-label='FAP 5 raise b midlip, value']")
    number.fill("-300")
    number.press("Enter")
    assert page.text_content("#held") == "held: 2 FAPs"
    with page.expect_download() as saved:
        page.click("#save")
    assert saved.value.suggested_filename == "pose.fap"
    clip = read_fap(Path(saved.value.path()).read_text("ascii"))
    assert clip.values[0, COLUMN["open_jaw"]] == 400
    assert clip.values[0, COLUMN["raise_b_midlip"]] == -300
    page.wait_for_function("realizerPage.timeline.kinds.fap.at(Infinity).open_jaw === 400")


def test_wheel_shows_the_clicked_place_by_the_chosen_profiles(page) -> None:  # type: ignore[no-untyped-def]
    page.click("#tab-wheel")
    box = page.locator("#wheel svg").bounding_box()
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.click(middle[0], middle[1] - 60)
    page.wait_for_selector("#feels:has-text('surprise 100 %')")
    raised = "async () => (await realizerPage.link.ask({ type: 'state' })).characters[0].aus['5L'] > 0.2"
    page.wait_for_function(raised)
    page.press("#wheel svg", "ArrowLeft")
    page.wait_for_selector("#feels:has-text('sadness 11 %')")
    page.select_option("#profiles", "published")
    page.wait_for_selector("#moves li:has-text('raise l i eyebrow')")
    assert page.evaluate("realizerPage.pose.emotion") is None
    mixed = page.evaluate("Object.fromEntries(realizerPage.pose.faps)")
    page.select_option("#profile", "fear 8")
    page.wait_for_selector("#feels:has-text('fear 8')")
    assert page.evaluate("Object.fromEntries(realizerPage.pose.faps)") != mixed
    page.select_option("#profiles", "own")
    page.fill("#feeling", "guilty")
    page.press("#feeling", "Enter")
    page.wait_for_selector("#feels:has-text('guilty')")
    assert page.evaluate("realizerPage.pose.emotion.name") == "guilty"
    page.click("#neutral")
    page.wait_for_selector("#feels:has-text('neutral')")
    shown(page, au5L=0)


# the rest -----------------------------------------------------------------------------------------


def test_page_changes_the_voice(page) -> None:  # type: ignore[no-untyped-def]
    names = page.locator("#voice option").all_text_contents()
    assert page.input_value("#voice") == "silent" in names
    page.dispatch_event("#voice", "change")
    page.wait_for_function(
        "async () => (await realizerPage.link.ask({ type: 'state' })).characters[0].voice === 'silent'"
    )


def test_feedback_is_listed_in_order_of_its_times(page) -> None:  # type: ignore[no-untyped-def]
    wait = '<bml id="{}"{}><wait id="w" duration="0.6"/></bml>'
    appended = [wait.format(id, ' composition="APPEND"') for id in ("second", "third")]
    page.fill("#document", "\n".join([wait.format("first", ""), *appended]))
    page.click("#play")
    page.wait_for_selector("#log li:has-text('third ends')")
    times = [float(text) for text in page.locator("#log time").all_text_contents() if text]
    assert times == sorted(times)
    planned = page.locator("#log li.plan span").all_text_contents()
    assert any(text.startswith("third is planned, ") and text.endswith(" s") for text in planned)


def test_feedback_is_filtered_by_kind_and_words(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#document", NOD.format("typed"))
    page.click("#play")
    page.wait_for_selector("#log li:has-text('typed ends')")
    assert page.locator("#log .point:visible").count() == 11
    page.uncheck("#points")
    assert page.locator("#log .point:visible").count() == 0
    page.check("#points")
    page.fill("#filter", "f attack")
    assert page.locator("#log li:visible span").all_text_contents() == ["f attackPeak"]
    assert page.get_attribute("#log", "class") == ""
    page.fill("#filter", "no such word")
    assert page.get_attribute("#log", "class") == "none"
    page.fill("#filter", "")
    assert page.get_attribute("#log", "class") == ""


def test_page_records_and_saves_a_film(page) -> None:  # type: ignore[no-untyped-def]
    av = pytest.importorskip("av", reason="the film extra is not installed")
    page.click("#tab-aus")
    page.click("#record")
    slide(page, "AU 12 Lip corner puller, left", 1)
    page.wait_for_function("realizerPage.recorder.parts.reduce((sum, part) => sum + part.size, 0) > 1000")
    with page.expect_download() as saved:
        page.click("#record")
    page.wait_for_selector("#record[aria-pressed='false']")
    with av.open(io.BytesIO(Path(saved.value.path()).read_bytes())) as film:
        picture = next(film.decode(video=0)).to_ndarray(format="rgb24")
    skin = picture[picture.shape[0] // 2, picture.shape[1] // 2]
    assert skin[0] > skin[1] > skin[2]
    assert picture[8, 8].sum() > 30, "the backdrop is in the film"


def test_page_is_light_or_dark(page) -> None:  # type: ignore[no-untyped-def]
    paper = "() => getComputedStyle(document.body).backgroundColor"
    page.emulate_media(color_scheme="dark")
    dark = page.evaluate(paper)
    page.emulate_media(color_scheme="light")
    light = page.evaluate(paper)
    assert light != dark
    seen = []
    for _ in range(3):
        page.click("#theme")
        seen.append((page.get_attribute("#theme", "aria-label"), page.evaluate(paper)))
    assert seen == [("Theme: light", light), ("Theme: dark", dark), ("Theme: as the system", light)]


def test_page_has_no_serious_accessibility_fault_in_any_tab(page) -> None:  # type: ignore[no-untyped-def]
    for scheme, rules in (("light", {}), ("dark", {"runOnly": ["color-contrast"]})):
        page.emulate_media(color_scheme=scheme)
        for tab in page.locator("#tabs button:visible").all():
            tab.click()
            assert serious_faults(page, **rules) == [], f"{tab.inner_text()}, {scheme}"
    page.emulate_media(color_scheme="light")


def test_page_is_usable_by_keyboard(page) -> None:  # type: ignore[no-untyped-def]
    page.focus("#tab-script")
    for panel in ("aus", "faps", "emotion", "design", "face", "mirror", "script"):
        page.keyboard.press("ArrowRight")
        assert page.locator(f"#{panel}").is_visible()
    page.click("#help")
    assert page.locator("#keys").is_visible()
    page.keyboard.press("Escape")
    page.fill("#document", '<bml id="keyed"><wait id="w" duration="600"/></bml>')
    page.press("#document", "Control+Enter")
    page.wait_for_selector("#log li:has-text('keyed starts')")
    page.keyboard.press("Control+.")
    page.wait_for_selector("#log li:has-text('keyed ends')")
    names = "all => all.filter((e) => !(e.ariaLabel || e.textContent.trim() || e.labels?.length)).length"
    assert page.locator("button, input, select, [role=slider]").evaluate_all(names) == 0
