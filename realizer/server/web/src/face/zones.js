// The field of a FAP by zones of influence, by the formulas of realizer_studio/faces/mpeg4 (zones.py, fields.py, build.py).

const SAMPLES = 2001; // of a smooth curve
const MIN_POWER = 1e-3;
const NEAREST = 1e-9; // in radii
const POWER = 1.2; // of the distance
const LEAST = 2e-3; // of the point's move: smaller moves are not stored
const PUPILS = new Set(["3.5", "3.6"]);
// Vertices between two looks at the clock: near a zone, and far from it.
const SLICE = 256;
const FAR_SLICE = 16384;
const curves = new Map();

export const FALLOFFS = ["ease", "smooth", "cosine", "linear"];

// The influence at a distance in radii: 1 at the centre, 0 at the edge.
export function influence(zone, distance) {
  if (zone.falloff === "smooth") return smooth(distance, zone.smooth_centre, zone.smooth_side);
  const away = Math.min(1, Math.max(0, distance));
  if (zone.falloff === "cosine") return (1 + Math.cos(Math.PI * away)) / 2;
  if (zone.falloff !== "ease") return 1 - away;
  const power = 1 + zone.ease / (zone.ease <= 0 ? 100 : 20);
  return 1 - away ** Math.max(power, MIN_POWER);
}

// The height of a cubic Bezier curve with the control points (0, 1), (centre, 1), (1, 0), (1 + side, 0).
function smooth(distance, centre, side) {
  const key = `${centre} ${side}`;
  if (!curves.has(key)) curves.set(key, curve(centre, side));
  const { x, height } = curves.get(key);
  const d = Math.max(distance, 0);
  if (d >= x[SAMPLES - 1]) return d > x[SAMPLES - 1] ? 0 : height[SAMPLES - 1];
  let [low, high] = [0, SAMPLES - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (x[middle] <= d) low = middle;
    else high = middle;
  }
  const step = x[low + 1] - x[low];
  return step > 0 ? height[low] + ((height[low + 1] - height[low]) / step) * (d - x[low]) : height[low];
}

function curve(centre, side) {
  const [x, height] = [new Float64Array(SAMPLES), new Float64Array(SAMPLES)];
  for (let i = 0; i < SAMPLES; i++) {
    const t = i / (SAMPLES - 1);
    const [second, third, fourth] = [3 * t * (1 - t) ** 2, 3 * t ** 2 * (1 - t), t ** 3];
    x[i] = second * centre + third + fourth * (1 + side);
    height[i] = (1 - t) ** 3 + second;
  }
  return { x, height };
}

const radii = (zone) => zone.scale.map((factor) => zone.size * factor);
const reach = (zone) => (zone.falloff === "smooth" ? 1 + zone.smooth_side : 1);

// The zones that share their influence with a FAP's, itself included.
export function group(fap, zones, pairs) {
  const found = new Set([fap]);
  for (let before = 0; before < found.size; ) {
    before = found.size;
    for (const [one, other] of pairs) if (zones.has(one) && zones.has(other) && (found.has(one) || found.has(other))) found.add(one).add(other);
  }
  return [...found].sort((a, b) => a - b);
}

