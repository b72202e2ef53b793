// The lanes of labels: blocks with a begin and an end, and no curves.
import { Lanes } from "../design/lanes.js";
import { titleOf } from "../design/model.js";
import { make } from "../dom.js";

export class Rows extends Lanes {
  // Where the next label begins; null: nowhere.
  begin(time) {
    this.begun ??= this.panel.firstChild.appendChild(make("i.d-line.d-begun"));
    this.begun.hidden = time === null;
    if (time !== null) this.begun.style.setProperty("--at", time);
  }

  laneOf(channel, ...rest) {
    const row = super.laneOf(channel, ...rest);
    const name = row.element.firstChild;
    name.title = channel.own ? `Labels of ${channel.name}` : `Labels of ${channel.name}, to compare with`;
    row.element.classList.add("plain");
    row.list.querySelector(".d-empty")?.remove();
    row.element.classList.toggle("fixed", !channel.own);
    return row;
  }

  shape(block, span) {
    super.shape(block, span);
    block.lasts = `${titleOf(span.entry)}, ${span.start.toFixed(2)} to ${span.end.toFixed(2)} s`;
    return block;
  }

  // Arrow keys without others go through the frames, not from block to block.
  key(event) {
    if (/^Arrow(Left|Right)$/.test(event.key) && !event.shiftKey && !event.ctrlKey && !event.metaKey) return;
    super.key(event);
  }
}
