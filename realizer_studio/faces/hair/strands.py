"""Strands: lines that grow from the scalp along the flow of a style and hang down from it."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from realizer.core.array_types import Bool, Float64
from realizer_studio.faces.hair.style import Style
from realizer_studio.faces.parts import smooth
from realizer_studio.faces.person.scalp import Scalp

STEP = 0.004  # m
NEAR = 0.03  # m from the skin, beyond which strands are not pushed off it
SHARPEST = 0.6  # cosine of the sharpest bend between segments
EAR = 0.015  # m; height of hair over an ear above the skull
LEAST = 0.0006  # m; least height of a strand above the skin
DEEPEST = 0.004  # m; depth of a strand below the skin that lifting can mend
DOWN = np.array([0.0, -1.0, 0.0])


@dataclass(frozen=True, eq=False)
class Strands:
    """Lines of s strands with k + 1 points each, from root to tip."""

    positions: Float64  # (s, k + 1, 3) metres
    normals: Float64  # (s, k + 1, 3) unit normals of the hair's surface there
    layer: Float64  # (s,) 0 for the undermost, 1 for the outermost
    length: Float64  # (s,) metres


def unit(vectors: Any) -> Float64:
    """Return vectors (..., 3) normalised to length 1."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12))


class Flow:
    """The direction of hair on the scalp: away from the parting, or towards it where hair is tied back."""

    def __init__(self, scalp: Scalp, style: Style) -> None:
        self._middle, self._style = scalp.middle, style
        ends = unit(np.array(style.parting, float))
        shares = np.linspace(0, len(ends) - 1, 24)
        self._parting = unit(np.stack([np.interp(shares, range(len(ends)), ends[:, k]) for k in range(3)], 1))

    def distance(self, at: Float64) -> Float64:
        """Return the approximate distance of points (n, 3) from the parting in metres."""
        direction = unit(at - self._middle)
        return np.asarray(0.1 * np.arccos((direction @ self._parting.T).max(axis=1).clip(-1, 1)))

    def __call__(self, at: Float64) -> Float64:
        """Return the direction of hair at points (n, 3), unit vectors (n, 3)."""
        direction = unit(at - self._middle)
        nearest = self._parting[(direction @ self._parting.T).argmax(axis=1)]
        out = direction - nearest
        out = unit(out - direction * (out * direction).sum(axis=1, keepdims=True))
        if self._style.tied:
            out = -out
        turn = np.radians(self._style.whorl) + self._style.stray * _wavy(at)
        sideways = np.cross(direction, out)
        return np.asarray(out * np.cos(turn)[:, None] + sideways * np.sin(turn)[:, None])


def _wavy(at: Float64) -> Float64:
    """Return a fixed field (n,) from -1 to 1 that varies smoothly over a few centimetres."""
    x, y, z = at.T * 1000
    return np.asarray(
        (np.sin(x / 9 + 1.3 * np.sin(z / 14)) + np.sin(y / 11 + z / 8 + 2) + np.sin(x / 6 - y / 7 + 4)) / 3
    )


def roots(scalp: Scalp, style: Style, count: int, low: float, high: float, rng: Any) -> Float64:
    """Return points (count, 3) spread evenly over the scalp between two distances from the hairline, m."""
    directions = unit(rng.normal(size=(12 * count + 3000, 3)))
    at = scalp.skull(directions)
    inside = edge(scalp, style, at)
    at = at[(inside > low) & (inside < high)]
    if not len(at):
        return at
    chosen = [0]
    distances = np.full(len(at), np.inf)
    for _ in range(min(count, len(at)) - 1):
        distances = np.minimum(distances, ((at - at[chosen[-1]]) ** 2).sum(axis=1))
        chosen.append(int(distances.argmax()))
    return at[chosen]


def edge(scalp: Scalp, style: Style, at: Float64) -> Float64:
    """Return the approximate distance of points (n, 3) inside the edge of the hair, in metres."""
    ragged = style.ragged * _wavy(at)
    return np.minimum(scalp.high(at), scalp.height(style.top, at) - at[:, 1]) + ragged


def shadow(scalp: Scalp, style: Style, at: Float64) -> Float64:
    """Return the share (n,) of the hair's colour in the skin, which fades at the edge of the hair."""
    return np.asarray(style.cover * 0.8 * smooth(edge(scalp, style, at), -0.006, 0.010))


def thickness(scalp: Scalp, style: Style, at: Float64) -> Float64:
    """Return the height (n,) of the hair's surface above the skin at points (n, 3), metres."""
    inside = edge(scalp, style, at)
    direction = unit(at - scalp.middle)
    thick = np.interp(inside, *np.array(style.thick, float).T)
    side = 1 - (1 - style.sides) * smooth(np.abs(direction[:, 0]), 0.35, 0.85)
    crown = 1 + style.crown * smooth(direction[:, 1], 0.3, 0.9) * (1 - direction[:, 0] ** 2)
    if not style.tied:
        # Hair is flat at the parting.
        crown = crown * (0.35 + 0.65 * smooth(Flow(scalp, style).distance(at), 0.0, 0.08))
    return np.asarray(np.maximum(thick * side * crown, LEAST))