// Compute the field of a FAP in metres for each metre of its point, 3 numbers a vertex. It is a generator, which
// stops for a moment after every slice of vertices, so that a page can go on drawing.
// setup: { points, zones: Map, masks: Map of Uint8Array, joined }; mesh: of mesh.js; rows: FAP -> its row of the table.
export function* fieldOf(fap, setup, mesh, rows, pairs) {
  const [weight, active] = yield* weightOf(fap, setup, mesh, rows, pairs);
  const zone = setup.zones.get(fap);
  const row = rows.get(fap);
  const middle = setup.points[row.point];
  const field = new Float64Array(mesh.vertices.length);
  const v = mesh.vertices;
  const way = row.way.map((x, k) => x + (k === 2 ? zone.slide : 0));
  const arm = Math.max(Math.hypot(...middle.map((x, k) => x - zone.pivot[k])), 1e-9);
  const nearest = mesh.nearest(middle);
  const moveOf = (i, k) => (zone.radial ? (1 - zone.radial) * way[k] + (zone.radial * (v[3 * i + k] - zone.pivot[k])) / arm : way[k]) * weight[i];
  const here = row.way.reduce((sum, x, k) => sum + x * moveOf(nearest, k), 0);
  if (here < 1e-3) throw new Error(`FAP ${fap} does not move the skin at its feature point ${row.point}: make its zone larger, or take the point's place into its mask`);
  for (let n = 0; n < active.length; n++) {
    if (n % SLICE === 0) yield;
    for (let k = 0; k < 3; k++) field[3 * active[n] + k] = moveOf(active[n], k) / here;
  }
  const [out, touched] = yield* soften(field, active, setup, mesh, rows);
  grow(out, mesh);
  stored(out, touched);
  stored(out, mesh.grown);
  return out;
}

// The influence of a FAP's zone at each vertex, and the vertices where there is some.
function* weightOf(fap, setup, mesh, rows, pairs) {
  const zone = setup.zones.get(fap);
  const members = setup.joined ? group(fap, setup.zones, pairs) : [fap];
  const links = pairs.filter(([one, other]) => members.includes(one) && members.includes(other) && setup.zones.has(one) && setup.zones.has(other));
  const each = members.map((number) => {
    const zone = setup.zones.get(number);
    return { number, zone, size: radii(zone), at: setup.points[rows.get(number).point], open: openOf(zone, setup.masks.get(number)) };
  });
  const own = each[members.indexOf(fap)];
  const ends = links.map(([one, other]) => [each[members.indexOf(one)], each[members.indexOf(other)]]);
  const [weight, active] = [new Float64Array(mesh.count), []];
  const box = boxOf(each);
  const [v, alone] = [mesh.vertices, members.length === 1];
  for (let i = mesh.skin[0], seen = 0; i < mesh.skin[1]; i++) {
    if (i % FAR_SLICE === 0) yield;
    const [x, y, z] = [v[3 * i], v[3 * i + 1], v[3 * i + 2]];
    if (x < box[0] || y < box[1] || z < box[2] || x > box[3] || y > box[4] || z > box[5]) continue;
    if (++seen % SLICE === 0) yield;
    if (alone) {
      weight[i] = influence(zone, far(x, y, z, own.at, own.size)) * own.open(i);
      if (weight[i]) active.push(i);
      continue;
    }
    if (!own.open(i) || far(x, y, z, own.at, own.size) >= 2) continue;
    let [envelope, whole, mine] = [0, 0, 0];
    for (let k = 0; k < each.length; k++) {
      const { zone, at, size, open, number } = each[k];
      const d = far(x, y, z, at, size);
      const free = open(i);
      if (free) envelope = Math.max(envelope, influence(zone, d));
      const say = free * Math.max(2 - d, 0) ** 2 / Math.max(d, NEAREST) ** POWER;
      whole += say;
      if (number === fap) mine = say;
    }
    if (!mine) continue;
    for (const [one, other] of ends) if (one.open(i) && other.open(i)) envelope = Math.max(envelope, between(one, other, x, y, z));
    weight[i] = (envelope * mine) / Math.max(whole, 1e-30);
    if (weight[i]) active.push(i);
  }
  return [weight, active];
}

function far(x, y, z, at, size) {
  const [a, b, c] = [(x - at[0]) / size[0], (y - at[1]) / size[1], (z - at[2]) / size[2]];
  return Math.sqrt(a * a + b * b + c * c);
}

function openOf(zone, mask) {
  if (!zone.use_mask) return () => 1;
  if (!mask) throw new Error(`FAP ${zone.fap} uses a mask and has none: paint one, or do not use it`);
  return zone.invert_mask ? (i) => 1 - mask[i] : (i) => mask[i];
}

