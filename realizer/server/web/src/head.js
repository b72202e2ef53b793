// The drawn mesh of a face, which follows the vertices of the mesh stream by the matrices in its GLB.
import { BufferAttribute, BufferGeometry } from "three";
import { Matrix } from "./sparse.js";

const CLOTH = 4; // a row of realizer/tables/surfaces.toml

const smooth = (x) => x * x * (3 - 2 * x);

export class Head {
  // `fine`: draw the smooth subdivision, not the triangles of the stream.
  constructor({ attributes, groups, extras, read }, fine) {
    const matrix = (prefix) => new Matrix(...["rows", "columns", "weights"].map((name) => read(extras[prefix + name])));
    this.places = matrix("");
    this.ups = matrix("normal_");
    const count = this.places.rows.length - 1;
    const coarse = groups.map(({ triangles }) => coarser(triangles, this.places));
    this.triangles = coarse.flatMap((mine) => [...mine].map((vertex) => this.places.single(vertex)));
    this.shares = coarse.flatMap((mine, k) => [...sharesOf(mine, attributes.POSITION.array, groups[k].kind === CLOTH)]);
    this.vertices = new Float32Array(3 * extras.vertices);
    this.normals = new Float32Array(3 * extras.vertices);
    // Hair has no triangles in the stream: it is drawn as it is.
    this.groups = groups.map((group, k) => ({ ...group, triangles: fine || !coarse[k].length ? group.triangles : coarse[k] }));
    this.wanted = Uint32Array.from(new Set(this.groups.flatMap(({ triangles }) => [...triangles])));
    if (extras.folds) this.folds = { drives: extras.folds.drives, weights: read(extras.folds.weights), amounts: new Float32Array(extras.vertices), shown: false };
    this.hairs = hairsOf(this.groups, extras.parts, attributes.TEXCOORD_0?.array);
    const [occlusion, rough] = [attributes._OCCLUSION.array, attributes._ROUGHNESS.array];
    this.attributes = {
      position: new BufferAttribute(new Float32Array(3 * count), 3),
      normal: new BufferAttribute(new Float32Array(3 * count), 3),
      strand: new BufferAttribute(new Float32Array(3 * count), 3),
      fold: new BufferAttribute(new Float32Array(count), 1),
      uv: new BufferAttribute(attributes.TEXCOORD_0?.array ?? new Float32Array(2 * count), 2),
      colour: new BufferAttribute(attributes.COLOR_0.array, 4, true),
      occlusionRough: new BufferAttribute(Float32Array.from({ length: 2 * count }, (_, i) => (i % 2 ? rough : occlusion)[i >> 1]), 2),
    };
  }

  geometry({ triangles }) {
    const geometry = new BufferGeometry();
    for (const [name, attribute] of Object.entries(this.attributes)) geometry.setAttribute(name, attribute);
    return geometry.setIndex(new BufferAttribute(Uint32Array.from(triangles), 1));
  }

  // Move what is drawn to `vertices`.
  pose() {
    const { position, normal } = this.attributes;
    this.turn();
    this.places.times(this.vertices, position.array, this.wanted);
    this.ups.times(this.normals, normal.array, this.wanted);
    position.needsUpdate = normal.needsUpdate = true;
    this.comb();
    if (this.folds) this.fold();
  }

  // Write the unit normals of the stream's vertices, as realizer/face/surface.py.
  turn() {
    const { vertices: v, normals: n, triangles, shares } = this;
    n.fill(0);
    for (let t = 0; t < triangles.length; t += 3) {
      const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
      const [px, py, pz] = [v[b] - v[a], v[b + 1] - v[a + 1], v[b + 2] - v[a + 2]];
      const [qx, qy, qz] = [v[c] - v[a], v[c + 1] - v[a + 1], v[c + 2] - v[a + 2]];
      const [x, y, z] = [py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx];
      for (let k = 0; k < 3; k++) {
        const [corner, share] = [3 * triangles[t + k], shares[t + k]];
        n[corner] += share * x;
        n[corner + 1] += share * y;
        n[corner + 2] += share * z;
      }
    }
    for (let i = 0; i < n.length; i += 3) {
      const scale = 1 / (Math.hypot(n[i], n[i + 1], n[i + 2]) || 1);
      n[i] *= scale;
      n[i + 1] *= scale;
      n[i + 2] *= scale;
    }
  }