def grow(
    scalp: Scalp, style: Style, at: Float64, layer: Float64, length: Float64, segments: int, rng: Any
) -> Strands:
    """Return strands from roots (s, 3).

    Strands rise to the height of their layer and follow the flow; below the skull they hang. They end at
    their length (s,), beyond the hairline, or at the height that the style has for their side of the head.

    Args:
        layer: (s,) 0..1.
    """
    path, run = _traced(scalp, style, at, layer, length, rng)
    # Hanging hair bends most on the crown, and gets more segments there.
    shares = np.linspace(0, 1, segments + 1) ** (1 + 0.6 * style.heavy)
    positions = np.stack(
        [
            np.stack([np.interp(shares * far[-1], far, line[:, axis]) for axis in range(3)], axis=1)
            for far, line in zip(run.T, path.transpose(1, 0, 2), strict=True)
        ]
    )
    length = np.where(_is_misplaced(scalp, style, positions), 0, run[-1])
    return Strands(positions, _hair_normals(scalp, positions), layer, length)


def _traced(
    scalp: Scalp, style: Style, at: Float64, layer: Float64, length: Float64, rng: Any
) -> tuple[Float64, Float64]:
    """Return the points of strands at each step, (k, s, 3), and the lengths so far, (k, s) metres."""
    flow = Flow(scalp, style)
    at = at + scalp.lift(at)[1] * LEAST / 2
    run, go, alive = np.zeros(len(at)), flow(at), np.ones(len(at), bool)
    lines, runs = [at], [run]
    ends = scalp.height(style.ends, at) + style.uneven * rng.uniform(-1, 1, len(at))
    while alive.any():
        go = unit(go * (1 - style.soft) + _heading(scalp, style, at, flow(at)) * style.soft)
        step = np.where(alive, np.minimum(STEP, length - run), 0)
        last, at = at, at + go * step[:, None]
        push = _push(scalp, style, at, layer, (run + STEP) * style.lift)
        at = _keep_off_face(at + np.where(step > 0, 1, 0)[:, None] * push, style)
        run = run + np.linalg.norm(at - last, axis=1)
        lines.append(at)
        runs.append(run)
        beyond = edge(scalp, style, at) < -style.over * rng.uniform(0.3, 1.0, len(at))
        alive &= (run < length) & (at[:, 1] >= ends) & ~(beyond & (style.heavy == 0))
        alive &= len(lines) * STEP < 2 * length
    return np.stack(lines), np.stack(runs)


def _heading(scalp: Scalp, style: Style, at: Float64, along: Float64) -> Float64:
    """Return the direction of growth, (n, 3): along the skull, down where it turns away, then inwards."""
    skull = unit(at - scalp.middle)
    heavy = style.heavy * smooth(skull[:, 1], 0.45, -0.15)[:, None]
    below = style.heavy * smooth(at[:, 1], -0.03, -0.09)[:, None]
    return unit(unit(along * (1 - heavy) + DOWN * heavy) - skull * [1, 0, 1] * style.tuck * below)


def _push(scalp: Scalp, style: Style, at: Float64, layer: Float64, rise: Float64) -> Float64:
    """Return the displacements (n, 3) of strands towards the height of their layer, at most `rise`."""
    lift, normals = scalp.lift(at)
    hang = style.heavy * smooth(edge(scalp, style, at), 0.012, -0.004)
    height = thickness(scalp, style, at) * (1 - style.depth + style.depth * layer)
    height = np.minimum(rise, height).clip(LEAST)
    height = height * (1 - hang) + np.maximum(style.body * (0.4 + 0.6 * layer), height) * hang
    ear = style.heavy * smooth(scalp.ear_distance(at), 0.030, -0.004)
    height += EAR * ear
    push = np.maximum(height - lift, (height - lift) * (1 - hang)).clip(-STEP / 2, STEP / 2)
    skull = unit(at - scalp.middle) * np.maximum(style.heavy * smooth(at[:, 1], -0.07, -0.03), ear)[:, None]
    # The normals of an ear would part the hair over it.
    return (
        unit(normals * (1 - ear)[:, None] + 2 * skull) * np.where(scalp.distance(at) < NEAR, push, 0)[:, None]
    )


def _is_misplaced(scalp: Scalp, style: Style, positions: Float64) -> Bool:
    """Return which strands (s,) hang before the face, are off the crown or in it, or bend sharply."""
    flat = positions.reshape(-1, 3)
    lift = scalp.lift(flat)[0]
    excess = lift - 1.3 * thickness(scalp, style, flat) - 0.002
    misplaced = (positions[..., 2] > 0.045) & (positions[..., 1] < 0.04)
    misplaced |= lift.reshape(misplaced.shape) < -DEEPEST  # in the nape
    misplaced |= (excess.reshape(misplaced.shape) > 0) & (positions[..., 1] > 0.06)
    misplaced |= (edge(scalp, style, flat).reshape(misplaced.shape) < -0.010) & (positions[..., 1] > 0.045)
    tangents = unit(np.diff(positions, axis=1))
    bent = (tangents[:, 1:] * tangents[:, :-1]).sum(axis=2).min(axis=1) < SHARPEST
    return np.asarray(misplaced.any(axis=1) | bent)


def _hair_normals(scalp: Scalp, positions: Float64) -> Float64:
    """Return the normals of the hair: radial from the skull's middle, below from the axis of the neck."""
    out = positions - scalp.middle
    out[..., 1] *= smooth(positions[..., 1], -0.06, 0.02)
    return unit(out)


def _keep_off_face(at: Float64, style: Style) -> Float64:
    """Return points moved sideways where hair would hang before the face."""
    if not style.heavy:
        return at
    limit = np.interp(at[:, 1], (-0.14, -0.05, 0.03, 0.075), (0.050, 0.058, 0.050, 0.0))
    limit = limit * smooth(at[:, 2], -0.03, 0.01)
    side = np.where(at[:, 0] < 0, -1.0, 1.0)
    out = at.copy()
    out[:, 0] = side * np.maximum(np.abs(at[:, 0]), limit)
    return out
