"""Draws the pictures of README.md and docs/; needs Chromium: `python -m benchmarks.pictures`."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

import realizer
from realizer.examples import examples
from realizer.outputs.output import RenderSettings
from realizer.render.light import presets

ROOT = Path(__file__).parents[1]
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
EMOTION = """<bml id="b" xmlns:r="urn:bml-realizer:1">
  <r:emotion id="e" name="{}" start="0" end="2"/>
</bml>"""
HELLO = """<bml id="hello" xmlns:r="urn:bml-realizer:1">
  <speech id="s" start="0.2">
    <text>Hello! <sync id="send"/>Send me a text, <sync id="and"/>and I will speak it.</text>
  </speech>
  <faceLexeme id="brows" lexeme="RAISE_BROWS" amount="0.5" start="s:start-0.1" end="s:start+0.9"/>
  <faceLexeme id="smile" lexeme="SMILE" amount="0.6" start="s:and" end="s:end+0.8"/>
  <head id="nod" lexeme="NOD" amount="0.6" stroke="s:send"/>
</bml>"""
SPEAKERS = ("ida", "omar", "nia")
COLUMNS, TILE = 12, 104  # pictures of the film in a row, pixels


def faces(path: Path) -> None:
    """Everybody at rest, and below with an emotion."""
    pairs = []
    for name, emotion in map(str.split, EMOTIONS.split(", ")):
        played = realizer.realize(FEELS.format(emotion), face=name, idle=False)
        pairs.append(np.vstack([played.picture(at=at, size=(230, 280)) for at in (0, 1.2)]))
    Image.fromarray(np.hstack(pairs)).save(path, optimize=True)


def speaking(path: Path) -> None:
    """Three people who say hello, as an animated picture."""
    rows = []
    for seed, name in enumerate(SPEAKERS):
        played = realizer.realize(HELLO, face=name, seed=seed, fps=12.5)
        frames = list(range(played.frames))
        rows.append(list(RenderSettings(light="daylight").pictures(played, (230, 260), frames)))
    pictures = [Image.fromarray(np.hstack(pixels)) for pixels in zip(*rows, strict=False)]
    pictures[0].save(
        path, save_all=True, append_images=pictures[1:], duration=80, loop=0, quality=70, method=6
    )


def lights(path: Path) -> None:
    """One face in each light, and from each camera."""
    played = realizer.realize(FEELS.format("SMILE"), face="leo", idle=False)
    names = [light.name for light in presets().values()]
    row = np.hstack([played.picture(at=1.2, light=name, size=(230, 260)) for name in names])
    cameras = ("front", "three-quarter", "profile", "close")
    turned = [played.picture(at=1.2, camera=name, size=(230, 260)) for name in cameras]
    turned.append(played.picture(at=1.2, background="#7d8f86", size=(230, 260)))
    Image.fromarray(np.vstack([row, np.hstack(turned)])).save(path, quality=88, optimize=True)


def emotions(path: Path) -> None:
    """The six archetypes on two faces."""
    rows = []
    for face in ("nia", "ben"):
        row = []
        for word in ("joy", "surprise", "fear", "sadness", "disgust", "anger"):
            played = realizer.realize(EMOTION.format(word), face=face, idle=False)
            row.append(played.picture(at=1, size=(192, 230)))
        rows.append(np.hstack(row))
    Image.fromarray(np.vstack(rows)).save(path, quality=88, optimize=True)


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


ROOMS = {"desktop": ((1440, 900), "light"), "tablet": ((820, 1180), "dark")}


def designer(folder: Path) -> None:
    """The tab Design with the lanes of a text, at the second expression."""

    def prepare(page: Any) -> None:
        page.wait_for_selector("#lights button")
        page.wait_for_selector("#design-cards.drawn")
        page.fill("#design-text", "Are you sure? That is terrible! Yes, I understand.")
        page.press("#design-text", "Enter")
        page.wait_for_selector(".d-block")
        page.click('.d-card[title^="template:disgust:"]')
        page.wait_for_selector(".d-ghost")
        page.evaluate(
            "Object.assign(realizerPage.stage, { pace() {}, part: 2, stale: true }); scrollTo(0, 0)"
        )
        page.evaluate("realizerPage.design.look(realizerPage.design.preview.time + 0.2)")

    rooms(folder, "design", ["--voice", "espeak"], prepare)


def labels(folder: Path, corpus: Path) -> None:
    """The tab Label with the recording `anna` of a corpus."""

    def prepare(page: Any) -> None:
        page.wait_for_selector("#label-agreement td")
        page.click("#label-score .d-block")
        page.evaluate("realizerPage.label.look(1); scrollTo(0, 0)")

    rooms(folder, "label", ["--corpus", str(corpus)], prepare)


def zones(folder: Path) -> None:
    """The tab Face with the zone of the left corner of the lips."""

    def prepare(page: Any) -> None:
        page.wait_for_function("realizerPage.room.points.says && !realizerPage.room.loading")
        page.click('#face [aria-label="What is edited"] >> text="Zones"')
        page.select_option('#face [aria-label="FAP"]', "59")
        page.wait_for_function("!realizerPage.room.motion.pending && realizerPage.room.view.stale === false")

    with TemporaryDirectory() as edited:
        rooms(folder, "face", ["--edit", edited], prepare)


def rooms(folder: Path, tab: str, options: list[str], prepare: Callable[[Any], None]) -> None:
    """A tab as TAB-desktop.webp and TAB-tablet.webp, after `prepare(page)`."""
    from playwright.sync_api import sync_playwright

    from tests.browser.test_page import ARGUMENTS, CHROMIUM, PATIENCE, serving

    command = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--no-idle", *options]
    with serving(command) as address, sync_playwright() as playwright, TemporaryDirectory() as place:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        for name, ((width, height), scheme) in ROOMS.items():
            size = {"width": width, "height": height}
            opened = browser.new_page(viewport=size, bypass_csp=True, color_scheme=scheme)
            opened.set_default_timeout(PATIENCE)
            opened.add_init_script("localStorage.setItem('annotator', 'tom')")
            opened.goto(f"{address}#{tab}")
            prepare(opened)
            opened.wait_for_timeout(4000)
            opened.screenshot(path=Path(place, "room.png"))
            with Image.open(Path(place, "room.png")) as picture:
                picture.convert("RGB").save(folder / f"{tab}-{name}.webp", quality=88)
            opened.close()


def corpus(folder: Path) -> Path:
    """A corpus with a film of somebody who speaks, and the labels of two people."""
    from realizer_studio.corpus.recording import Annotation, Recording, write_recording

    (folder / "anna").mkdir()
    (folder / "corpus.toml").write_text("version = 1\n")
    bml = (
        '<bml id="b"><speech id="s"><text>Are you really sure about that?</text></speech>'
        '<faceFacs id="a" au="2" amount="1" start="0.4" end="1.6"/>'
        '<faceFacs id="d" au="12" amount="1" start="1.8" end="3.2"/></bml>'
    )
    played = realizer.realize(bml, face="ida", fps=12.5)
    played.save(folder / "anna" / "film.webm", size=(320, 320))
    names = ("Are", "you", "really", "sure", "about", "that?")
    words = [Annotation(0.27 * k, 0.27 * (k + 1), word, "anna") for k, word in enumerate(names)]
    rows = {
        "eva": [(0.4, 1.6, "surprise"), (1.84, 3.2, "happiness")],
        "tom": [(0.52, 1.48, "surprise"), (1.2, 1.92, "disbelief"), (1.92, 3.0, "happiness")],
    }
    labels = [Annotation(start, end, text, who) for who, spans in rows.items() for start, end, text in spans]
    meta = {"person": "anna", "fps": 25.0, "frames": 2 * played.frames}
    write_recording(folder / "anna", Recording("anna", meta, tuple(labels), tuple(words)))
    return folder


if __name__ == "__main__":
    os.environ["REALIZER_DRAW"] = "onboard"
    sheet = realizer.realize(examples()["greeting"]).save(ROOT / "realizer/examples/greeting.png")
    Image.open(sheet).save(sheet, optimize=True)
    faces(ROOT / "realizer/examples/faces.png")
    speaking(ROOT / "realizer/examples/speaking.webp")
    lights(ROOT / "docs" / "lights.jpg")
    emotions(ROOT / "docs" / "emotions.jpg")
    film(ROOT / "docs" / "film-after.jpg")
    page(ROOT / "realizer/examples/page.png")
    designer(ROOT / "docs")
    zones(ROOT / "docs")
    with TemporaryDirectory() as place:
        labels(ROOT / "docs", corpus(Path(place)))
