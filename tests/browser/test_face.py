"""The Face tab in a real browser: the gestures of Paul 2010, 4.3.2, and what goes wrong."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from realizer.face.load import folder_of
from tests.bare_heads import bare_head
from tests.browser.test_page import ARGUMENTS, CHROMIUM, PATIENCE, browser, pytestmark, serving

__all__ = ["ARGUMENTS", "CHROMIUM", "browser", "pytestmark"]

ROOM = "realizerPage.room"
STATE = f"{ROOM}.draft.state"
READY = f"{ROOM}.points.says && !{ROOM}.loading"


@pytest.fixture(scope="module")
def edit(tmp_path_factory) -> Path:  # type: ignore[no-untyped-def]
    return tmp_path_factory.mktemp("edit")  # type: ignore[no-any-return]


@pytest.fixture(scope="module")
def address(edit: Path) -> Iterator[str]:
    command = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent", "--no-idle"]
    with serving([*command, "--edit", str(edit)]) as address:
        yield address


class Tab:
    """The Face tab of a page."""

    def __init__(self, page: Any) -> None:
        self.page = page

    def __call__(self, script: str) -> Any:
        return self.page.evaluate(script)

    def state(self, path: str) -> Any:
        return self.page.evaluate(f"{STATE}.{path}")

    def until(self, script: str) -> None:
        self.page.wait_for_function(script)

    def step(self, name: str) -> None:
        self.page.click(f'#face [aria-label="What is edited"] >> text="{name}"')

    def fap(self, number: int) -> None:
        self.page.select_option('#face [aria-label="FAP"]', str(number))
        self.until(f"!{ROOM}.motion.pending")

    def at(self, name: str) -> tuple[float, float]:
        """Where a feature point is on the page, in pixels."""
        box = self.page.locator("#face-head").bounding_box()
        x, y = self(f"{ROOM}.view.onScreen({STATE}.points['{name}'])")
        return box["x"] + x, box["y"] + y

    def drag(self, *places: tuple[float, float]) -> None:
        self.page.mouse.move(*places[0])
        self.page.mouse.down()
        for place in places[1:]:
            self.page.mouse.move(*place, steps=4)
        self.page.mouse.up()

    def note(self) -> str:
        return str(self.page.locator("#face > p.hint").last.text_content())


@pytest.fixture(scope="module")
def opened(browser, address):  # type: ignore[no-untyped-def]
    page = browser.new_page(viewport={"width": 1280, "height": 860}, bypass_csp=True)
    page.set_default_timeout(PATIENCE)
    faults: list[str] = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    page.goto(f"{address}#face")
    page.wait_for_function(READY)
    yield page, faults
    page.close()


@pytest.fixture
def tab(opened):  # type: ignore[no-untyped-def]
    """The tab with the face as it was opened; any error on the console fails the test."""
    page, faults = opened
    faults.clear()
    tab = Tab(page)
    tab(f"{ROOM}.view.home()")
    while tab(f"{ROOM}.draft.past.length"):
        tab(f"{ROOM}.draft.undo()")
    tab(f"{ROOM}.faps.try(0)")
    tab.step("Points")
    tab.until(f"{ROOM}.view.stale === false")
    yield tab
    assert faults == []


def test_tab_is_open_by_its_address_and_shows_84_points(tab: Tab) -> None:
    assert tab.page.is_visible("#face")
    assert tab.page.locator(".fp:not(.axis)").count() == 84
    assert tab.page.is_hidden("#time")
    tab.page.click("#tab-script")
    assert tab.page.is_hidden("#face-stage")
    tab.page.click("#tab-face")
    assert tab("location.hash") == "#face"


def test_camera_turns_by_mouse_wheel_and_keys(tab: Tab) -> None:
    orbit = lambda: tab(f"({{ ...{ROOM}.view.orbit }})")  # noqa: E731
    before = orbit()
    tab.drag((100, 700), (180, 660))
    turned = orbit()
    assert turned["yaw"] < before["yaw"]
    assert turned["pitch"] != before["pitch"]
    tab.page.mouse.wheel(0, -300)
    tab.until(f"{ROOM}.view.orbit.away < {turned['away']}")
    tab.page.focus("#face-head")
    for key, name in (
        ("w", "away"),
        ("ArrowDown", "away"),
        ("ArrowLeft", "yaw"),
        ("PageUp", "y"),
        ("d", "x"),
    ):
        here = orbit()[name]
        tab.page.keyboard.press(key)
        assert orbit()[name] != here, key
    tab.page.keyboard.press("Home")
    assert orbit() == before


def test_click_on_the_head_places_the_chosen_point_and_its_twin(tab: Tab) -> None:
    tab.page.select_option('#face [aria-label="Feature point"]', "5.1")
    x, y = tab.at("5.1")
    tab.page.mouse.click(x + 20, y + 10)
    left, right = tab.state("points['5.1']"), tab.state("points['5.2']")
    assert right == [-left[0], left[1], left[2]]
    assert left != tab(f"{ROOM}.draft.head.points['5.1']")
    tab.page.keyboard.press("Control+z")
    assert tab.state("points['5.1']") == tab(f"{ROOM}.draft.head.points['5.1']")
    tab.page.keyboard.press("Control+y")
    assert tab.state("points['5.1']") == left


def test_unplaced_points_are_asked_for_by_name(tab: Tab) -> None:
    question = tab.page.locator(".face-asked p")
    tab.page.click("text=Place all by hand")
    assert question.text_content() == "Click on 2.1 bottom of the chin 84 to look at"
    tab.page.mouse.click(*tab.at("2.1"))
    assert question.text_content().startswith("Click on 2.2 upper lip")
    tab.page.click("text=It is right")
    assert question.text_content().startswith("Click on 2.3")
    tab.page.click("text=It is right")
    tab.page.mouse.click(*tab.at("2.4"))
    assert question.text_content().startswith("Click on 2.6"), "2.5 was placed with 2.4"


def test_marks_are_dragged_and_moved_by_keys(tab: Tab) -> None:
    tab.page.click('#face label:has-text("both sides together")')
    x, y = tab.at("5.3")
    right = tab.state("points['5.4']")
    tab.drag((x, y), (x + 10, y + 15), (x + 18, y + 25))
    moved = tab.state("points['5.3']")
    assert moved != tab(f"{ROOM}.draft.head.points['5.3']")
    assert tab.state("points['5.4']") == right
    tab.page.locator('[aria-label^="Feature point 5.3"]').focus()
    tab.page.keyboard.press("ArrowUp")
    tab.page.keyboard.press("Shift+PageUp")
    x, y, z = tab.state("points['5.3']")
    assert (round(y - moved[1], 6), round(z - moved[2], 6)) == (0.0005, 0.005)
    tab.page.select_option('#face [aria-label="Feature point"]', "5.4")
    tab.page.click('text="Copy from the other side" >> visible=true')
    assert tab.state("points['5.4']") == [-x, y, z]
    tab.page.click('#face label:has-text("both sides together")')


def test_touch_places_a_point_and_pinches(browser, address) -> None:  # type: ignore[no-untyped-def]
    page = browser.new_page(viewport={"width": 820, "height": 1180}, has_touch=True, bypass_csp=True)
    page.set_default_timeout(PATIENCE)
    page.goto(f"{address}#face")
    page.wait_for_function(READY)
    tab = Tab(page)
    tab.until(f"{ROOM}.view.stale === false")
    page.select_option('#face [aria-label="Feature point"]', "5.1")
    page.evaluate("scrollTo(0, 0)")
    x, y = tab.at("5.1")
    page.touchscreen.tap(x + 15, y + 12)
    assert tab.state("points['5.1']") != tab(f"{ROOM}.draft.head.points['5.1']")
    away = tab(f"{ROOM}.view.orbit.away")
    touch = page.context.new_cdp_session(page)
    for kind, gap in (("touchStart", 40), ("touchMove", 60), ("touchMove", 120), ("touchEnd", None)):
        points = (
            [] if gap is None else [{"x": 400 - gap, "y": 580, "id": 1}, {"x": 400 + gap, "y": 580, "id": 2}]
        )
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    assert tab(f"{ROOM}.view.orbit.away") < away
    page.close()


def test_zone_of_a_fap_is_drawn_and_changed_on_both_sides(tab: Tab) -> None:
    tab.step("Zones")
    tab.fap(6)
    assert tab(f"{ROOM}.view.zone.visible")
    assert tab(f"{ROOM}.view.zone.position.toArray()") == pytest.approx(tab.state("points['2.4']"))
    size = tab.page.locator('[aria-label="size, mm, value"]')
    size.fill("30")
    size.press("Enter")
    tab.page.select_option('#face [aria-label="Falloff"]', "ease")
    tab.page.locator('[aria-label="scale y"]').press("ArrowRight")
    for fap in (6, 7):
        zone = tab.state(f"zones.get({fap})")
        assert (zone["size"], zone["falloff"], zone["scale"][1]) == (0.03, "ease", 1.01)
    tab.until(f"!{ROOM}.motion.pending")
    assert tab(f"{ROOM}.view.zone.scale.y") == pytest.approx(0.0303)
    assert tab.page.is_visible('[aria-label="ease"]')
    tab.page.click('#face label:has-text("keep both sides alike")')
    size.fill("22")
    size.press("Enter")
    assert [tab.state(f"zones.get({fap}).size") for fap in (6, 7)] == [0.022, 0.03]
    tab.page.click('text="Copy from the other side" >> visible=true')
    assert tab.state("zones.get(6).size") == 0.03


def test_slider_tests_a_fap_and_the_whole_range_goes_further(tab: Tab) -> None:
    moved = f"Math.max(...{ROOM}.draft.mesh.posed.map((x, i) => Math.abs(x - {ROOM}.draft.mesh.vertices[i])))"
    tab.step("Zones")
    tab.fap(4)
    tab(f"{ROOM}.draft.set(4, {{ size: 0.02 }})")
    tab.page.locator('[aria-label="Test"]').press("End")
    tab.until(f"!{ROOM}.motion.pending && {moved} > 0.001")
    usual = tab(moved)
    tab.page.click('#face [aria-label="Range of the test"] >> text="Whole"')
    tab.page.locator('[aria-label="Test"]').press("End")
    tab.until(f"!{ROOM}.motion.pending && {moved} > {usual}")
    tab.page.click('#face [aria-label="Range of the test"] >> text="Usual"')
    tab.fap(3)  # the service opens the jaw
    tab.page.locator('[aria-label="Test"]').press("End")
    tab.until(f"{moved} > 0.004")


def test_sweep_moves_one_fap_after_the_other(tab: Tab) -> None:
    tab.step("Zones")
    tab.fap(31)
    tab.page.click("text=Sweep all")
    tab.until(f"{ROOM}.faps.fap === 33")
    tab.page.click('#face button:has-text("Stop") >> visible=true')
    assert tab(f"{ROOM}.faps.value") == 0


def test_mask_is_painted_lassoed_grown_and_inverted(tab: Tab) -> None:
    count = lambda fap: tab(f"{STATE}.masks.get({fap})?.reduce((sum, x) => sum + x, 0) ?? 0")  # noqa: E731
    tab.step("Zones")
    tab.fap(41)
    tab.page.click('#face [aria-label="Mask tools"] >> text="Brush"')
    tab.page.locator('[aria-label^="Size of the brush"]').press("End")
    x, y = tab.at("5.3")
    tab.drag((x, y), (x + 12, y + 8))
    painted = count(41)
    assert painted > 3
    assert count(42) == painted, "the other side has the mirror image"
    assert tab.state("zones.get(41).use_mask")
    tab.page.click('#face button:has-text("Grow")')
    grown = count(41)
    assert grown > painted
    tab.page.click('#face label:has-text("take away")')
    tab.page.mouse.click(x, y)
    assert count(41) < grown
    tab.page.click('#face label:has-text("take away")')
    before = count(41)
    tab.page.click('#face [aria-label="Mask tools"] >> text="Lasso"')
    tab.drag((x - 60, y - 60), (x + 60, y - 60), (x + 60, y + 60), (x - 60, y + 60))
    assert count(41) > before
    tab.page.click('#face label:has-text("invert")')
    assert tab.state("zones.get(41).invert_mask")
    tab.page.click('#face [aria-label="Mask tools"] >> text="Look"')


def test_action_unit_is_fitted_to_a_dragged_marker_and_saved(tab: Tab, edit: Path) -> None:
    tab.step("Units")
    words = f"{ROOM}.units.words.textContent"
    tab.until(f"{words}.startsWith('The fit misses') && !{ROOM}.motion.pending")
    box = tab.page.locator('[aria-label="Marker 1 on the left"]').bounding_box()
    corner = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    before = tab(f"{ROOM}.units.rows[0]")
    tab.drag(corner, (corner[0] + 6, corner[1] - 8))
    row = tab.state("units[12][0]")
    assert row[:3] == before[:3]
    assert row[3] > before[3], "outwards"
    assert row[4] > before[4], "and up"
    assert tab(words).startswith("Markers were moved")
    tab.page.click('button:text-is("Refit")')
    tab.until(f"{words}.startsWith('The fit misses')")
    tab.page.fill('#face [aria-label="Name of the face"]', "smiler")
    tab.page.click('button:text-is("Save")')
    tab.until(f"{ROOM}.note.textContent.includes('faces/smiler')")
    assert (edit / "faces" / "smiler" / "au_extended.toml").is_file()
    tab.page.click('button:text-is("As it was")')
    assert tab(f"{ROOM}.units.rows[0]") == before


def test_accessories_and_marks_are_hidden_and_shown(tab: Tab) -> None:
    triangles = f"{ROOM}.view.shape.geometry.index.count"
    whole = tab(triangles)
    tab.page.click('#face [aria-label="Shown"] >> text="teeth"')
    assert tab(triangles) < whole
    tab.page.click('#face [aria-label="Shown"] >> text="teeth"')
    assert tab(triangles) == whole
    tab.page.click('#face [aria-label="Shown"] >> text="marks"')
    assert tab.page.is_hidden("#face-marks")
    tab.page.click('#face [aria-label="Shown"] >> text="marks"')
    assert tab.page.is_visible("#face-marks")


def test_score_by_rules_says_what_is_wrong(tab: Tab) -> None:
    tab.step("Zones")
    tab.fap(65)
    tab(f"{ROOM}.draft.set(65, {{ size: 0.003 }})")
    tab.page.click("text=Score this FAP")
    tab.page.locator(".face-why.low", has_text="neighbours move apart").wait_for()


def test_shapes_of_the_face_and_differences_are_shown(tab: Tab) -> None:
    tab.step("Zones")
    tab.fap(31)
    tab(f"{ROOM}.draft.set(31, {{ size: 0.01 }}); {ROOM}.faps.try(150)")
    tab.until(f"!{ROOM}.motion.pending")
    own = tab.page.locator('#face label:has-text("own shapes")')
    zone = tab(f"Array.from({ROOM}.draft.mesh.posed)")
    own.click()
    tab.until(f"!{ROOM}.motion.pending")
    assert tab(f"Array.from({ROOM}.draft.mesh.posed)") != zone
    own.click()
    tab.page.click('#face label:has-text("difference")')
    tab.until("document.getElementById('face-difference').getContext('2d').getImageData(0, 0, 1, 1)")
    assert tab.page.is_visible("#face-difference")
    tab.page.click('#face label:has-text("difference")')


def test_xml_is_written_and_read_back(tab: Tab, tmp_path: Path) -> None:
    tab.step("Zones")
    tab(f"{ROOM}.draft.set(33, {{ size: 0.021, falloff: 'ease', ease: 25, slide: 0 }})")
    with tab.page.expect_download() as file:
        tab.page.click('#face button:has-text("XML")')
    file.value.save_as(tmp_path / "zones.xml")
    before = tab(f"{ROOM}.draft.table()")
    tab.page.keyboard.press("Control+z")
    tab.page.set_input_files('#face input[type="file"]', tmp_path / "zones.xml")
    tab.until(f"{STATE}.by.size === 2")
    after = tab(f"{ROOM}.draft.table()")
    for one, other in zip(before["zone"], after["zone"], strict=True):
        assert one == other
    assert after["points"] == before["points"]


def test_saving_keeps_what_somebody_else_saved(tab: Tab, browser, address, edit: Path) -> None:  # type: ignore[no-untyped-def]
    name = tab.page.locator('#face [aria-label="Name of the face"]')
    save = tab.page.locator('#face button:has-text("Save")')
    name.fill("two")
    tab(f"{ROOM}.draft.set(31, {{ size: 0.03 }})")
    save.click()
    tab.page.locator("#face > p.hint", has_text="Saved as faces/two").wait_for()
    saved = (edit / "faces" / "two" / "mpeg4.toml").read_text("utf-8")
    assert "fap = 31" in saved
    # Another page saves the same face.
    shutil.copy(folder_of("ada") / "features.csv", edit / "faces" / "two" / "features.csv")
    with (edit / "faces" / "two" / "mpeg4.toml").open("a") as file:
        file.write("# by another\n")
    tab(f"{ROOM}.draft.set(31, {{ size: 0.031 }})")
    save.click()
    tab.page.locator("#face > p.hint", has_text="saved by somebody else").wait_for()
    assert "# by another" in (edit / "faces" / "two" / "mpeg4.toml").read_text("utf-8")
    save.click()
    tab.page.locator("#face > p.hint", has_text="Saved as faces/two").wait_for()
    name.fill("ada")


def test_draft_outlives_a_lost_connection_and_the_page(tab: Tab) -> None:
    tab.page.select_option('#face [aria-label="Feature point"]', "5.1")
    x, y = tab.at("5.1")
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    tab.page.mouse.move(x + 15, y)
    tab(f"{ROOM}.service.socket.close()")
    tab.page.locator("#face > p.hint", has_text="the draft is kept in this browser").wait_for()
    tab.page.mouse.move(x + 20, y + 5)
    tab.page.mouse.up()
    moved = tab.state("points['5.1']")
    tab.page.locator("#face > p.hint", has_text="Connected again").wait_for()
    tab.page.reload()
    tab.until(READY)
    assert tab.state("points['5.1']") == moved
    assert "draft" in tab.note()
    tab(f"{ROOM}.draft.undo(); {ROOM}.draft.forget()")


def test_mesh_without_shapes_is_opened_and_scored(tab: Tab, tmp_path: Path) -> None:
    tab.page.set_input_files('#face input[type="file"]', bare_head(tmp_path / "bare.glb"))
    tab.until(f"{ROOM}.draft.head?.name === 'bare' && {READY}")
    assert tab.page.locator(".fp.asked").count() > 20
    assert tab.state("by.size") > 40
    tab.page.set_input_files(
        '#face input[type="file"]', bare_head(tmp_path / "blind.glb", without=["left_eye"])
    )
    tab.page.locator("#face > p.hint", has_text="wanted two eyeballs side by side").wait_for()
    assert tab(f"{ROOM}.draft.head.name") == "bare"
