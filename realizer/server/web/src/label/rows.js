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

  laneOf(channel, lane) {
    const row = super.laneOf(channel, lane);
    const name = row.firstChild;
    name.title = channel.own ? `Labels of ${channel.name}` : `Labels of ${channel.name}, to compare with`;
    row.classList.toggle("fixed", !channel.own);
    return row;
  }

  blockOf(span) {
    const block = super.blockOf(span);
    for (const handle of block.querySelectorAll(".d-onset, .d-offset, .d-amount")) handle.remove();
    block.firstChild.remove();
    block.dataset.lasts = `${titleOf(span.entry)}, ${span.start.toFixed(2)} to ${span.end.toFixed(2)} s`;
    return block;
  }

  // Arrow keys without others go through the frames, not from block to block.
  key(event) {
    if (/^Arrow(Left|Right)$/.test(event.key) && !event.shiftKey && !event.ctrlKey && !event.metaKey) return;
    super.key(event);
  }
}
