// The editor of an expression: sliders of action units, what co-occurrence leaves of them, and saving.
import { at, make } from "../dom.js";
import { Pose } from "../pose.js";
import { ActionUnits } from "../sliders.js";

export class Expression {
  // preview: shows the face. save(message): the service's answer. told(words): what happens. saved(name): it is in the library.
  constructor({ preview, save, told, saved }) {
    Object.assign(this, { preview, save, told, saved, version: null, file: null });
    this.pose = new Pose(() => this.show());
    this.units = new ActionUnits(at("design-sliders"), at("design-find-au"), this.pose);
    at("design-neutral").onclick = () => this.open(null);
    at("design-save-expression").onclick = () => this.keep();
  }

  know(vocabulary) {
    this.units.know(vocabulary);
  }

  // Load an expression of the library; null: none.
  open(row) {
    this.row = row;
    this.pose.clear();
    const sided = new Set([...at("design-sliders").querySelectorAll(".row.au:not(.middle) b")].map(({ textContent }) => textContent));
    const aus = Object.entries(row?.aus ?? {}).flatMap(([name, value]) => (sided.has(name) ? [[`${name}L`, value], [`${name}R`, value]] : [[name, value]]));
    this.pose.set({ aus: Object.fromEntries(aus) });
    at("design-name").value = row?.name ?? "";
    at("design-means").value = row?.means.join(", ") ?? "";
    Object.assign(this, { file: row?.file ?? null, version: row?.version ?? null });
  }

  get aus() {
    return Object.fromEntries(this.pose.aus);
  }

  async show() {
    try {
      const { asked, seen } = await this.preview.show(this.aus);
      const names = [...new Set([...Object.keys(asked), ...Object.keys(seen)])].filter((name) => Math.abs((asked[name] ?? 0) - (seen[name] ?? 0)) > 0.005);
      at("design-rules").replaceChildren(...names.map((name) => make("li", {}, `AU${name} ${(asked[name] ?? 0).toFixed(2)} shows as ${(seen[name] ?? 0).toFixed(2)}`)));
    } catch (error) {
      this.told(error.message);
    }
  }

  // The expression as a file of the library; both sides of an action unit in one.
  get toml() {
    const units = new Map();
    for (const [name, value] of this.pose.aus) {
      const number = name.replace(/[LR]$/, "");
      const both = this.pose.aus.get(`${number}L`) === value && this.pose.aus.get(`${number}R`) === value;
      units.set(both ? number : name, value);
    }
    const list = (text) => `[${text.split(",").map((word) => word.trim()).filter(Boolean).map((word) => JSON.stringify(word)).join(", ")}]`;
    const kept = this.row ? ["onset", "apex", "offset"].map((name) => `${name} = ${this.row[name]}`) : [];
    return [`name = ${JSON.stringify(at("design-name").value.trim())}`, `means = ${list(at("design-means").value)}`, `aus = { ${[...units].map(([name, value]) => `${name} = ${value}`).join(", ")} }`, ...kept, ""].join("\n");
  }

  async keep() {
    const name = at("design-name").value.trim();
    const file = name.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-+|-+$/g, "").slice(0, 64);
    if (!file) return this.told("An expression needs a name that begins with a letter.");
    try {
      const version = file === this.file ? this.version : null;
      const answer = await this.save({ type: "save", kind: "expression", name: file, content: this.toml, ...(version ? { version } : {}) });
      Object.assign(this, { file, version: answer.version });
      this.told(`Saved as ${answer.file}; ${name} is now in the library.`);
      this.saved(name);
    } catch (error) {
      this.told(error.message);
    }
  }
}
