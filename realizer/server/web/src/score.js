// The score of the block that plays: a bar for each behaviour, a tick for each sync point, the playhead over them.

const LINGER = 1.2; // s
const ROWS = 8;

export class Score {
  constructor(panel) {
    this.panel = panel;
    this.blocks = new Map(); // id -> {start, end, tracks}
    this.shown = null;
  }

  feedback(element) {
    if (element.localName === "predictionFeedback") this.predict(element);
    if (element.localName !== "blockProgress" || !element.getAttribute("id").endsWith(":end")) return;
    const block = this.blocks.get(element.getAttribute("id").slice(0, -4));
    if (block) block.end = Math.min(block.end, Number(element.getAttribute("globalTime")));
  }

  predict(element) {
    for (const node of element.children) {
      if (node.localName !== "bml" || !node.hasAttribute("globalEnd")) continue;
      const id = node.getAttribute("id");
      const start = Number(node.getAttribute("globalStart"));
      const end = Number(node.getAttribute("globalEnd"));
      const tracks = [...element.children]
        .filter((n) => n.localName !== "bml" && n.getAttribute("id")?.startsWith(`${id}:`))
        .map((n) => ({ name: n.getAttribute("id").slice(id.length + 1), points: points(n) }))
        .filter((track) => track.points.length);
      if (tracks.length) this.blocks.set(id, { start, end, length: end - start, tracks });
    }
  }

  draw(playhead) {
    if (playhead === null) return;
    let current = null;
    for (const [id, block] of this.blocks) {
      if (block.end + LINGER < playhead) this.blocks.delete(id);
      else if (block.start <= playhead) current = block;
    }
    if (current !== this.shown) {
      this.shown = current;
      this.panel.hidden = current === null;
      if (current) this.build(current);
    }
    if (!current) return;
    const lane = this.panel.querySelector(".lane");
    const part = Math.min(1, Math.max(0, (playhead - current.start) / Math.max(0.01, current.length)));
    this.head.style.left = `${lane.offsetLeft + part * lane.offsetWidth}px`;
  }

  build(block) {
    const place = (time) => `${(100 * time) / Math.max(0.01, block.length)}%`;
    const rows = block.tracks.slice(0, ROWS).map((track) => {
      const times = track.points.map(([, time]) => time);
      const first = Math.min(...times);
      const bar = make("div", "bar");
      bar.style.left = place(first);
      bar.style.width = place(Math.max(...times) - first);
      const ticks = track.points.map(([, time]) => {
        const tick = make("div", "tick");
        tick.style.left = place(time);
        return tick;
      });
      const name = make("span");
      name.textContent = track.name;
      const lane = make("div", "lane");
      lane.append(bar, ...ticks);
      const row = make("div", "track");
      row.append(name, lane);
      return row;
    });
    this.head = make("div");
    this.head.id = "head";
    this.panel.replaceChildren(...rows, this.head);
  }
}

// [name, seconds from block start] of every attribute and <sync> that is a plain number of a sync point.
function points(node) {
  const names = /^(start|ready|strokeStart|stroke(:\d+)?|strokeEnd|attackPeak|relax|end)$/;
  const own = [...node.attributes].filter((a) => names.test(a.name)).map((a) => [a.name, Number(a.value)]);
  const inner = [...node.getElementsByTagName("*")].filter((n) => n.localName === "sync" && n.hasAttribute("ref"));
  return [...own, ...inner.map((n) => [n.id, Number(n.getAttribute("ref"))])].filter(([, time]) => Number.isFinite(time));
}

function make(tag, name = "") {
  const element = document.createElement(tag);
  element.className = name;
  return element;
}
