// Mouse, touch and keys on the head: turning it, clicks and strokes.

const STILL = 5; // pixels; a press that moves less is a click
const KEYS = {
  ArrowLeft: { yaw: -0.15 }, ArrowRight: { yaw: 0.15 }, ArrowUp: { nearer: 1.12 }, ArrowDown: { nearer: 1 / 1.12 },
  w: { nearer: 1.4 }, s: { nearer: 1 / 1.4 }, PageUp: { y: 0.01 }, PageDown: { y: -0.01 }, a: { x: -0.01 }, d: { x: 0.01 },
  "+": { nearer: 1.12 }, "-": { nearer: 1 / 1.12 },
};

// taken: { click(x, y), stroke(kind, x, y) -> whether it is one's own, key(event) -> whether it was used }.
export function gestures(canvas, view, taken) {
  const held = new Map(); // pointers
  let [stroke, moved, apart] = [false, 0, 0];
  const spot = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.focus();
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, [event.clientX, event.clientY]);
    moved = 0;
    if (held.size === 1) stroke = event.button === 0 && !event.altKey && taken.stroke("start", ...spot(event));
    else if (stroke) stroke = taken.stroke("cancel");
    apart = 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = held.get(event.pointerId);
    if (!before) return taken.hover?.(...spot(event));
    const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]];
    moved += Math.abs(dx) + Math.abs(dy);
    held.set(event.pointerId, [event.clientX, event.clientY]);
    if (stroke) taken.stroke("move", ...spot(event));
    else if (held.size > 1) pinch(dx, dy);
    else if (event.shiftKey || event.buttons === 4) view.move({ x: -dx * 0.0004, y: dy * 0.0004 });
    else if (moved > STILL) view.move({ yaw: -dx / 160, pitch: dy / 160 });
  });
  const pinch = (dx, dy) => {
    const [one, other] = [...held.values()];
    const now = Math.hypot(one[0] - other[0], one[1] - other[1]);
    view.move({ nearer: apart ? now / apart : 1, x: -dx * 0.0002, y: dy * 0.0002 });
    apart = now;
  };
  const end = (event) => {
    if (!held.delete(event.pointerId)) return;
    if (stroke) taken.stroke(event.type === "pointerup" ? "end" : "cancel", ...spot(event));
    else if (event.type === "pointerup" && moved <= STILL && !held.size && event.button === 0) taken.click(...spot(event));
    stroke = false;
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("dblclick", () => taken.double?.());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    view.move({ nearer: Math.exp(-event.deltaY / 700) });
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const step = KEYS[event.key] ?? KEYS[event.key.toLowerCase()];
    if (event.key === "Home") view.home();
    else if (taken.key?.(event)) return event.preventDefault();
    else if (step) view.move(step);
    else return;
    event.preventDefault();
  });
}
