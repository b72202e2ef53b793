// The difference picture of Paul 2010, 4.4.2: what moves, over a blurred picture of the neutral face.

const STRONG = 3; // times
const BLUR = "blur(4px) grayscale(1) brightness(0.6)";

export class Difference {
  constructor(canvas, view) {
    Object.assign(this, { canvas, view, rest: document.createElement("canvas"), moved: document.createElement("canvas") });
  }

  turn(on) {
    this.canvas.hidden = !on;
    this.view.stale = true;
  }

  // Compare the picture that was drawn with one of the neutral face.
  draw() {
    const { canvas, view, rest, moved } = this;
    if (canvas.hidden) return;
    const { width, height } = view.canvas;
    for (const one of [canvas, rest, moved]) Object.assign(one, { width, height });
    const posed = view.mesh.posed.slice();
    const take = (onto, at) => {
      view.pose(at);
      view.draw();
      onto.getContext("2d").drawImage(view.canvas, 0, 0);
    };
    take(rest, view.mesh.vertices);
    take(moved, posed);
    const pen = moved.getContext("2d");
    pen.globalCompositeOperation = "difference";
    pen.drawImage(rest, 0, 0);
    const out = canvas.getContext("2d");
    out.filter = BLUR;
    out.drawImage(rest, 0, 0);
    out.filter = "none";
    out.globalCompositeOperation = "lighter";
    for (let k = 0; k < STRONG; k++) out.drawImage(moved, 0, 0);
  }
}
