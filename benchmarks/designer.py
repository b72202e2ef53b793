"""Script time of the designer with 200 blocks; needs Chromium: `python -m benchmarks.designer`."""

from __future__ import annotations

import sys

BLOCKS, LANES = 200, 4
MEASURE = """async ([blocks, lanes]) => {
  const { design } = realizerPage;
  const entry = () => ({ expression: "template:surprise", duration: 1.5 });
  const entries = () => Array.from({ length: blocks / lanes }, entry);
  const channel = Array.from({ length: lanes }, (_, k) => ({ name: `${k}`, entries: entries() }));
  design.model.show({ timeline: { channel } });
  await new Promise((next) => setTimeout(next, 3000));
  const timed = (what, count) => {
    const spent = Array.from({ length: count }, (_, k) => {
      const began = performance.now();
      what(k);
      return performance.now() - began;
    });
    return spent.toSorted((a, b) => a - b)[count >> 1]; // other processes lengthen some of them
  };
  design.preview.play();
  const playing = timed(() => design.frames(), 2000);
  design.preview.pause();
  let shown = design.model.shown.channel[0].entries[20];
  const louder = (k) => (shown = design.model.change(shown, { intensity: 0.5 + (k % 50) / 100 }, false));
  design.lanes.dragging = true;
  const editing = timed(louder, 50);
  design.model.cancel();
  const block = document.querySelectorAll(".d-block")[20], box = block.getBoundingClientRect();
  design.lanes.dragging = false;
  const at = (x) => ({ bubbles: true, clientX: x, clientY: box.y + 20, button: 0 });
  const send = (target, type, x) => target.dispatchEvent(new PointerEvent(type, at(x)));
  send(block, "pointerdown", box.x + 9);
  const moving = timed((k) => send(window, "pointermove", box.x + 20 + (k % 50)), 50);
  if (design.model.shown === design.model.state.timeline) throw new Error("the drag has moved nothing");
  dispatchEvent(new KeyboardEvent("keydown", { key: "Escape" }));
  return { playing, editing, moving };
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
    print(f"a frame while it plays {found['playing']:.3f}, a change of an amount {found['editing']:.2f},")
    print(f"a step of a drag with the mouse {found['moving']:.2f}; medians")


if __name__ == "__main__":
    main()
