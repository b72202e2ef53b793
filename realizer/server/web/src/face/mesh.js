// The neutral mesh of a head: neighbours, mirror images, rays, and normals that follow a few moving vertices.

const MARGIN = 5e-4; // m between a vertex and the mirror image of its twin, as zones.py
const HOME = 1e-7; // m

export class HeadMesh {
  // header, arrays: of the service's answer to "open".
  constructor({ parts, eyes }, { vertices, triangles, grown, near, share }) {
    Object.assign(this, { parts, eyes, triangles, grown, near, share });
    this.vertices = Float64Array.from(vertices);
    this.count = vertices.length / 3;
    this.skin = parts.skin;
    this.lidded = ["skin", "lashes", "tears"].filter((name) => name in parts).map((name) => parts[name]);
    this.posed = Float32Array.from(vertices); // what is drawn
    this.crosses = new Float64Array(triangles.length); // of each triangle, twice its area long
    this.sums = new Float64Array(vertices.length);
    this.normals = new Float32Array(vertices.length);
    this.ring = this.ringOf();
    this.touching = this.touchingOf();
    this.found = new Map();
    this.turned = []; // triangles whose normals are not those of the neutral face
    for (let t = 0; t < triangles.length; t += 3) this.turn(t);
    for (let i = 0; i < this.count; i++) this.settle(i);
    this.rest = this.normals.slice();
  }

  // The neighbours of vertices of the skin: those of i are neighbours[starts[i]] to neighbours[starts[i + 1] - 1].
  ringOf() {
    const [first, last] = this.skin;
    const pairs = [];
    for (let t = 0; t < this.triangles.length; t += 3)
      for (let k = 0; k < 3; k++) {
        const [a, b] = [this.triangles[t + k], this.triangles[t + ((k + 1) % 3)]];
        if (a >= first && a < last && b >= first && b < last) pairs.push(a * this.count + b, b * this.count + a);
      }
    const each = Float64Array.from(pairs).sort().filter((key, k, all) => key !== all[k - 1]);
    const starts = new Uint32Array(this.count + 1);
    for (const key of each) starts[Math.floor(key / this.count) + 1]++;
    for (let i = 0; i < this.count; i++) starts[i + 1] += starts[i];
    return { starts, neighbours: Uint32Array.from(each, (key) => key % this.count) };
  }

  // The triangles at each vertex, in the same form.
  touchingOf() {
    const starts = new Uint32Array(this.count + 1);
    for (const corner of this.triangles) starts[corner + 1]++;
    for (let i = 0; i < this.count; i++) starts[i + 1] += starts[i];
    const [next, list] = [starts.slice(), new Uint32Array(this.triangles.length)];
    this.triangles.forEach((corner, k) => (list[next[corner]++] = k - (k % 3)));
    return { starts, list };
  }

  // The vertex of the skin that is nearest to a place.
  nearest(place) {
    const key = place.join();
    if (!this.found.has(key)) {
      if (this.found.size > 500) this.found.clear();
      this.found.set(key, this.nearestOf(place, ...this.skin));
    }
    return this.found.get(key);
  }

  nearestOf([x, y, z], first, last) {
    let [best, least] = [first, Infinity];
    for (let i = first; i < last; i++) {
      const off = (this.vertices[3 * i] - x) ** 2 + (this.vertices[3 * i + 1] - y) ** 2 + (this.vertices[3 * i + 2] - z) ** 2;
      if (off < least) [best, least] = [i, off];
    }
    return best;
  }

  // The vertex of each one's mirror image, or -1.
  get twins() {
    if (this.twin) return this.twin;
    const [v, [first, last]] = [this.vertices, this.skin];
    const cell = (x, y, z) => (Math.round(x / MARGIN) * 4e3 + Math.round(y / MARGIN)) * 4e3 + Math.round(z / MARGIN);
    const cells = new Map();
    for (let i = first; i < last; i++) cells.set(cell(v[3 * i], v[3 * i + 1], v[3 * i + 2]), [...(cells.get(cell(v[3 * i], v[3 * i + 1], v[3 * i + 2])) ?? []), i]);
    this.twin = new Int32Array(this.count).fill(-1);
    for (let i = first; i < last; i++) {
      const [x, y, z] = [-v[3 * i], v[3 * i + 1], v[3 * i + 2]];
      let least = MARGIN ** 2;
      for (let n = 0; n < 27; n++)
        for (const k of cells.get(cell(x + ((n % 3) - 1) * MARGIN, y + ((Math.floor(n / 3) % 3) - 1) * MARGIN, z + (Math.floor(n / 9) - 1) * MARGIN)) ?? []) {
          const off = (v[3 * k] - x) ** 2 + (v[3 * k + 1] - y) ** 2 + (v[3 * k + 2] - z) ** 2;
          if (off < least) [this.twin[i], least] = [k, off];
        }
    }
    return this.twin;
  }

  // The mirror image of a mask; vertices without one are left out and counted.
  mirrored(mask) {
    const out = new Uint8Array(this.count);
    let lost = 0;
    for (let i = this.skin[0]; i < this.skin[1]; i++) {
      if (!mask[i]) continue;
      if (this.twins[i] < 0) lost += 1;
      else out[this.twins[i]] = 1;
    }
    return { mask: out, lost };
  }

