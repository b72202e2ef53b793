"""The page in a real browser, against the real service: the face lives and documents play."""

from __future__ import annotations

import io
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt install chromium"),
    # Playwright's own event loop closes its pipes late.
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]
ARGUMENTS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-background-networking",
    "--autoplay-policy=no-user-gesture-required",
]


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    """A service on a free port of loopback; stopped by the signal its user would send."""
    command = [sys.executable, "-m", "realizer", "serve", "--port", "0"]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    service = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment)
    assert service.stdout is not None
    found = None
    while found is None:
        line = service.stdout.readline()
        assert line, "the service ended before it listened"
        found = re.search(r"http://127\.0\.0\.1:\d+", line)
    yield found.group()
    service.send_signal(signal.SIGINT)
    service.stdout.close()
    assert service.wait(15) == 0


@pytest.fixture(scope="module")
def browser() -> Iterator[object]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield opened
        opened.close()


@pytest.fixture
def page(browser, address):  # type: ignore[no-untyped-def]
    """The page, open; any error on its console fails the test."""
    # Playwright's own predicates need eval, which the page's policy forbids.
    opened = browser.new_page(viewport={"width": 1000, "height": 640}, bypass_csp=True)
    faults: list[str] = []
    opened.on("pageerror", lambda error: faults.append(str(error)))
    opened.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    opened.goto(address)
    opened.wait_for_selector('#status[data-state="live"]')
    yield opened
    opened.close()
    assert faults == []


def picture(page):  # type: ignore[no-untyped-def]
    from PIL import Image

    return Image.open(io.BytesIO(page.locator("#face").screenshot())).convert("RGB")


def pixel(image, across: float, down: float) -> tuple[int, int, int]:  # type: ignore[no-untyped-def]
    return image.getpixel((int(across * image.width), int(down * image.height)))  # type: ignore[no-any-return]


def test_the_face_is_there_and_alive(page) -> None:  # type: ignore[no-untyped-def]
    page.wait_for_function("realizerPage.stage.shownFrames > 5")
    skin = pixel(picture(page), 0.5, 0.5)
    assert skin[0] > skin[1] > skin[2], "skin is warmer than the backdrop"
    assert pixel(picture(page), 0.02, 0.02) != skin


def test_a_typed_document_plays_and_its_feedback_is_shown(page) -> None:  # type: ignore[no-untyped-def]
    page.wait_for_function("realizerPage.stage.shownFrames > 1")
    page.fill("#document", '<bml id="typed"><faceLexeme id="s" lexeme="SMILE" end="0.8"/></bml>')
    page.press("#document", "Control+Enter")
    page.wait_for_selector("#log li:has-text('typed ends')")
    lines = page.locator("#log li span").all_text_contents()
    told = ["typed starts", "s start", "s attackPeak", "s relax", "s end", "typed ends"]
    assert [line for line in lines if line in told] == told


def test_a_broken_document_is_told_and_the_page_lives_on(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#document", '<bml id="broken"><head')
    page.click("#play")
    page.wait_for_selector("#log .warning")
    page.fill("#document", '<bml id="well"><wait id="w" duration="0.1"/></bml>')
    page.click("#play")
    page.wait_for_selector("#log li:has-text('well ends')")
    assert page.get_attribute("#status", "data-state") == "live"


def test_the_examples_are_at_hand(page) -> None:  # type: ignore[no-untyped-def]
    page.wait_for_selector("#gallery button")
    names = page.locator("#gallery button").all_text_contents()
    assert "Greeting" in names
    page.click("#gallery button:nth-child(2)")
    assert "really" in page.input_value("#document")


def test_the_same_document_can_be_played_while_it_plays(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#document", '<bml id="twice"><wait id="w" duration="1"/></bml>')
    page.click("#play")
    page.wait_for_selector("#log li:has-text('twice starts')")
    page.click("#play")
    page.wait_for_selector("#log li:has-text('twice-1 ends')")
    assert page.locator("#log .warning").count() == 0


def test_replace_ends_what_plays_and_stop_ends_all(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#document", '<bml id="long"><wait id="w" duration="600"/></bml>')
    page.click("#play")
    page.wait_for_selector("#log li:has-text('long starts')")
    page.fill("#document", '<bml id="other"><wait id="w" duration="600"/></bml>')
    page.click("#replace")
    page.wait_for_selector("#log li:has-text('long ends')")
    page.wait_for_selector("#log li:has-text('other starts')")
    page.click("#stop")
    page.wait_for_selector("#log li:has-text('other ends')")


def test_speech_is_heard_and_the_sound_is_the_clock(page) -> None:  # type: ignore[no-untyped-def]
    page.fill(
        "#document", '<bml id="talk"><speech id="s"><text>Hello there, how are you?</text></speech></bml>'
    )
    page.click("#play")
    page.wait_for_selector("#log li:has-text('talk starts')")
    page.wait_for_function("realizerPage.sound.playhead() !== null")
    page.wait_for_selector("#log li:has-text('talk ends')")
    assert page.get_attribute("#sound", "aria-pressed") == "true"


def test_a_lost_connection_comes_back_with_what_was_missed(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#document", '<bml id="kept"><wait id="w" duration="0.3"/></bml>')
    page.click("#play")
    page.wait_for_selector("#log li:has-text('kept starts')")
    page.evaluate("() => realizerPage.link.socket.close()")
    page.wait_for_selector('#status[data-state="lost"]')
    page.wait_for_selector('#status[data-state="live"]')
    page.wait_for_selector("#log li:has-text('kept ends')")
    lines = page.locator("#log li span").all_text_contents()
    assert lines.count("kept starts") == lines.count("kept ends") == 1


def test_the_page_obeys_its_own_policy(browser, address) -> None:  # type: ignore[no-untyped-def]
    opened = browser.new_page()
    faults: list[str] = []
    opened.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    opened.goto(address)
    opened.wait_for_selector('#status[data-state="live"]')
    opened.wait_for_selector("#stage-note:empty", state="attached")
    opened.close()
    assert faults == []


def test_the_page_fits_a_phone(page) -> None:  # type: ignore[no-untyped-def]
    page.set_viewport_size({"width": 390, "height": 844})
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert page.locator("#play").is_visible()
