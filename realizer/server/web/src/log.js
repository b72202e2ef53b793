// The feedback log: one line per message, the newest at the bottom; filtered lines are hidden.
import { make } from "./dom.js";
import { BMLA } from "bml-realizer-client";

const MOST = 600; // lines

export class Log {
  constructor(list, filter, kinds) {
    this.list = list;
    this.last = 0;
    this.now = null; // the time of the last event: predictions are of the future
    this.filter = filter;
    filter.oninput = () => this.sift();
    for (const box of kinds) box.onchange = () => this.list.classList.toggle(`no-${box.value}`, !box.checked);
  }

  feedback(element, seq) {
    if (seq && seq <= this.last) return;
    this.last = seq || this.last;
    const id = element.getAttribute("id");
    const time = element.getAttribute("globalTime");
    if (time !== null) this.now = time;
    switch (element.localName) {
      case "blockProgress": {
        const [, block, what] = id.match(/^(.*):(start|end)$/);
        return this.line("block", time, `${block} ${what === "start" ? "starts" : "ends"}`, element);
      }
      case "syncPointProgress":
        return this.line("point", time, id.split(":").slice(1).join(" "), element);
      case "warningFeedback":
        return this.line("warning", null, `${id}: ${element.textContent}`, element);
      case "predictionFeedback":
        for (const block of element.children) {
          if (block.localName !== "bml" || block.getAttributeNS(BMLA, "status") === "IN_PREP") continue;
          // The end of a block that lasts as long as an open speech is not known.
          const [start, end] = ["globalStart", "globalEnd"].map((name) => block.hasAttribute(name) ? Number(block.getAttribute(name)).toFixed(2) : "?");
          this.line("plan", this.now, `${block.getAttribute("id")} is planned, ${start} to ${end} s`, element);
        }
    }
  }

  error(message) {
    this.line("error", null, message);
  }

  clear() {
    this.list.replaceChildren();
  }

  line(kind, time, text, element) {
    const stays = this.list.scrollTop + this.list.clientHeight < this.list.scrollHeight - 20;
    const item = make(`li.${kind}`, {}, make("time", {}, time === null ? "" : Number(time).toFixed(2)), make("span", {}, text));
    if (element) item.title = element.outerHTML;
    this.sift([item]);
    this.list.append(item);
    while (this.list.childElementCount > MOST) this.list.firstElementChild.remove();
    if (!stays) this.list.scrollTop = this.list.scrollHeight;
  }

  sift(items = this.list.children) {
    const words = this.filter.value.trim().toLowerCase();
    for (const item of items) item.hidden = !`${item.className} ${item.textContent}`.toLowerCase().includes(words);
    this.list.classList.toggle("none", words !== "" && [...this.list.children, ...items].every((item) => item.hidden));
  }
}