  // A mask with the neighbours of its vertices, or without those at its rim.
  grownMask(mask, more) {
    const out = mask.slice();
    const { starts, neighbours } = this.ring;
    for (let i = this.skin[0]; i < this.skin[1]; i++)
      for (let j = starts[i]; j < starts[i + 1]; j++) if (mask[neighbours[j]] === (more ? 1 : 0)) out[i] = more ? 1 : 0;
    return out;
  }

  // Where a ray meets the shown parts: { place, vertex, normal } or null. from, way: three numbers each.
  hit(from, way, shown) {
    const [p, tri] = [this.posed, this.triangles];
    let [near, best, at] = [Infinity, -1, null];
    for (let t = 0; t < tri.length; t += 3) {
      const [a, b, c] = [3 * tri[t], 3 * tri[t + 1], 3 * tri[t + 2]];
      const [ux, uy, uz] = [p[b] - p[a], p[b + 1] - p[a + 1], p[b + 2] - p[a + 2]];
      const [vx, vy, vz] = [p[c] - p[a], p[c + 1] - p[a + 1], p[c + 2] - p[a + 2]];
      const [hx, hy, hz] = [way[1] * vz - way[2] * vy, way[2] * vx - way[0] * vz, way[0] * vy - way[1] * vx];
      const area = ux * hx + uy * hy + uz * hz;
      if (area < 1e-14) continue; // seen from behind
      const [sx, sy, sz] = [from[0] - p[a], from[1] - p[a + 1], from[2] - p[a + 2]];
      const u = sx * hx + sy * hy + sz * hz;
      if (u < 0 || u > area) continue;
      const [qx, qy, qz] = [sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux];
      const w = way[0] * qx + way[1] * qy + way[2] * qz;
      if (w < 0 || u + w > area) continue;
      const far = (vx * qx + vy * qy + vz * qz) / area;
      if (far > 0 && far < near && shown(tri[t])) [near, best, at] = [far, t, [1 - (u + w) / area, u / area, w / area]];
    }
    if (best < 0) return null;
    const corners = [0, 1, 2].map((k) => tri[best + k]);
    const rest = [0, 1, 2].map((k) => corners.reduce((sum, corner, n) => sum + at[n] * this.vertices[3 * corner + k], 0));
    return { place: rest, vertex: corners[at.indexOf(Math.max(...at))] };
  }

  // Compute the normal of a triangle again; plain loops and no arrays, as thousands move in a frame.
  turn(t) {
    const { posed: p, triangles, crosses, sums } = this;
    const a = 3 * triangles[t];
    const b = 3 * triangles[t + 1];
    const c = 3 * triangles[t + 2];
    const px = p[b] - p[a];
    const py = p[b + 1] - p[a + 1];
    const pz = p[b + 2] - p[a + 2];
    const qx = p[c] - p[a];
    const qy = p[c + 1] - p[a + 1];
    const qz = p[c + 2] - p[a + 2];
    const x = py * qz - pz * qy;
    const y = pz * qx - px * qz;
    const z = px * qy - py * qx;
    for (let n = 0; n < 3; n++) {
      const corner = 3 * triangles[t + n];
      sums[corner] += x - crosses[t];
      sums[corner + 1] += y - crosses[t + 1];
      sums[corner + 2] += z - crosses[t + 2];
    }
    crosses[t] = x;
    crosses[t + 1] = y;
    crosses[t + 2] = z;
  }

  settle(i) {
    const { sums, normals } = this;
    const k = 3 * i;
    const length = Math.sqrt(sums[k] * sums[k] + sums[k + 1] * sums[k + 1] + sums[k + 2] * sums[k + 2]) || 1;
    for (let n = k; n < k + 3; n++) normals[n] = sums[n] / length;
  }

  // Draw the vertices at `at` (3 numbers each), of which only the numbers `changed` may be new; null: any.
  // Only triangles that move, or moved before, are turned.
  pose(at, changed = null) {
    const [{ starts, list }, { posed, vertices }] = [this.touching, this];
    const [turned, again, around] = [[], this.turned, []];
    if (!changed) posed.set(at);
    this.mark = (this.mark ?? 0) + 1; // of what this call has seen
    const [triangleMarks, vertexMarks] = [(this.triangleMarks ??= new Uint32Array(this.triangles.length / 3)), (this.vertexMarks ??= new Uint32Array(this.count))];
    const move = (i) => {
      if (Math.abs(at[i] - vertices[i]) <= HOME) return;
      const vertex = Math.floor(i / 3);
      for (let j = starts[vertex]; j < starts[vertex + 1]; j++) {
        if (triangleMarks[list[j] / 3] === this.mark) continue;
        triangleMarks[list[j] / 3] = this.mark;
        turned.push(list[j]);
      }
    };
    if (changed) for (const i of changed) posed[i] = at[i];
    if (changed) changed.forEach(move);
    else for (let i = 0; i < at.length; i++) move(i);
    const settle = (t) => {
      this.turn(t);
      for (let k = t; k < t + 3; k++) {
        const vertex = this.triangles[k];
        if (vertexMarks[vertex] !== this.mark) around.push(vertex);
        vertexMarks[vertex] = this.mark;
      }
    };
    turned.forEach(settle);
    for (const t of again) if (triangleMarks[t / 3] !== this.mark) settle(t);
    for (const i of around) this.settle(i);
    this.turned = turned;
  }
}