  // Write the direction of hairs, the one in which v of the maps grows.
  comb() {
    const { position: { array: p }, strand } = this.attributes;
    const { corners, weights } = this.hairs;
    const out = strand.array.fill(0);
    for (let t = 0; t < corners.length; t += 3)
      for (let k = 0; k < 3; k++) {
        let sum = 0;
        for (let i = 0; i < 3; i++) sum += weights[t + i] * p[3 * corners[t + i] + k];
        for (let i = 0; i < 3; i++) out[3 * corners[t + i] + k] += sum;
      }
    strand.needsUpdate = true;
  }

  // How much of the folds of expressions shows: by how far skin is pushed together, as realizer/render/folds.py.
  fold() {
    const { drives, weights, amounts, shown } = this.folds;
    const v = this.vertices;
    const deep = drives.map(([a, b, rest, start, full]) => {
      const apart = Math.hypot(v[3 * a] - v[3 * b], v[3 * a + 1] - v[3 * b + 1], v[3 * a + 2] - v[3 * b + 2]);
      return smooth(Math.min(1, Math.max(0, (apart / rest - 1 - start) / (full - start))));
    });
    this.folds.shown = deep.some((amount) => amount > 0);
    if (!shown && !this.folds.shown) return;
    for (let i = 0; i < amounts.length; i++) {
      amounts[i] = 0;
      for (let k = 0; k < deep.length; k++) amounts[i] += (deep[k] * weights[i * deep.length + k]) / 255;
    }
    this.ups.timesNumbers(amounts, this.attributes.fold.array, this.wanted);
    this.attributes.fold.needsUpdate = true;
  }
}

// By how much each corner's normal follows its triangle: by the two sides at the corner, 1 mm at least; in cloth, by its size.
function sharesOf(triangles, at, cloth) {
  const side = (a, b) => Math.max(1e-6, [0, 1, 2].reduce((sum, k) => sum + (at[3 * a + k] - at[3 * b + k]) ** 2, 0));
  return Float32Array.from(triangles, (corner, i) => {
    if (cloth) return 1;
    const first = i - (i % 3);
    return 1 / (side(corner, triangles[first + ((i + 1) % 3)]) * side(corner, triangles[first + ((i + 2) % 3)]));
  });
}

// The triangles of cards, and for each corner its share in the direction in which v grows, as in face/drawn_mesh.py.
function hairsOf(groups, parts, uv) {
  const cards = Object.entries(parts).filter(([name]) => name.endsWith("_cards")).map(([, { vertices }]) => vertices);
  const first = Math.min(...cards.map(([first]) => first));
  const corners = Uint32Array.from(groups.flatMap(({ triangles, holes }) => (holes && cards.length ? [...triangles] : [])).filter((vertex) => vertex >= first));
  const weights = new Float32Array(corners.length);
  for (let t = 0; t < corners.length; t += 3) {
    const [a, b, c] = [2 * corners[t], 2 * corners[t + 1], 2 * corners[t + 2]];
    const [u, v, s, w] = [uv[b] - uv[a], uv[b + 1] - uv[a + 1], uv[c] - uv[a], uv[c + 1] - uv[a + 1]];
    const way = Math.sign(u * w - s * v);
    weights.set([(s - u) * way, -s * way, u * way], t);
  }
  return { corners, weights };
}

// The stream's triangles among those drawn, whose vertices on edges have several entries in `places`.
// Each was split in four: one at each corner, and one in the middle.
function coarser(triangles, places) {
  const own = (vertex) => places.single(vertex) >= 0;
  const key = (a, b) => a * 2 ** 26 + b;
  const corners = new Map(); // an edge of a middle triangle -> the corner beyond it
  const middles = [];
  const found = [];
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = triangles.subarray(t, t + 3);
    const count = own(a) + own(b) + own(c);
    if (count === 3) found.push(a, b, c);
    else if (count === 0) middles.push([a, b, c]);
    else for (const [x, y, z] of [[a, b, c], [b, c, a], [c, a, b]]) if (own(x)) corners.set(key(z, y), x);
  }
  for (const [a, b, c] of middles) {
    const three = [corners.get(key(c, a)), corners.get(key(a, b)), corners.get(key(b, c))];
    if (!three.includes(undefined)) found.push(...three);
  }
  return Uint32Array.from(found);
}
