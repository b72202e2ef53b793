"""Hair meshes by style: strands from a pole to the hairline and beyond."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.core.errors import FaceError
from realizer.face.mesh_geometry import grid
from realizer.facebuild.parts import Part, smooth
from realizer.facebuild.person.scalp import Scalp
from realizer.tables import toml_table

SEED = 11  # of the locks: the same head, the same hair
FALLS = 6  # rows of what hangs down
CLEAR = 0.005  # m that hanging hair keeps off skin
GREY = np.array([176, 172, 168.0])
Table = list[list[float]]


@dataclass(frozen=True, slots=True)
class Style:
    """Figures of a way to wear hair, as `realizer/tables/hair.toml` explains them."""

    pole: list[float]
    columns: int
    rows: list[float]
    rise: Table
    thick: Table
    sides: float
    crown: float
    top: Table
    fall: Table
    body: float
    tuck: float
    uneven: float
    cover: float
    soft: float
    ragged: float
    contrast: float
    wave: float
    gloss: float
    grey: float
    bun: list[float]
    line: Table


def style_of(table: Mapping[str, Any]) -> Style:
    """Return the style that a recipe's [hair] names, with its changes.

    Raises:
        FaceError: no such style, or no such figure.
    """
    known = toml_table("hair.toml")
    name = table.get("style", "short")
    if not isinstance(name, str) or name not in known["styles"]:
        raise FaceError(f"hair: style: wanted one of {', '.join(known['styles'])}, got {name!r}")
    own = {key: value for key, value in table.items() if key != "style"}
    names = [field.name for field in fields(Style)]
    for key in own:
        if key not in names:
            raise FaceError(f"hair: wanted one of style, {', '.join(names)}, got {key!r}")
    figures = known["plain"] | {"line": known["line"]["heights"]} | known["styles"][name] | own
    return Style(**figures)


def shadow(scalp: Scalp, style: Style, at: Float64) -> Float64:
    """Return the share (n,) of the hair's colour in the skin: whole under the hair, none beside it."""
    low = smooth(scalp.height(style.top, at) - at[:, 1], -0.004, 0.016)
    return np.asarray(style.cover * 0.8 * smooth(scalp.high(at), -0.007, 0.010) * low)


