// How the edited head moves: fields that are computed in slices, shapes and rigid parts from the service.
import { beyond, coupled, fapuOf, keepLids, lidsOf } from "./deform.js";
import { fieldOf } from "./zones.js";

const LIDS = new Set([19, 20, 21, 22]);
export const UNIT = "unit"; // in the place of a FAP: the action unit that the tab shows
const JAW = ["lower_teeth", "tongue"];
const EYEBALLS = new Set([27, 28]); // the service moves what lies behind the lids, too

export class Motion {
  // ask(question): of the service; failed(text): why something cannot move.
  constructor(draft, ask, failed) {
    Object.assign(this, { draft, ask, failed, fields: new Map(), fap: 4, value: 0, own: false });
  }

  begin() {
    this.unit = null;
    this.shapes = new Map(); // FAP -> the head's own field
    this.lists = new WeakMap();
    this.at = this.written = this.changed = null; // numbers: of all, moved, and moved or moved back
    this.forget();
  }

  forget() {
    this.fields.clear();
    this.job = this.lids = null;
    this.pending = true;
  }

  test(fap, value) {
    Object.assign(this, { fap, value, pending: true });
  }

  // Show an action unit with an intensity: { field, lids, jaw } of the service; null: none yet.
  show(unit, value) {
    if (unit?.field !== this.unit?.field) this.lids = null;
    this.unit = unit;
    this.test(UNIT, unit ? value : 0);
  }

  // Whether a FAP has a field; jaw, tongue, eyeballs and head have none.
  has(fap) {
    return fap === UNIT || (this.draft.state.zones.has(fap) && !EYEBALLS.has(fap));
  }

  // What is shown of a FAP, in metres for each metre of its point; null until it is known.
  field(fap) {
    if (fap === UNIT) return (this.unit ??= { field: new Float64Array(this.draft.mesh.vertices.length) }).field;
    if (!this.own && this.draft.state.by.has(fap)) return this.fields.get(fap) ?? null;
    if (!this.shapes.has(fap)) {
      this.shapes.set(fap, null);
      this.ask({ type: "field", fap }).then(({ arrays }) => {
        const unit = fapuOf(this.draft.head.points)[this.draft.rows.get(fap).unit];
        this.shapes.set(fap, Float64Array.from(arrays.field, (x) => x / unit));
        this.pending = true;
      }, () => this.shapes.delete(fap));
    }
    return this.shapes.get(fap);
  }

  // Whether lids must slide over the eyeballs: what is shown moves them, or goes far beyond usual values.
  get blinks() {
    return LIDS.has(this.fap) || (this.fap === UNIT ? this.unit?.lids : this.moving.some(beyond));
  }

  get moving() {
    return coupled(this.fap, this.value, this.draft.state.points, this.draft.rows).filter(([fap, value]) => fap === this.fap || value);
  }

  // Go on with the fields for at most `budget` ms. Return the vertices, if they are all there and new.
  step(budget) {
    if (!this.pending || !this.draft.mesh) return null;
    if (!this.has(this.fap) || this.moving.some((one) => beyond(one) && (this.own || !this.draft.state.by.has(one[0])))) return this.remote();
    const wanted = [...this.moving.map(([fap]) => fap), ...(this.blinks ? LIDS : [])];
    const end = performance.now() + budget;
    for (const fap of wanted) {
      const mine = !this.own && this.draft.state.by.has(fap);
      while (mine && !this.fields.has(fap)) {
        if (performance.now() > end) return null;
        this.advance(fap);
      }
      if (!this.field(fap)) return null;
    }
    this.pending = false;
    return this.posed();
  }

  advance(fap) {
    if (this.job?.fap !== fap) this.job = { fap, work: fieldOf(fap, this.draft.acting, this.draft.mesh, this.draft.rows, this.draft.head.pairs) };
    try {
      const { done, value } = this.job.work.next();
      if (!done) return;
      this.fields.set(fap, value);
    } catch (error) {
      this.fields.set(fap, new Float64Array(this.draft.mesh.vertices.length));
      this.failed(error.message);
    }
    this.job = null;
  }

  // The vertices now; only those that a field moves, or moved before, are written.
  posed() {
    const { vertices } = this.draft.mesh;
    const at = (this.at ??= vertices.slice());
    const before = this.written ?? [];
    for (const i of before) at[i] = vertices[i];
    this.written = [];
    const units = fapuOf(this.draft.state.points);
    for (const [fap, value] of this.value ? this.moving : []) {
      const [field, far] = [this.field(fap), value * (fap === UNIT ? 1 : units[this.draft.rows.get(fap).unit])];
      const moved = this.moved(field);
      for (const i of moved) at[i] += far * field[i];
      this.written.push(moved);
    }
    this.written = this.written.length === 1 ? this.written[0] : this.written.flat();
    if (this.value && this.fap === UNIT && this.unit.jaw?.[3]) this.written = [...this.written, ...this.turnJaw(at)];
    if (this.value && this.blinks) {
      this.lids ??= lidsOf(this.draft.mesh, (fap) => this.field(fap));
      keepLids(this.lids, at);
      this.written = [...this.written, ...this.lids.map(({ i }) => 3 * i + 2)];
    }
    this.changed = [...before, ...this.written];
    return at;
  }

  // Turn what hangs at the jaw, and return the numbers that are written.
  turnJaw(at) {
    const [, y, z, angle] = this.unit.jaw;
    const [c, s] = [Math.cos(this.value * angle), Math.sin(this.value * angle)];
    const written = [];
    for (const part of JAW)
      for (let [i, last] = this.draft.mesh.parts[part] ?? [0, 0]; i < last; i++) {
        const [up, front] = [at[3 * i + 1] - y, at[3 * i + 2] - z];
        [at[3 * i + 1], at[3 * i + 2]] = [y + c * up - s * front, z + s * up + c * front];
        written.push(3 * i + 1, 3 * i + 2);
      }
    return written;
  }

  // The numbers of a field that are not zero.
  moved(field) {
    if (this.lists.has(field)) return this.lists.get(field);
    const found = [];
    for (let i = 0; i < field.length; i++) if (field[i]) found.push(i);
    this.lists.set(field, found);
    return found;
  }

  // Vertices that the service moves: one question at a time, the latest value wins.
  remote() {
    if (this.asking) return null;
    if (!this.value) {
      this.pending = false;
      return this.draft.mesh.vertices.slice();
    }
    this.asking = true;
    this.pending = false;
    const { fap, value } = this;
    this.ask({ type: "pose", values: { [fap]: value } }).then(({ arrays }) => (this.got = { fap, at: arrays.vertices }), (error) => this.failed(error.message)).finally(() => (this.asking = false));
    return null;
  }

  // Vertices that have come from the service.
  get arrived() {
    const { got } = this;
    this.got = null;
    return got?.fap === this.fap && this.value ? got.at : null;
  }
}
