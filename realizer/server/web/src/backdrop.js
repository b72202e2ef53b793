// The backdrop of the rendered stills, as in realizer/render/backdrop.py: its smooth step in five stops.
export const REACH = [0.675, 0.75]; // of width and height, from the middle to the edge's colour
export const MIDDLE = [0.5, 0.444];

// [0..1 from the middle, colour]
export function stops({ backdrop_middle: middle, backdrop_edge: edge }) {
  return [0, 0.25, 0.5, 0.75, 1].map((t) => {
    const mix = t * t * (3 - 2 * t);
    const [r, g, b] = middle.map((m, k) => Math.round(255 * (m + (edge[k] - m) * mix)));
    return [t, `rgb(${r} ${g} ${b})`];
  });
}

export function backdrop(look) {
  const percent = (part) => `${100 * part}%`;
  const list = stops(look).map(([t, colour]) => `${colour} ${percent(t)}`);
  return `radial-gradient(${REACH.map(percent).join(" ")} at ${MIDDLE.map(percent).join(" ")}, ${list.join(", ")})`;
}
