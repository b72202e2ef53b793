// Prints the vertices that the Face tab's modules compute, as JSON: [FAP, value, float32 in base64] each.
// node face_fields.mjs FOLDER_OF_MODULES HEAD
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [, , folder, file] = process.argv;
const module = (name) => import(pathToFileURL(`${folder}/${name}.js`).href);
const [{ HeadMesh }, { fieldOf }, { beyond, coupled, fapuOf, keepLids, lidsOf }, { expanded }] = await Promise.all(["mesh", "zones", "deform", "draft"].map(module));

const TYPES = { f4: Float32Array, f8: Float64Array, u4: Uint32Array };
const { buffer } = new Uint8Array(readFileSync(file));
const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, new DataView(buffer).getUint32(0, true))));
const mesh = new HeadMesh(head, Object.fromEntries(Object.entries(head.arrays).map(([name, [type, count, start]]) => [name, new TYPES[type](buffer, start, count)])));
const rows = new Map(head.faps.map((row) => [row.fap, row]));
const { points, joined, zone, masks } = head.setup;
const setup = { points, joined, zones: new Map(zone.map((one) => [one.fap, one])), masks: new Map(Object.entries(masks).map(([fap, text]) => [Number(fap), expanded(text, mesh.count)])) };
const made = new Map();
const field = (fap) => {
  if (!made.has(fap)) {
    const work = fieldOf(fap, setup, mesh, rows, head.pairs);
    let step = work.next();
    while (!step.done) step = work.next();
    made.set(fap, step.value);
  }
  return made.get(fap);
};
const units = fapuOf(points);
const lids = lidsOf(mesh, field);
const out = [];
for (const fap of setup.zones.keys())
  for (const value of new Set([...rows.get(fap).usual, 512])) {
    if (!value) continue;
    const at = mesh.vertices.slice();
    const moving = coupled(fap, value, points, rows);
    for (const [one, far] of moving) if (far) field(one).forEach((x, i) => (at[i] += far * units[rows.get(one).unit] * x));
    if ((fap >= 19 && fap <= 22) || moving.some(beyond)) keepLids(lids, at);
    out.push([fap, value, Buffer.from(Float32Array.from(at).buffer).toString("base64")]);
  }
console.log(JSON.stringify(out));
