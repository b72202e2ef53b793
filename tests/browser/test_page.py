"""The page in a real browser, against the real service: the face lives and documents play."""

from __future__ import annotations

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
    opened = browser.new_page(viewport={"width": 1280, "height": 800})
    faults: list[str] = []
    opened.on("pageerror", lambda error: faults.append(str(error)))
    opened.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    opened.goto(address)
    opened.wait_for_selector('#status[data-state="live"]')
    yield opened
    opened.close()
    assert faults == []


def picture(page) -> bytes:  # type: ignore[no-untyped-def]
    return page.locator("#face").screenshot()  # type: ignore[no-any-return]


def test_the_face_is_there_and_alive(page) -> None:  # type: ignore[no-untyped-def]
    page.wait_for_function("realizerPage.view.frames > 5")
    colours = page.evaluate(
        """() => {
            const view = realizerPage.view, gl = view.renderer.getContext();
            const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
            const pixels = new Uint8Array(w * h * 4);
            gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
            const at = (x, y) => {
                const first = 4 * (Math.floor(y * h) * w + Math.floor(x * w));
                return [...pixels.slice(first, first + 3)];
            };
            return { cheek: at(0.5, 0.47), corner: at(0.02, 0.98) };
        }"""
    )
    red, green, blue = colours["cheek"]
    assert red > green > blue, "skin is warmer than the backdrop"
    assert colours["cheek"] != colours["corner"]


def test_a_typed_document_plays_and_its_feedback_is_shown(page) -> None:  # type: ignore[no-untyped-def]
    page.wait_for_function("realizerPage.view.frames > 1")
    page.fill("#document", '<bml id="typed"><faceLexeme id="s" lexeme="SMILE" end="0.8"/></bml>')
    page.press("#document", "Control+Enter")
    page.wait_for_function("document.querySelector('#log').textContent.includes('typed-1:end')")
    log = page.locator("#log").text_content()
    for said in ("typed-1:start", "typed-1:s:attackPeak", "typed-1:s:end"):
        assert said in log


def test_a_broken_document_is_told_and_the_page_lives_on(page) -> None:  # type: ignore[no-untyped-def]
    page.fill("#document", '<bml id="broken"><head')
    page.click("#play")
    page.wait_for_selector("#log .warningFeedback")
    page.fill("#document", '<bml id="well"><wait id="w" duration="0.1"/></bml>')
    page.click("#play")
    page.wait_for_function("/well-\\d+:end/.test(document.querySelector('#log').textContent)")
    assert page.get_attribute("#status", "data-state") == "live"


def test_the_examples_are_at_hand(page) -> None:  # type: ignore[no-untyped-def]
    page.wait_for_selector("#gallery button")
    names = page.locator("#gallery button").all_text_contents()
    assert "Greeting" in names
    page.click("#gallery button:nth-child(2)")
    assert "really" in page.input_value("#document")


def test_the_page_fits_a_phone(page) -> None:  # type: ignore[no-untyped-def]
    page.set_viewport_size({"width": 390, "height": 844})
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert page.locator("#play").is_visible()
