// One smooth subdivision of a face, by the rules of realizer/face/subdivision.py: the mesh stream stays small.

export class Subdivision {
  // `ranges` are first and last + 1 vertex of the parts that are subdivided.
  constructor(triangles, count, ranges) {
    const range = new Int32Array(count).fill(-1);
    ranges.forEach(([first, last], k) => range.fill(k, first, last));
    const corners = (t) => [triangles[3 * t], triangles[3 * t + 1], triangles[3 * t + 2]];
    const coarse = [];
    const rest = [];
    for (let t = 0; t < triangles.length / 3; t++) {
      const [a, b, c] = corners(t);
      const inside = range[a] >= 0 && range[a] === range[b] && range[a] === range[c];
      (inside ? coarse : rest).push([a, b, c]);
    }
    const key = (a, b) => Math.min(a, b) * count + Math.max(a, b);
    const across = new Map(); // an edge -> the third corners of its triangles
    for (const [a, b, c] of coarse)
      for (const [from, to, third] of [[a, b, c], [b, c, a], [c, a, b]]) {
        const near = across.get(key(from, to)) ?? [];
        across.set(key(from, to), near);
        near.push(third);
      }
    const keys = [...across.keys()].sort((a, b) => a - b);
    // Both ends of each edge, and the third corners of its two triangles; at a rim, the ends again.
    this.edges = Uint32Array.from(keys.flatMap((edge) => {
      const ends = [Math.floor(edge / count), edge % count];
      const thirds = across.get(edge);
      return [...ends, ...(thirds.length === 2 ? thirds : ends)];
    }));
    this.rules(count);
    // New vertices follow those of their part.
    const firsts = keys.map((_, e) => range[this.edges[4 * e]]);
    const added = ranges.map((_, k) => firsts.filter((first) => first === k).length);
    let shift = 0;
    this.vertex = Uint32Array.from({ length: count }, (_, v) => {
      for (let k = 0; k < ranges.length; k++) if (ranges[k][1] === v) shift += added[k];
      return v + shift;
    });
    const next = ranges.map(([, last]) => this.vertex[last - 1] + 1);
    this.middle = Uint32Array.from(firsts, (first) => next[first]++);
    this.count = count + keys.length;
    const at = new Map(keys.map((edge, k) => [edge, this.middle[k]]));
    const split = coarse.flatMap(([a, b, c]) => {
      const [ab, bc, ca] = [at.get(key(a, b)), at.get(key(b, c)), at.get(key(c, a))];
      const [p, q, r] = [this.vertex[a], this.vertex[b], this.vertex[c]];
      return [p, ab, ca, ab, q, bc, ca, bc, r, ab, bc, ca];
    });
    this.triangles = Uint32Array.from([...split, ...rest.flat().map((v) => this.vertex[v])]);
  }

  // For each vertex its neighbours that count, from `first` on, and the weight of each.
  rules(count) {
    const near = Array.from({ length: count }, () => []);
    const along = Array.from({ length: count }, () => []);
    for (let e = 0; e < this.edges.length; e += 4) {
      const [a, b, c] = this.edges.subarray(e, e + 3);
      near[a].push(b);
      near[b].push(a);
      if (c !== a) continue;
      along[a].push(b);
      along[b].push(a);
    }
    const counts = near.map((others, v) => (along[v].length ? (along[v].length === 2 ? along[v] : []) : others));
    this.near = Uint32Array.from(counts.flat());
    let first = 0;
    this.first = Uint32Array.from([...counts.map(({ length }) => (first += length) - length), first]);
    this.share = Float32Array.from(counts, ({ length }, v) => (along[v].length ? 1 / 8 : length === 3 ? 3 / 16 : 3 / (8 * length)));
  }

  // Loop's rule for vertices.
  relax(values) {
    const out = values.slice();
    for (let v = 0; v < this.share.length; v++) {
      const [begin, end, weight] = [this.first[v], this.first[v + 1], this.share[v]];
      for (let k = 0; k < 3 && begin < end; k++) {
        const i = 3 * v + k;
        let sum = 0;
        for (let n = begin; n < end; n++) sum += values[3 * this.near[n] + k];
        out[i] += weight * (sum - (end - begin) * values[i]);
      }
    }
    return out;
  }

  // Write the places of all vertices, for those of the original, x y z each.
  places(own, out) {
    const pushed = this.relax(own);
    for (let i = 0; i < own.length; i++) pushed[i] = 2 * own[i] - pushed[i];
    const left = this.relax(pushed);
    for (let i = 0; i < own.length; i++) left[i] = own[i] - left[i];
    this.copy(own, 3, out);
    const { edges, middle } = this;
    for (let e = 0; e < middle.length; e++)
      for (let k = 0; k < 3; k++) {
        const a = 3 * edges[4 * e] + k;
        const b = 3 * edges[4 * e + 1] + k;
        const thirds = pushed[3 * edges[4 * e + 2] + k] + pushed[3 * edges[4 * e + 3] + k];
        out[3 * middle[e] + k] = (left[a] + left[b]) / 2 + (3 * (pushed[a] + pushed[b]) + thirds) / 8;
      }
  }

  // Write unit normals: those on edges are means.
  normals(own, out) {
    this.mean(own, 3, out);
    for (const vertex of this.middle) {
      const length = Math.hypot(out[3 * vertex], out[3 * vertex + 1], out[3 * vertex + 2]) || 1;
      for (let k = 0; k < 3; k++) out[3 * vertex + k] /= length;
    }
  }

  // Write the mean of the ends of each edge, of `size` values a vertex.
  mean(own, size, out) {
    this.copy(own, size, out);
    for (let e = 0; e < this.middle.length; e++)
      for (let k = 0; k < size; k++)
        out[size * this.middle[e] + k] = (own[size * this.edges[4 * e] + k] + own[size * this.edges[4 * e + 1] + k]) / 2;
    return out;
  }

  copy(own, size, out) {
    for (let v = 0; v < this.vertex.length; v++)
      for (let k = 0; k < size; k++) out[size * this.vertex[v] + k] = own[size * v + k];
  }
}
