"""Draws the pictures of README.md and docs/; needs Chromium: `python -m tests.benchmarks.pictures`."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

import realizer
from realizer.examples import examples
from realizer.outputs.output import RenderSettings

ROOT = Path(__file__).parents[2]
EMOTIONS = "ada JOY, ben SURPRISE, ida SADNESS, leo ANGER, nia DISGUST, omar FEAR"
FEELS = '<bml id="b"><faceLexeme id="f" lexeme="{}" amount="1" attackPeak="0.5" relax="2" end="3"/></bml>'
# Look back at the smile, and draw all of its pixels, which are too many for playing without a GPU.
LOOK_BACK = """async () => {
  const after = (ms) => new Promise((next) => setTimeout(next, ms));
  while (!document.body.innerText.includes("greeting ends")) await after(20);
  for (const key of ["PageUp", "ArrowLeft", "ArrowLeft", "ArrowLeft"])
    document.querySelector(".scrub").dispatchEvent(new KeyboardEvent("keydown", { key }));
  Object.assign(realizerPage.stage, { pace() {}, part: 2, stale: true });
  await after(4000);
}"""
COLUMNS, TILE = 12, 104  # pictures of the film in a row, pixels


def faces(path: Path) -> None:
    """Everybody at rest, and below with an emotion."""
    pairs = []
    for name, emotion in map(str.split, EMOTIONS.split(", ")):
        played = realizer.realize(FEELS.format(emotion), face=name, idle=False)
        pairs.append(np.vstack([played.picture(at=at, size=(230, 280)) for at in (0, 1.2)]))
    Image.fromarray(np.hstack(pairs)).save(path, optimize=True)


def film(path: Path) -> None:
    """Thirty seconds of docs/film.bml, a picture every 0.8 s with its time."""
    played = realizer.realize(ROOT / "docs" / "film.bml")
    times = np.arange(3 * COLUMNS) * 0.8 + 0.72
    frames = (times * played.fps).round().astype(int).tolist()
    pictures = RenderSettings(camera="close").pictures(played, (240, 240), frames)
    sheet = Image.new("RGB", (COLUMNS * TILE, 3 * TILE))
    for i, (at, pixels) in enumerate(zip(times, pictures, strict=True)):
        small = Image.fromarray(pixels[20:228, 16:224]).resize((TILE, TILE), Image.Resampling.LANCZOS)
        ImageDraw.Draw(small).text((2, 0), f"{at:.1f}", "white")
        sheet.paste(small, (i % COLUMNS * TILE, i // COLUMNS * TILE))
    sheet.save(path, quality=88, optimize=True)


def page(path: Path) -> None:
    """The page after the greeting, its timeline at the smile."""
    from playwright.sync_api import sync_playwright

    from tests.browser.test_page import ARGUMENTS, CHROMIUM, PATIENCE, serving

    command = [sys.executable, "-m", "realizer", "serve", "--port", "0"]
    with serving(command) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        opened = browser.new_page(viewport={"width": 1440, "height": 900}, bypass_csp=True)
        opened.set_default_timeout(PATIENCE)
        opened.goto(address)
        opened.wait_for_selector("#lights button")
        opened.click("#play")
        opened.evaluate(LOOK_BACK)
        opened.screenshot(path=path)
    Image.open(path).convert("RGB").save(path, optimize=True)


if __name__ == "__main__":
    os.environ["REALIZER_DRAW"] = "onboard"
    sheet = realizer.realize(examples()["greeting"]).save(ROOT / "realizer/examples/greeting.png")
    Image.open(sheet).save(sheet, optimize=True)
    faces(ROOT / "realizer/examples/faces.png")
    film(ROOT / "docs" / "film-after.jpg")
    page(ROOT / "realizer/examples/page.png")
