"""Script time of the designer with 200 blocks; needs Chromium: `python -m tests.benchmarks.designer`."""

from __future__ import annotations

import sys

BLOCKS, LANES = 200, 4
MEASURE = """async ([blocks, lanes]) => {
  const { design } = realizerPage;
  const block = () => ({ expression: "template:surprise", duration: 1.5 });
  const entries = () => Array.from({ length: blocks / lanes }, block);
  const channel = Array.from({ length: lanes }, (_, k) => ({ name: `${k}`, entries: entries() }));
  design.model.show({ timeline: { channel } });
  await new Promise((next) => setTimeout(next, 3000));
  const timed = (what, count) => {
    const began = performance.now();
    for (let k = 0; k < count; k++) what(k);
    return (performance.now() - began) / count;
  };
  design.preview.play();
  const playing = timed(() => design.frames(), 2000);
  design.preview.pause();
  let entry = design.model.shown.channel[0].entries[20];
  const louder = (k) => (entry = design.model.change(entry, { intensity: 0.5 + (k % 50) / 100 }, false));
  design.lanes.dragging = true;
  const editing = timed(louder, 50);
  design.lanes.dragging = false;
  design.model.cancel();
  return { playing, editing };
}"""


def main() -> None:
    from playwright.sync_api import sync_playwright

    from tests.browser.test_page import ARGUMENTS, CHROMIUM, PATIENCE, serving

    command = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--no-idle", "--voice", "silent"]
    with serving(command) as address, sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS).new_page(
            bypass_csp=True
        )
        opened.set_default_timeout(PATIENCE)
        opened.goto(f"{address}#design")
        opened.wait_for_selector(".d-card")
        found = opened.evaluate(MEASURE, [BLOCKS, LANES])
    print(f"{BLOCKS} blocks in {LANES} channels, ms of script (wanted at most 4):")
    print(f"a frame while it plays {found['playing']:.3f}, a step of a drag {found['editing']:.2f}")


if __name__ == "__main__":
    main()
