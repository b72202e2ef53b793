"""The Face tab in headless Chromium: script a frame of a fine head, score of a bare GLB.

python benchmarks/face_tab.py [--face ada] [--finer 2]
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from realizer_studio.editors.face.bare_head import import_bare
from tests.bare_heads import bare_head
from tests.browser.test_page import ARGUMENTS, CHROMIUM, PATIENCE, serving

ROOM = "realizerPage.room"
LIPS = (4, 5, 6, 8, 10, 12, 51, 52, 53, 55, 57, 59)  # their other sides are kept alike
LARGER = 1.4
FRAMES = 120
# Times every frame while `act(k)` is called before each.
MEASURE = """async ([frames, act]) => {
  const room = realizerPage.room, draw = room.draw.bind(room), cost = [];
  const step = new Function("room", "k", act);
  room.draw = (now) => {
    const begin = performance.now();
    draw(now);
    cost.push([performance.now() - begin, room.spent]);
  };
  for (let k = 0; k < frames; k++) {
    step(room, k);
    await new Promise(requestAnimationFrame);
  }
  delete room.draw;
  return cost;
}"""
ACTS = {
    "test slider, lip": "room.faps.try(150 * Math.sin(k / 6))",
    "turning the head": "room.view.move({ yaw: 0.02 })",
    "size of a zone": "room.draft.set(4, { size: 0.02 + 0.0001 * (k % 50) }, 'Zone 4 size:')",
    "brush": "room.faps.tool = 'brush'; room.stroke(k % 40 ? 'move' : 'start', 340 + (k % 40), 430)",
}


def opened(browser: Any, address: str) -> Any:
    page = browser.new_page(viewport={"width": 1280, "height": 860}, bypass_csp=True)
    page.set_default_timeout(PATIENCE)
    page.goto(f"{address}#face")
    page.wait_for_function(f"{ROOM}.points.says && !{ROOM}.loading")
    return page


def frames(page: Any) -> None:
    """Print the time of script in frames."""
    page.select_option('#face [aria-label="Face to edit"]', "fine")
    page.wait_for_function(f"{ROOM}.draft.head?.name === 'fine' && !{ROOM}.loading")
    page.click('#face [aria-label="What is edited"] >> text="Zones"')
    vertices = page.evaluate(f"{ROOM}.draft.mesh.count")
    print(f"{vertices} vertices, ms of script a frame (with the calls of WebGL)")
    print(f"{'':22}{'median':>16}{'95 %':>16}{'most':>16}")
    page.evaluate(f"{ROOM}.faps.choose(4)")
    page.wait_for_function(f"!{ROOM}.motion.pending")
    for name, act in ACTS.items():
        cost = page.evaluate(MEASURE, [FRAMES, act])
        columns = []
        for share in (0.5, 0.95, 1):
            whole, own = (
                sorted(row[k] for row in cost)[min(len(cost) - 1, int(share * len(cost)))] for k in (0, 1)
            )
            columns.append(f"{own:8.1f} ({whole:.1f})".rjust(16))
        print(f"{name:22}{''.join(columns)}")
    page.close()


def placed(page: Any, head: Path) -> None:
    """Make a face of a bare head by gestures, and print its score."""
    page.set_input_files('#face input[type="file"]', head)
    page.wait_for_function(f"{ROOM}.draft.head?.name === '{head.stem}' && !{ROOM}.loading")

    def score() -> str:
        page.click('#face [aria-label="What is edited"] >> text="Score"')
        page.evaluate(f"{ROOM}.mean.textContent = ''")
        page.click("text=Score all 127")
        page.wait_for_function(f"{ROOM}.mean.textContent")
        return str(page.evaluate(f"{ROOM}.mean.textContent"))

    begin = time.perf_counter()
    print(f"a bare GLB as it was opened: {score()}")
    page.click('#face [aria-label="What is edited"] >> text="Points"')
    asked = 0
    while page.is_visible("text=It is right"):
        page.click("text=It is right")
        asked += 1
    page.click('#face [aria-label="What is edited"] >> text="Zones"')
    for fap in LIPS:
        page.select_option('#face [aria-label="FAP"]', str(fap))
        field = page.locator('[aria-label="size, mm, value"]')
        field.fill(f"{LARGER * float(field.input_value()):.2f}")
        field.press("Enter")
    print(f"{asked} points accepted, {len(LIPS)} pairs of zones changed: {score()}")
    print(f"in {time.perf_counter() - begin:.0f} s of a script")
    page.close()


def main() -> None:
    from playwright.sync_api import sync_playwright

    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--face", default="ada")
    options.add_argument("--finer", type=int, default=2, help="how often the skin's triangles are split")
    chosen = options.parse_args()
    command = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent", "--no-idle"]
    with TemporaryDirectory() as name:
        place = Path(name)
        fine = bare_head(place / "fine.glb", chosen.face, finer=chosen.finer)
        import_bare(fine, place / "faces" / "fine", "fine")
        os.environ["REALIZER_FACES"] = str(place / "faces")
        with serving(command) as address, sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
            frames(opened(browser, address))
            placed(opened(browser, address), bare_head(place / "bare.glb", chosen.face))
            browser.close()


if __name__ == "__main__":
    main()
