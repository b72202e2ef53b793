"""Generated teeth: an upper and a lower arch with gums, and the palate."""

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.mesh_geometry import grid
from realizer_studio.faces.parts import Part, smooth

# mm, by tooth from the middle: widths, crown heights, and distances of the edges from the bite plane.
UPPER = (
    (8.4, 6.8, 7.6, 7.0, 6.6, 9.5, 9.0),
    (9.8, 8.8, 9.6, 8.0, 7.4, 6.6, 6.2),
    (0.0, 0.7, 0.1, 0.6, 0.9, 1.1, 1.3),
)
LOWER = (
    (5.4, 5.9, 6.7, 7.0, 7.0, 10.0, 9.5),
    (8.2, 8.4, 9.0, 7.8, 7.2, 6.4, 6.0),
    (0.0, 0.0, 0.0, 0.3, 0.5, 0.6, 0.8),
)
GAP, PAPILLA = 0.0006, 0.0024  # m; depth of the gaps between teeth, and length of the gum in them
# Rings from the gum at the tongue over the biting edge to the gum at the lips: m from the biting edge, plus a
# share of the crown's height; m outwards; share of light; gloss; colour.
RINGS = (
    (0.0080, 1.00, -0.0062, 0.45, 0.30, "gum"),
    (0.0000, 0.92, -0.0054, 0.70, 0.40, "gum"),
    (0.0000, 0.74, -0.0048, 0.78, 0.30, "root"),
    (0.0006, 0.30, -0.0030, 0.75, 0.40, "tooth"),
    (0.0000, 0.00, -0.0008, 1.00, 1.00, "tooth"),
    (0.0005, 0.00, 0.0000, 1.00, 1.00, "tooth"),
    (0.0000, 0.40, 0.0007, 1.00, 1.00, "tooth"),
    (0.0000, 0.72, 0.0006, 0.90, 1.00, "tooth"),
    (-0.0006, 0.96, 0.0000, 0.75, 0.90, "root"),
    (0.0002, 1.00, 0.0009, 0.72, 0.60, "gum"),
    (0.0030, 1.00, 0.0012, 0.55, 0.60, "gum"),
    (0.0075, 1.00, 0.0002, 0.40, 0.40, "gum"),
)
GUM = 0, 1, 9, 10, 11  # rings that do not follow the biting edge
PALATE = (0.04, 0.36, 0.68)  # shares of the way from the middle to the teeth
ROOF = 0.0010  # m from the crowns to the edge of the palate
VAULT, RISE = 0.0152, 4.0  # m, height of the palate over the bite, and its slope beside the teeth
WITHIN = 0.0030  # m, thickness of a tooth
IN_LIP = 0.62  # share of the light that reaches the lower teeth past upper teeth and lips
LIT = 0.50, 0.48  # light at the back of the mouth, and its increase to the front
WARM = np.array([1.0, 0.78, 0.64])  # colour of the light behind the teeth, reflected by tongue and cheeks


def teeth(name: str, front: Float64, width: float, depth: float, colours: dict[str, list[float]]) -> Part:
    """Return an arch of fourteen teeth with gums; the upper one has the palate.

    Args:
        front: (3,) the biting edge between the two middle teeth.
        width, depth: metres; half axes of the arch (half an ellipse, then straight backwards).
    """
    up = 1.0 if name == "upper_teeth" else -1.0
    side = _stations(*(np.array(row) / 1000 for row in (UPPER if up > 0 else LOWER)))
    along, crown, back, gap, shade = side.T
    positions, outwards = _arch(along, width, depth)
    rings, tints, shades, shines = [], [], [], []
    middle = np.array([0, front[2] - depth])
    flat = positions + front[[0, 2]]

    def add(flat: Float64, height: Float64, tint: Float64, light: float, shine: float) -> None:
        rings.append(np.stack([flat[:, 0], front[1] + up * height, flat[:, 1]], 1))
        tints.append(tint * np.ones((len(flat), 1)))
        shades.append(light)
        shines.append(shine)

    gum = np.array(colours["gum"], float)
    if up > 0:
        for share in PALATE:
            # The palate runs towards the centre of the arch, behind it straight to the middle line.
            target = np.stack([np.zeros(len(flat)), np.minimum(flat[:, 1], middle[1])], 1)
            inwards = (1 - share) * np.linalg.norm(flat - target, axis=1) - WITHIN
            height = np.maximum(VAULT * np.tanh(RISE * inwards / VAULT), crown + ROOF)
            add(target + share * (flat - target), height, gum * WARM * 0.9, 0.5, 0.3)
    for k, (rise, share, out, light, shine, colour) in enumerate(RINGS):
        rise = ROOF if up > 0 and k == 0 else rise
        height = rise + share * (crown - gap * PAPILLA) + back * (1 - share)
        if k in (4, 5):
            height = height + gap * GAP
        recess = np.zeros(len(flat)) if k in GUM else gap * GAP
        points = flat + outwards * (out - recess)[:, None]
        warm = WARM if k < 3 else 0.4 + 0.6 * WARM if k == 3 else np.ones(3)
        dark = np.ones(len(flat)) if colour == "gum" else (1 - 0.22 * gap) * shade
        add(points, height, np.array(colours[colour], float) * warm * dark[:, None], light, shine)
    count = len(rings)
    vertices, painted = (np.stack(rows, 1).reshape(-1, 3) for rows in (rings, tints))
    triangles = grid(len(side), count)
    if up < 0:
        triangles = triangles[:, [0, 2, 1]]
    # Between open lips light reaches the front teeth, but not the back of the mouth.
    near = smooth((front[2] - vertices[:, 2]) / depth, 0.95, 0.02)
    occlusion = (LIT[0] + LIT[1] * near) * np.tile(shades, len(side)) * (1 if up > 0 else IN_LIP)
    gloss = 0.75 * near * np.tile(shines, len(side))
    return Part(name, None, vertices, triangles, painted, gloss, occlusion)


def _stations(widths: Float64, crowns: Float64, backs: Float64) -> Float64:
    """Return rows of arc length, crown height, edge distance, 1 in gaps, and shade, from right to left."""
    ends = np.concatenate([[0], np.cumsum(widths)])
    rows = []
    for k, (first, width) in enumerate(zip(ends, widths, strict=False)):
        for share in (0.0, 0.16, 0.5, 0.84):
            rows.append((first + share * width, crowns[k], backs[k], float(share == 0), 1 - 0.04 * k))
    rows.append((ends[-1], crowns[-1], backs[-1], 1.0, rows[-1][-1]))
    half = np.array(rows)
    return np.concatenate([half[:0:-1] * [-1, 1, 1, 1, 1], half])


def _arch(along: Float64, width: float, depth: float) -> tuple[Float64, Float64]:
    """Return positions on the arch (n, 2), x and z from its front, and the outward normals (n, 2)."""
    t = np.linspace(0, np.pi / 2, 1000)
    x, z = width * np.sin(t), depth * (np.cos(t) - 1)
    x, z = np.append(x, 0.96 * width), np.append(z, z[-1] - 0.03)
    run = np.concatenate([[0], np.cumsum(np.hypot(np.diff(x), np.diff(z)))])

    def at(s: Float64) -> Float64:
        return np.stack([np.sign(s) * np.interp(np.abs(s), run, x), np.interp(np.abs(s), run, z)], 1)

    tangent = at(along + 2e-4) - at(along - 2e-4)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    return at(along), np.stack([-tangent[:, 1], tangent[:, 0]], 1)