def hair(scalp: Scalp, style: Style, look: Mapping[str, Any]) -> list[Part]:
    """Return the hair: a sheet on the scalp that hangs down from it, and a bun.

    Args:
        look: sRGB colours hair and skin.
    """
    rng = np.random.default_rng(SEED)
    pole = np.array(style.pole, float)
    pole /= np.linalg.norm(pole)
    turn, edge = _columns(scalp, pole, style.columns)
    n = len(turn)
    edge = edge + rng.uniform(-1, 1, n) * style.ragged / 0.09
    foot = scalp.skull(_ways(pole, turn, edge))
    degrees = scalp.degrees(foot)
    begin = _beginnings(scalp, style, pole, turn, edge)
    drop = np.interp(degrees, *np.array(style.fall, float).T)
    rows = np.array(style.rows, float)
    long = edge * 0.09  # m, about, of a strand on the scalp
    # Near the hairline, rows keep their distance to it whatever the strand's length.
    share = 1 - (1 - rows[:, None] / rows[-1]) ** (rows[-1] / np.maximum(long * (1 - begin), 0.02))
    ways = np.stack([_ways(pole, turn, edge * (1 - s * (1 - begin))) for s in share])
    ground = scalp.skull(ways.reshape(-1, 3)).reshape(len(rows), n, 3)
    off = share * (long * (1 - begin))
    far = long * (1 - begin) - off
    hangs = smooth(drop, 0.0, 0.05)
    # A strand that passes close by the hairline, above an ear, is thin there too.
    beside = scalp.high(ground.reshape(-1, 3)).reshape(off.shape)
    off = np.where(hangs > 0, off, np.minimum(off, np.maximum(beside, 0) + 0.0005))
    # The brightness of locks a few columns wide around the head, -1..1.
    raw = rng.uniform(-1, 1, n)
    lock = raw + 0.5 * (np.roll(raw, 1) + np.roll(raw, -1))
    lock = lock / np.abs(lock).max()
    thick = np.interp(off, *np.array(style.thick, float).T)
    side = 1 - (1 - style.sides) * smooth(np.abs(ways[..., 0]), 0.35, 0.85)
    thick = thick * side * (1 + style.crown * smooth(ways[..., 1], 0.3, 0.9) * (1 - ways[..., 0] ** 2))
    thick = np.where((begin > 0.01)[None], thick * smooth(far, -0.001, 0.016) - 0.0003 * (far < 0.002), thick)
    thick = np.maximum(thick, style.body * hangs)
    thick += style.wave * lock * smooth(off + 0.02 * hangs, 0.004, 0.02) * smooth(far, 0.0, 0.03)
    at = ground + ways * thick[..., None]
    # Close to the skin the skull's mixture is not exact enough.
    flat, want = at.reshape(-1, 3), thick.ravel()
    for _ in range(2):
        lift, ups = scalp.lift(flat)
        gap = want - lift
        flat = (
            flat
            + (np.where(gap > 0, gap, gap * smooth(want, 0.008, 0.003)) * smooth(want, 0.03, 0.015))[:, None]
            * ups
        )
    at = flat.reshape(at.shape)
    soft = style.soft * (1 + 0.45 * lock)
    seen = style.cover * np.maximum(0.12 + 0.88 * smooth(off, 0.0, soft), hangs)
    seen = np.where((begin > 0.01)[None], seen * (0.1 + 0.9 * smooth(far, 0.0, 0.02)), seen)
    strand = 1 + style.contrast * (
        0.7 * lock + 0.5 * rng.uniform(-1, 1, n) + 0.12 * rng.uniform(-1, 1, off.shape)
    )
    grown = begin < 0.9
    keep = grown & np.roll(grown, -1)
    sheet = _closed(len(rows), n, keep)
    if not begin.any():
        # All strands begin at one vertex, the pole.
        last = len(rows) * n - n
        sheet = np.where(sheet >= last, last, sheet)
        sheet = sheet[
            (sheet[:, 0] != sheet[:, 1]) & (sheet[:, 1] != sheet[:, 2]) & (sheet[:, 2] != sheet[:, 0])
        ]
    if drop.max() > 0.005:
        hung, dark = _fall(scalp, style, at, drop, rng)
        at = np.concatenate([hung[::-1], at])
        strand = np.concatenate([dark[::-1] * strand[0], strand])
        seen = np.concatenate([np.repeat(seen[:1], FALLS, 0), seen])
        hanging = (drop > 0.004) & (np.roll(drop, -1) > 0.004)
        sheet = np.concatenate([sheet + FALLS * n, _closed(FALLS + 1, n, hanging & keep)])
    parts = [_sheet(at, sheet, strand, seen, style, look, rng)]
    if max(style.bun) > 0:
        crest = scalp.skull(pole[None])[0]
        radii = np.array(style.bun, float)
        parts.append(_bun(crest + pole * radii[2] * 0.85, radii, look["hair"], style))
    return parts


def _sheet(
    at: Float64,
    triangles: Any,
    strand: Float64,
    seen: Float64,
    style: Style,
    look: Mapping[str, Any],
    rng: Any,
) -> Part:
    tint = np.array(look["hair"], float)
    old = np.clip(style.grey + 0.45 * style.grey * rng.uniform(-1, 1, at.shape[1]), 0, 1)[:, None]
    tint = tint * (1 - old) + GREY * old
    # Skin that shows through has the shadow of the hair's roots.
    under = np.array(look["skin"], float) * 0.72 + np.array(look["hair"], float) * 0.28
    colours = tint[None] * strand[..., None] * seen[..., None] + under * (1 - seen[..., None])
    used, inverse = np.unique(triangles, return_inverse=True)
    return Part(
        "hair",
        None,
        at.reshape(-1, 3)[used],
        inverse.reshape(-1, 3).astype(np.int32),
        np.clip(colours.reshape(-1, 3)[used], 0, 255),
        (style.gloss * seen).reshape(-1)[used],
    )


def _closed(rows: int, columns: int, keep: Any) -> Any:
    """Return the triangles of a closed sheet whose rows begin at the lower edge, for selected columns."""
    triangles = grid(rows, columns, closed=True)
    first = np.concatenate([np.tile(np.arange(columns), rows - 1)] * 2)
    return triangles[keep[first]][:, ::-1]


def _ways(pole: Float64, turn: Float64, angle: Any) -> Float64:
    """Return unit vectors at an angle (radians) from the pole, turned about it."""
    aside = np.cross([0, 0, 1.0] if abs(pole[2]) < 0.7 else [0, 1.0, 0], pole)
    aside /= np.linalg.norm(aside)
    ahead = np.cross(pole, aside)
    flat = np.cos(turn)[:, None] * aside + np.sin(turn)[:, None] * ahead
    angle = np.broadcast_to(np.asarray(angle, float), turn.shape)[:, None]
    return np.asarray(np.cos(angle) * pole + np.sin(angle) * flat)


