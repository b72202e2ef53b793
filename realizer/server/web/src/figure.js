// Details of the rendered stills: furrows where skin is pushed together, and highlights on the eyes.
import { BufferAttribute, BufferGeometry, Mesh, MeshBasicMaterial, Vector3 } from "three";

const smooth = (x) => x * x * (3 - 2 * x);

// Strips on the skin, drawn with the head's own material: `tone` darkens its lit colour.
export class Furrows {
  constructor(table, head, material) {
    this.table = table;
    this.geometry = new BufferGeometry();
    const count = table.points.length;
    const own = (name, size) => {
      const attribute = new BufferAttribute(new Float32Array(count * size), size);
      this.geometry.setAttribute(name, attribute);
      return attribute;
    };
    this.position = own("position", 3);
    this.normal = own("normal", 3);
    this.tone = own("tone", 1);
    for (const [name, size] of [["albedo", 3], ["occlusion", 1], ["gloss", 1]]) this.mix(head.attributes[name], own(name, size));
    this.geometry.setIndex(new BufferAttribute(new Uint32Array(table.triangles), 1));
    this.mesh = new Mesh(this.geometry, material);
    this.mesh.frustumCulled = false;
    this.mesh.visible = false;
  }

  // The weight of each point for the values of its three vertices.
  mix(from, to) {
    const read = ["getX", "getY", "getZ"];
    this.table.points.forEach(([a, b, c, u, v], i) => {
      for (let k = 0; k < to.itemSize; k++) {
        const get = read[k];
        to.array[i * to.itemSize + k] = u * from[get](a) + v * from[get](b) + (1 - u - v) * from[get](c);
      }
    });
    to.needsUpdate = true;
  }

  pose(head) {
    const { drives, tones, lift } = this.table;
    const { position, normal } = head.attributes;
    const amounts = drives.map(([a, b, rest, start, full]) => {
      const apart = Math.hypot(position.getX(a) - position.getX(b), position.getY(a) - position.getY(b), position.getZ(a) - position.getZ(b));
      return smooth(Math.min(1, Math.max(0, (apart / rest - 1 - start) / (full - start))));
    });
    this.mesh.visible = amounts.some((amount) => amount > 0);
    if (!this.mesh.visible) return;
    this.mix(position, this.position);
    this.mix(normal, this.normal);
    for (let i = 0; i < this.position.array.length; i++) this.position.array[i] += lift * this.normal.array[i];
    tones.forEach((pairs, i) => {
      this.tone.array[i] = pairs.reduce((sum, [drive, tone]) => sum + amounts[drive] * tone, 0);
    });
    this.tone.needsUpdate = true;
  }
}

// A white cap on each eye, towards the key light and the camera; the eye turns below it, lids hide it.
export class Glints {
  constructor({ corners, eyes }) {
    this.corners = corners;
    this.eyes = eyes;
    this.geometry = new BufferGeometry();
    this.position = new BufferAttribute(new Float32Array(eyes.length * (corners + 1) * 3), 3);
    this.geometry.setAttribute("position", this.position);
    const faces = eyes.flatMap((_, eye) => {
      const first = eye * (corners + 1);
      return Array.from({ length: corners }, (_, k) => [first, first + 1 + k, first + 1 + ((k + 1) % corners)]).flat();
    });
    this.geometry.setIndex(faces);
    this.mesh = new Mesh(this.geometry, new MeshBasicMaterial({ toneMapped: false }));
    this.mesh.frustumCulled = false;
  }

  pose(head, light, camera) {
    const middle = camera.getWorldDirection(new Vector3()).multiplyScalar(-light.glint).add(new Vector3(...light.key.direction)).normalize();
    const aside = new Vector3(0, 1, 0).cross(middle).normalize();
    const above = middle.clone().cross(aside);
    const points = [middle];
    for (let k = 0; k < this.corners; k++) {
      const turn = (2 * Math.PI * k) / this.corners;
      const out = aside.clone().multiplyScalar(Math.cos(turn)).addScaledVector(above, Math.sin(turn));
      points.push(middle.clone().multiplyScalar(Math.cos(light.glint_width)).addScaledVector(out, Math.sin(light.glint_width)));
    }
    const from = head.attributes.position.array;
    this.eyes.forEach(({ first, weights, radius }, eye) => {
      const centre = [0, 0, 0];
      weights.forEach((weight, i) => {
        for (let k = 0; k < 3; k++) centre[k] += weight * from[(first + i) * 3 + k];
      });
      points.forEach((point, i) => {
        point.toArray(this.position.array, (eye * points.length + i) * 3);
        for (let k = 0; k < 3; k++) {
          const place = (eye * points.length + i) * 3 + k;
          this.position.array[place] = this.position.array[place] * radius + centre[k];
        }
      });
    });
    this.position.needsUpdate = true;
  }
}
