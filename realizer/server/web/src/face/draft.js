// The feature points, zones, masks and markers of action units that are edited: every change can be undone, and a draft stays in the browser.

const SAVED = 400; // ms after a change a draft is kept
const FAR = 0.03; // distances of the eyes; two points of the template that mirror each other lie so near

const rounded = (x) => (typeof x === "number" ? Number(x.toPrecision(7)) : Array.isArray(x) ? x.map(rounded) : x); // as the file has it
const placed = (place) => place.map((x) => Math.round(x * 1e6) / 1e6);

export class Draft extends EventTarget {
  constructor() {
    super();
    this.together = true; // points of both sides
  }

  // Begin with what the service has sent.
  begin(head, mesh) {
    Object.assign(this, { head, mesh, key: `face ${head.name} ${mesh.count}` });
    this.rows = new Map(head.faps.map((row) => [row.fap, row]));
    this.other = twins(head.template);
    this.past = [];
    this.future = [];
    const { by, guesses } = head;
    this.state = this.stateOf({ ...head.setup, by, asked: guesses });
    this.emit();
  }

  get kept() {
    try {
      return JSON.parse(localStorage.getItem(this.key));
    } catch {
      return null;
    }
  }

  // Go on with the draft that this browser has kept.
  resume() {
    const kept = this.kept;
    if (kept) this.change("Resume", () => this.stateOf(kept));
  }

  stateOf({ points, zone, masks, synced, joined, whole, by, asked = [], units = {} }) {
    return {
      points, units,
      zones: new Map(zone.map((one) => [one.fap, Object.fromEntries(Object.entries(one).map(([name, x]) => [name, rounded(x)]))])),
      masks: new Map(Object.entries(masks).flatMap(([faps, ranges]) => faps.split(" ").map((fap) => [Number(fap), expanded(ranges, this.mesh.count)]))),
      synced: new Set(synced), by: new Set(by), asked, joined, whole,
    };
  }

  // The state as the table of the service; `all`: with zones that move nothing yet.
  table(all = false) {
    const { points, zones, masks, synced, by, asked, joined, whole, units } = this.state;
    const used = (fap) => all || by.has(fap);
    const table = {
      points, joined, whole,
      synced: [...synced].filter(used),
      zone: [...zones.values()].filter(({ fap }) => used(fap)),
      masks: Object.fromEntries([...masks].filter(([fap]) => used(fap)).map(([fap, mask]) => [fap, ranges(mask)])),
    };
    return all ? { ...table, by: [...by], asked, units } : table;
  }

  // The zones that move the face, as fieldOf takes them.
  get acting() {
    const { by, zones } = this.state;
    if (this.actingOf !== this.state) this.actingZones = { ...this.state, zones: new Map([...zones].filter(([fap]) => by.has(fap))) };
    this.actingOf = this.state;
    return this.actingZones;
  }

  // Replace the state by make(state). Changes with the same word that follow each other are undone together.
  change(word, make) {
    if (word !== this.word || !word.includes(":")) this.past.push(this.state);
    this.word = word;
    this.future = [];
    this.state = make(this.state);
    this.emit();
  }

  // The end of a drag: the next change is another one.
  rest() {
    this.word = null;
  }

  undo() {
    this.step(this.past, this.future);
  }

  redo() {
    this.step(this.future, this.past);
  }

  step(from, to) {
    if (!from.length) return;
    to.push(this.state);
    this.state = from.pop();
    this.rest();
    this.emit();
  }

  emit() {
    this.dispatchEvent(new Event("change"));
    clearTimeout(this.timer);
    if (this.past.length || this.future.length) this.timer = setTimeout(() => this.keep(), SAVED);
  }

  keep() {
    clearTimeout(this.timer);
    try {
      localStorage.setItem(this.key, JSON.stringify(this.table(true)));
      this.dispatchEvent(new Event("kept"));
    } catch (error) {
      this.dispatchEvent(Object.assign(new Event("fault"), { text: `This browser keeps no draft: ${error.message}` }));
    }
  }

  forget() {
    clearTimeout(this.timer);
    localStorage.removeItem(this.key);
  }