def _columns(scalp: Scalp, pole: Float64, count: int) -> tuple[Float64, Float64]:
    """Return turns about the pole, spread evenly along the hairline, and the angles from the pole to it."""
    turn = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    angle = np.radians(np.arange(2, 172, 1.5))
    ways = np.stack([_ways(pole, turn, a) for a in angle])
    high = scalp.high(scalp.skull(ways.reshape(-1, 3))).reshape(len(angle), len(turn))
    out = np.maximum((high < 0).argmax(axis=0), 1)
    column = np.arange(len(turn))
    a, b = high[out - 1, column], high[out, column]
    edge = angle[out - 1] + (angle[out] - angle[out - 1]) * np.clip(a / np.where(a > b, a - b, 1), 0, 1)
    foot = scalp.skull(_ways(pole, turn, edge))
    step = np.linalg.norm(np.roll(foot, -1, axis=0) - foot, axis=1)
    step = np.minimum(step, 2.5 * np.median(step)) + 0.0006
    run = np.concatenate([[0], np.cumsum(step)])
    at = np.interp(np.arange(count) / count * run[-1], run, np.append(turn, 2 * np.pi))
    return at, np.interp(at, np.append(turn, 2 * np.pi), np.append(edge, edge[0]))


def _beginnings(scalp: Scalp, style: Style, pole: Float64, turn: Float64, edge: Float64) -> Float64:
    """Return the bald share of each strand from the pole: the part above the style's top; 1 is all."""
    shares = np.linspace(0, 1, 60)
    at = np.stack([scalp.skull(_ways(pole, turn, edge * s)) for s in shares])
    bald = at[..., 1] > scalp.height(style.top, at.reshape(-1, 3)).reshape(at.shape[:2])
    count = bald.sum(axis=0) / len(shares)
    return np.where(
        count > 0, np.maximum(0.5 * count + 0.25 * (np.roll(count, 1) + np.roll(count, -1)), 0.02), 0
    )


def _fall(scalp: Scalp, style: Style, at: Float64, drop: Float64, rng: Any) -> tuple[Float64, Float64]:
    """Return the hanging part below the lowest row, (rows, n, 3), and its brightness (rows, n)."""
    steps = 4 * FALLS
    here, way = at[0].copy(), at[0] - at[1]
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    long = np.maximum(drop + style.uneven * rng.uniform(-1, 1, len(drop)), 0) * (drop > 0.004)
    rows, dark = [], []
    for k in range(steps):
        s = (k + 0.5) / steps
        heavy = smooth(s * long, 0.0, 0.05)[:, None]
        inward = scalp.middle - here
        inward[:, 1] = 0
        inward /= np.maximum(np.linalg.norm(inward, axis=1, keepdims=True), 1e-9)
        down = np.array([0, -1.0, 0]) + inward * (style.tuck * smooth(s, 0.45, 1.0))
        go = way * (1 - heavy) + down * heavy
        go /= np.maximum(np.linalg.norm(go, axis=1, keepdims=True), 1e-9)
        here = here + go * (long / steps)[:, None]
        # Pushed off skin, ears and shoulders.
        lift, ups = scalp.lift(here)
        near = np.linalg.norm(here - scalp.at[scalp.nearest(here)], axis=1) < 0.03
        push = np.where(near, np.clip(CLEAR - lift, 0, 0.02), 0)
        here = here + ups * push[:, None]
        if (k + 1) % 4 == 0:
            rows.append(here)
            dark.append(np.full(len(drop), 1 - 0.10 * smooth(s, 0.3, 1.0)))
    return np.stack(rows), np.stack(dark)


def _bun(centre: Float64, radii: Float64, colour: Any, style: Style) -> Part:
    rows, columns = 9, 16
    polar = np.linspace(0.02, np.pi - 0.02, rows)[:, None]
    turn = np.linspace(0, 2 * np.pi, columns, endpoint=False)[None]
    ball = np.stack(
        [np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), -np.cos(polar) * np.ones_like(turn)], -1
    ).reshape(-1, 3)
    wound = np.sin(np.arctan2(ball[:, 1], ball[:, 0]) * 3 + ball[:, 2] * 5)
    vertices = centre + ball * radii * (1 + 0.035 * wound)[:, None]
    tint = np.array(colour, float) * (1 - style.grey) + GREY * style.grey
    tint = tint * (1 + style.contrast * wound)[:, None]
    return Part("hair", None, vertices, grid(rows, columns, True), tint, np.full(len(ball), style.gloss))
