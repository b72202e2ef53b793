// The vertices of a head under one FAP, by the formulas of realizer/face (deform.py, basis.py).

const OUTER = { 4: 51, 5: 52, 6: 53, 7: 54, 8: 55, 9: 56, 10: 57, 11: 58, 12: 59, 13: 60 };
// Two FAPs of neighbouring points, and FAPU by which the first may go above and below the second; the other side is alike.
const NEIGHBOURS = [
  [31, 33, 180, 250], [31, 32, 250, 250], [33, 31, 180, 250], [33, 35, 100, 250], [35, 33, 160, 160], [37, 38, 260, 260],
  [4, 8, 230, 250], [8, 4, 285, 200], [8, 12, Infinity, 400], [5, 10, 200, 265], [10, 5, 275, 200], [10, 12, 310, Infinity],
  [51, 55, 190, 260], [55, 51, 320, 235], [55, 59, Infinity, 450], [52, 57, 370, 265], [57, 52, 345, 260], [57, 59, 400, Infinity],
];
// FAPU beyond which a head's own shape takes more skin along, which the service computes.
const LIMITS = { 6: 185, 7: 185, 53: 185, 54: 185, 15: 150, 37: 130, 38: 130, 39: 80, 40: 80, 41: 305, 42: 305, 61: 80, 62: 80, 63: 110, 18: 195 };
const PARTNER = new Map(Object.entries(OUTER).flatMap(([inner, outer]) => [[Number(inner), outer], [outer, Number(inner)]]));
const ELASTICITY = 0.65; // most change of the distance between the lips' contours, of that distance
const MIN_CHANGE = 0.05; // of the mouth's width
const OVER_BALL = 0.0022; // m; lids lie at most that far from the ball

// Metres of one unit, by the feature points; single precision, as the service has them.
export function fapuOf(points) {
  const apart = (axis, high, low) => Math.fround(Math.fround(points[high][axis]) - Math.fround(points[low][axis]));
  const units = { MNS: apart(1, "9.15", "2.2"), MW: apart(0, "8.3", "8.4"), ENS: apart(1, "3.5", "9.15"), ES: apart(0, "3.5", "3.6"), IRISD: (apart(1, "3.1", "3.3") + apart(1, "3.2", "3.4")) / 2 };
  return Object.fromEntries(Object.entries(units).map(([unit, metres]) => [unit, metres / 1024]));
}

export const beyond = ([fap, value]) => Math.abs(value) > LIMITS[fap];

const shrunk = (value, by) => Math.sign(value) * Math.max(0, Math.abs(value) - by);

// The values that move when one FAP has a value: points and contours of the lips follow those that go too far.
export function coupled(fap, value, points, rows) {
  const way = (n) => (n === 38 || rows.get(n)?.way[1] < 0 ? -1 : 1);
  const side = (pair, of) => (of ? pair : [...pair.slice(0, 2).map((n) => rows.get(n).mirror), ...pair.slice(2)]);
  const found = new Map([[fap, 0]]);
  for (const [one, off] of found)
    for (const pair of NEIGHBOURS)
      for (const [leader, other, above, below] of [side(pair, true), side(pair, false)])
        if (leader === one && !found.has(other)) found.set(other, off + (value * way(fap) > 0 ? above : below));
  return [...found].flatMap(([one, off]) => contours(one, shrunk(value, off) * way(fap) * way(one), points, rows));
}

function contours(fap, value, points, rows) {
  const other = PARTNER.get(fap);
  if (!other) return [[fap, value]];
  const row = rows.get(Math.min(fap, other));
  const axis = row.way.findIndex(Boolean);
  const apart = Math.abs(points[row.point][axis] - points[rows.get(Math.max(fap, other)).point][axis]);
  const units = fapuOf(points);
  const most = Math.max(ELASTICITY * apart, MIN_CHANGE * units.MW * 1024) / units[row.unit];
  return [[fap, value], [other, shrunk(value, most)]];
}

// Vertices of lids that slide over an eyeball, which one, and their least distance from its middle.
export function lidsOf(mesh, field) {
  const found = [];
  const v = mesh.vertices;
  mesh.eyes.forEach((eye, side) => {
    const [upper, lower] = [field(19 + side), field(21 + side)];
    for (const [first, last] of mesh.lidded)
      for (let i = first; i < last; i++) {
        if (Math.abs(upper?.[3 * i + 1] ?? 0) + Math.abs(lower?.[3 * i + 1] ?? 0) <= 0.02) continue;
        const away = [0, 1, 2].map((k) => v[3 * i + k] - eye.centre[k]);
        const far = Math.hypot(...away);
        if (far <= eye.size + 0.0001 || away[2] <= 0.002) continue;
        found.push({ i, eye, least: Math.min(far, eye.size + OVER_BALL) - bulge(eye, away) });
      }
  });
  return found;
}

// How far an eye that looks ahead comes out of its ball before a place.
function bulge({ ball, angles, heights }, [x, y]) {
  const angle = Math.acos(Math.min(1, Math.max(-1, Math.sqrt(Math.max(ball * ball - x * x - y * y, 0)) / ball)));
  const last = angles.length - 1;
  if (angle <= angles[0]) return heights[0];
  if (angle >= angles[last]) return heights[last];
  let low = 0;
  for (let high = last; high - low > 1; ) {
    const middle = (low + high) >> 1;
    if (angles[middle] <= angle) low = middle;
    else high = middle;
  }
  const step = angles[low + 1] - angles[low];
  return heights[low] + (step > 0 ? ((angle - angles[low]) / step) * (heights[low + 1] - heights[low]) : 0);
}

// Move lids forwards until they are as far from the ball as at rest.
export function keepLids(lids, out) {
  for (const { i, eye, least } of lids) {
    const away = [0, 1, 2].map((k) => out[3 * i + k] - eye.centre[k]);
    const room = (least + bulge(eye, away)) ** 2 - away[0] ** 2 - away[1] ** 2;
    if (room > 0) out[3 * i + 2] += Math.max(Math.sqrt(room) - away[2], 0);
  }
}