  // Put a point somewhere, and its mirror image on the other side if they move together.
  place(name, at, word = `Place ${name}`) {
    this.change(word, (state) => {
      const points = { ...state.points, [name]: placed(at) };
      const asked = state.asked.filter((one) => one !== name);
      const other = this.other.get(name);
      if (!this.together) return { ...state, points, asked };
      if (other === name) points[name] = [0, points[name][1], points[name][2]];
      else if (other) points[other] = placed([-at[0], at[1], at[2]]);
      return { ...state, points, asked: asked.filter((one) => one !== other) };
    });
  }

  // Take the place of the other side's point.
  copyPoint(name) {
    const [x, y, z] = this.state.points[this.other.get(name)];
    this.change(`Copy ${name}`, (state) => ({ ...state, points: { ...state.points, [name]: placed([-x, y, z]) }, asked: state.asked.filter((one) => one !== name) }));
  }

  // Ask for points again, or no more.
  ask(names) {
    this.change("Ask", (state) => ({ ...state, asked: names }));
  }

  // Change values of a FAP's zone: from now on it moves the face by it.
  set(fap, values, word = `Zone ${fap}`) {
    this.change(word, (state) => {
      const zones = new Map(state.zones).set(fap, { ...state.zones.get(fap), ...Object.fromEntries(Object.entries(values).map(([name, x]) => [name, rounded(x)])) });
      return this.synchronised({ ...state, zones, by: new Set(state.by).add(fap) }, fap);
    });
  }

  // Change the mask of a FAP: 1 for vertices that it may move.
  mask(fap, mask, word = `Mask ${fap}`) {
    this.change(word, (state) => {
      const zones = new Map(state.zones).set(fap, { ...state.zones.get(fap), use_mask: true });
      return this.synchronised({ ...state, zones, masks: new Map(state.masks).set(fap, mask), by: new Set(state.by).add(fap) }, fap);
    });
  }

  sync(fap, on) {
    const pair = [fap, this.rows.get(fap).mirror];
    this.change(`Sync ${fap}`, (state) => {
      const synced = new Set([...state.synced].filter((one) => !pair.includes(one)));
      return on ? this.synchronised({ ...state, synced: new Set([...synced, ...pair]) }, fap) : { ...state, synced };
    });
  }

  // Take zone and mask from the other side.
  copy(fap) {
    this.change(`Copy ${fap}`, (state) => this.mirrored(state, this.rows.get(fap).mirror, fap));
  }

  // Move all FAPs by zones, or none but those of `faps`.
  moveBy(faps) {
    this.change("Zones", (state) => ({ ...state, by: new Set(faps) }));
  }

  synchronised(state, fap) {
    const { mirror } = this.rows.get(fap);
    return mirror !== fap && state.synced.has(fap) ? this.mirrored(state, fap, mirror) : state;
  }

  // The state with the zone of one side on the other side.
  mirrored(state, from, to) {
    const zone = state.zones.get(from);
    const zones = new Map(state.zones).set(to, { ...zone, fap: to, pivot: [zone.pivot[0] ? -zone.pivot[0] : 0, zone.pivot[1], zone.pivot[2]] });
    const [masks, synced, by] = [new Map(state.masks), new Set(state.synced), new Set(state.by)];
    by.add(to);
    if (masks.has(from)) {
      const { mask, lost } = this.mesh.mirrored(masks.get(from));
      if (lost) {
        for (const fap of [from, to]) synced.delete(fap);
        this.dispatchEvent(Object.assign(new Event("fault"), { text: `${lost} vertices of the mask have no mirror image within 0.5 mm: the two sides of FAP ${from} are no longer kept alike.` }));
      }
      masks.set(to, mask);
    }
    return { ...state, zones, masks, synced, by };
  }
}

// Which point of the template is the mirror image of which.
function twins(template) {
  const names = Object.entries(template);
  return new Map(names.map(([name, [x, y, z]]) => [name, names.find(([, at]) => Math.hypot(at[0] + x, at[1] - y, at[2] - z) < FAR)?.[0]]));
}

// The mask of ranges such as "3-5 9", and back.
export function expanded(text, count) {
  const mask = new Uint8Array(count);
  for (const word of text.split(" ").filter(Boolean)) {
    const [first, last = first] = word.split("-").map(Number);
    mask.fill(1, first, last + 1);
  }
  return mask;
}

function ranges(mask) {
  const runs = [];
  for (let i = 0; i < mask.length; i++) {
    if (!mask[i]) continue;
    const first = i;
    while (mask[i + 1]) i++;
    runs.push(first === i ? `${i}` : `${first}-${i}`);
  }
  return runs.join(" ");
}