// The influence around the line between two neighbours' points, with interpolated radii.
function between(one, other, x, y, z) {
  const [a, b] = [one.at, other.at];
  const along = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
  const length = Math.max(along[0] ** 2 + along[1] ** 2 + along[2] ** 2, 1e-18);
  const t = Math.min(1, Math.max(0, ((x - a[0]) * along[0] + (y - a[1]) * along[1] + (z - a[2]) * along[2]) / length));
  const at = a.map((from, k) => from + t * along[k]);
  const d = far(x, y, z, at, one.size.map((size, k) => size + t * (other.size[k] - size)));
  return (1 - t) * influence(one.zone, d) + t * influence(other.zone, d);
}

// The box that holds all zones of a group: beyond it nothing moves.
function boxOf(each) {
  const most = Math.max(...each.map(({ zone }) => reach(zone)));
  const ends = (sign) => [0, 1, 2].map((k) => each.reduce((end, { at, size }) => sign * Math.max(sign * end, sign * at[k] + most * Math.max(...each.map((one) => one.size[k]), size[k])), -sign * Infinity));
  return [...ends(-1), ...ends(1)];
}

// Half of a vertex's own move and half of its neighbours' mean; feature points keep theirs. Also which may move.
function* soften(field, active, setup, mesh, rows) {
  const out = field.slice();
  const { starts, neighbours } = mesh.ring;
  const fixed = new Set();
  for (const fap of setup.zones.keys()) {
    const { point } = rows.get(fap);
    if (PUPILS.has(point)) continue;
    fixed.add(mesh.nearest(setup.points[point]));
    yield;
  }
  const [seen, touched] = [new Uint8Array(mesh.count), []];
  const touch = (i) => {
    if (!seen[i]) touched.push(i);
    seen[i] = 1;
  };
  for (const i of active) {
    touch(i);
    for (let j = starts[i]; j < starts[i + 1]; j++) touch(neighbours[j]);
  }
  yield;
  for (let n = 0; n < touched.length; n++) {
    const i = touched[n];
    const [from, to] = [starts[i], starts[i + 1]];
    if (n % SLICE === 0) yield;
    if (fixed.has(i)) continue;
    for (let k = 0; k < 3; k++) {
      let sum = 0;
      for (let j = from; j < to; j++) sum += field[3 * neighbours[j] + k];
      out[3 * i + k] = 0.5 * field[3 * i + k] + (0.5 * sum) / Math.max(to - from, 1);
    }
  }
  return [out, touched];
}

// Brows, lashes and beard follow the skin under them.
function grow(field, { grown, near, share }) {
  for (let g = 0; g < grown.length; g++)
    for (let k = 0; k < 3; k++) {
      let sum = 0;
      for (let j = 3 * g; j < 3 * g + 3; j++) sum += share[j] * field[3 * near[j] + k];
      field[3 * grown[g] + k] = sum;
    }
}

// What a face folder keeps of a field: half precision, without moves that nobody sees.
function stored(field, vertices) {
  for (const vertex of vertices) {
    const i = 3 * vertex;
    const most = Math.max(Math.abs(field[i]), Math.abs(field[i + 1]), Math.abs(field[i + 2]));
    for (let k = i; k < i + 3; k++) field[k] = most > LEAST ? half(field[k]) : 0;
  }
}

function half(x) {
  const size = Math.abs(x);
  let power = Math.floor(Math.log2(size || 1));
  if (2 ** (power + 1) <= size) power++;
  const step = 2 ** (Math.max(power, -14) - 10);
  const [steps, whole] = [size / step, Math.floor(size / step)];
  const up = steps - whole > 0.5 || (steps - whole === 0.5 && whole % 2 === 1);
  return Math.sign(x) * (whole + (up ? 1 : 0)) * step;
}
