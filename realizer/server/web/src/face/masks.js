// Strokes on the head that paint the mask of a FAP: a brush, or a lasso around what faces the camera.

export class MaskStrokes {
  // outline: an SVG polyline over the canvas.
  constructor(view, draft, panel, outline) {
    Object.assign(this, { view, draft, panel, outline, mask: null });
  }

  // Take part of a stroke; return whether it is one of a mask tool.
  stroke(kind, x, y) {
    const { panel } = this;
    if (kind === "start") {
      if (!panel.tool || !this.draft.state.zones.has(panel.fap)) return false;
      if (panel.tool === "brush" && !this.view.hit(x, y)) return false; // beside the head it turns
      this.mask = panel.mask.slice();
      this.path = [];
    }
    if (kind !== "cancel") panel.tool === "brush" ? this.brush(x, y) : this.path.push([x, y]);
    this.outline.setAttribute("points", panel.tool === "lasso" && (kind === "start" || kind === "move") ? this.path.join(" ") : "");
    if (kind === "end") {
      if (panel.tool === "lasso") this.lasso();
      this.draft.mask(panel.fap, this.mask);
    }
    if (kind === "end" || kind === "cancel") this.mask = null;
    return true;
  }

  brush(x, y) {
    const hit = this.view.hit(x, y);
    if (!hit) return;
    const { vertices, skin, nearest } = { ...this.draft.mesh, nearest: this.draft.mesh.nearest(hit.place) };
    const [wide, value] = [(this.panel.grain.valueAsNumber / 2000) ** 2, this.panel.erase.checked ? 0 : 1];
    for (let i = skin[0]; i < skin[1]; i++)
      if ((vertices[3 * i] - hit.place[0]) ** 2 + (vertices[3 * i + 1] - hit.place[1]) ** 2 + (vertices[3 * i + 2] - hit.place[2]) ** 2 < wide) this.mask[i] = value;
    this.mask[nearest] = value;
  }

  lasso() {
    const { view, path, draft: { mesh } } = this;
    const value = this.panel.erase.checked ? 0 : 1;
    for (let i = mesh.skin[0]; i < mesh.skin[1]; i++)
      if (view.faces(i) && inside(view.onScreen([mesh.posed[3 * i], mesh.posed[3 * i + 1], mesh.posed[3 * i + 2]]), path)) this.mask[i] = value;
  }
}

function inside([x, y], path) {
  let odd = false;
  for (let i = 0, j = path.length - 1; i < path.length; j = i++) {
    const [[a, b], [c, d]] = [path[i], path[j]];
    if (b > y !== d > y && x < ((c - a) * (y - b)) / (d - b) + a) odd = !odd;
  }
  return odd;
}
