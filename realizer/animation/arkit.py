"""Conversion of AU frames to ARKit: weights of its 52 blend shapes, rotations of head and eyes."""

import re
from dataclasses import dataclass
from functools import cache

import numpy as np

from realizer.animation.axis import AU_NAMES, axis, mask_channel
from realizer.animation.fap.conversion import FapMapping, to_fap
from realizer.animation.frames import AUFrames
from realizer.core.array_types import Float32, Float64
from realizer.core.units import ANGLE_UNIT
from realizer.tables import csv_rows, faps
from realizer.tables.arkit_names import shapes

# Approximate millimetres a unit on an adult face; for angles, on an eyeball with a radius of 12 mm.
MILLIMETRES = {
    "none": 0.0, "MNS": 0.022, "MW": 0.05, "ENS": 0.044, "ES": 0.06, "IRISD": 0.011, "angle_unit": 1.2e-4,
}  # fmt: skip
# FAPs that no shape shows: the head, the tongue inside the mouth, pupils and nostrils.
UNMAPPED = (29, 30, 43, 44, 46, 47, 48, 49, 50)
RIDGE = 0.15  # mm^2: prefers solutions close to the weights of the action units
STEPS, TOLERANCE = 400, 1e-4
CHECK = 5  # steps; how often frames are taken out that have converged
RELAXED = 1.8  # over-relaxation; values above 1 converge faster
JAW = (3, 14, 15)
CLOSE, OPEN = "mouthClose", "jawOpen"
CHUNK = 4096  # frames at once


@dataclass(frozen=True, slots=True)
class _Slide:
    name: str
    fap: int
    value: float


@dataclass(frozen=True, eq=False)
class ArkitFrames:
    """The animation of an ARKit head."""

    times: Float64  # (n,) float64 seconds
    weights: Float32  # (n, 52) float32, 0..1; columns as `ARKIT_NAMES()`
    head: Float32  # (n, 3) float32 radians: yaw to the character's left, pitch down, roll to its right
    eyes: Float32  # (n, 2, 2) float32 radians: left and right eye; yaw to the character's left, pitch down


@cache
def ARKIT_NAMES() -> tuple[str, ...]:
    """Return the names of ARKit's 52 shapes, such as "jawOpen", in alphabetical order."""
    return tuple(sorted(shapes()))


def arkit(frames: AUFrames, mapping: FapMapping | None = None) -> ArkitFrames:
    """Return the ARKit weights that reproduce AU frames, independently for each frame.

    Shapes that correspond to action units copy their intensity (`arkit.csv`), reduced where speech owns the
    lips. The rest (speech, FAPs of clients, action units without a shape) is fitted from the remaining FAPs:
    bounded least squares in millimetres at the feature points, with a ridge towards the copied weights. The
    minimum is unique; the alternating direction method of multipliers (Boyd et al. 2011, 5.2) finds it for
    all frames at once. Without a mapping from AUs to FAPs, it is the built-in one.
    """
    whole = to_fap(frames, mapping).values
    columns, share, owned = _from_aus(mapping)
    lips = frames.values[:, mask_channel("lips").column, None]
    moving = frames.moving.T
    first = moving @ share * (1 - owned * lips)
    covered = frames.values.copy()
    covered[:, : len(AU_NAMES()) + 68] = 0
    covered[:, columns] = moving[:, columns]
    rest = whole - to_fap(AUFrames(frames.times, covered, overridden=frames.overridden), mapping).values
    weights = np.empty((len(whole), len(ARKIT_NAMES())), np.float32)
    for start in range(0, len(whole), CHUNK):
        part = slice(start, start + CHUNK)
        weights[part] = _fit(first[part].astype(np.float64), rest[part], mapping)
    turns = whole * np.float32(ANGLE_UNIT)
    return ArkitFrames(
        frames.times,
        weights,
        np.ascontiguousarray(turns[:, [48, 47, 49]]),
        np.stack([turns[:, [22, 24]], turns[:, [23, 25]]], axis=1),
    )


def warm_up(mapping: FapMapping | None = None) -> None:
    """Read the tables and invert the matrices in advance, so that they do not delay the first frames."""
    _from_aus(mapping)
    _system(mapping)


def _fit(first: Float64, rest: Float32, mapping: FapMapping | None) -> Float64:
    """Return weights (n, 52), 0..1, that best show `first` plus the FAPs `rest` (n, 68)."""
    moves, inverse, penalised = _system(mapping)
    out = np.clip(first, 0, 1)
    aim = rest @ moves.T
    # Frames without a remainder keep their weights exactly.
    busy = np.flatnonzero(np.abs(aim).max(axis=1, initial=0) > 1e-9)
    low, high, aim = -out[busy], 1 - out[busy], aim[busy] @ inverse
    change, dual = np.zeros_like(aim), np.zeros_like(aim)
    for step in range(STEPS):
        free = RELAXED * (aim + (change - dual) @ penalised) + (1 - RELAXED) * change
        dual += free
        before, change = change, np.minimum(np.maximum(dual, low), high)
        dual -= change
        if step % CHECK == 0:
            error = np.maximum(np.abs(change - before), np.abs(free - change)).max(axis=1, initial=0)
            left = error >= TOLERANCE
            out[busy[~left]] += change[~left]
            busy, low, high, aim, change, dual = (a[left] for a in (busy, low, high, aim, change, dual))
            if not len(busy):
                break
    out[busy] += change
    return np.clip(out, 0, 1)


@cache
def _system(mapping: FapMapping | None) -> tuple[Float64, Float64, Float64]:
    """Return the matrices of `_fit`: gradients of the weights by FAPs (52, 68), and two of (52, 52).

    They are the inverse of the normal equations plus the penalties, and its product with the penalties.
    """
    scale = np.array([0.0 if row.fap in UNMAPPED else MILLIMETRES[row.unit] for row in faps()])
    moves = shape_faps(mapping) * scale
    square = moves @ moves.T + RIDGE * np.eye(len(moves))
    sizes = np.linalg.eigvalsh(square / np.sqrt(np.outer(square.diagonal(), square.diagonal())))
    penalties = np.diag(square.diagonal() * np.sqrt(sizes[0] * sizes[-1]))
    inverse = np.linalg.inv(square + penalties)
    return moves * scale, inverse, penalties @ inverse


@cache
def _from_aus(mapping: FapMapping | None) -> tuple[list[int], Float32, Float32]:
    """Return the AUs that have shapes, their share of each shape (n_au, 52), and speech's share (52,)."""
    share = np.zeros((len(AU_NAMES()), len(ARKIT_NAMES())), np.float32)
    for k, name in enumerate(ARKIT_NAMES()):
        for column in _columns(shapes()[name].au, shapes()[name].side):
            # A shape that spans both sides shows their mean.
            share[column, k] = 1 / len(_columns(shapes()[name].au, shapes()[name].side))
    effects = np.abs(shape_faps(mapping)) * [MILLIMETRES[row.unit] for row in faps()]
    own = np.array([row.speech_owns for row in faps()])
    size = effects.sum(axis=1)
    return (
        np.flatnonzero(share.any(axis=1)).tolist(),
        share,
        np.divide(effects @ own, size, out=np.zeros_like(size), where=size > 0).astype(np.float32),
    )


def _columns(au: int, side: str) -> list[int]:
    """Return the columns of an action unit on a shape's side; none for AU 0."""
    names = [f"{au}", f"{au}{side}"] if side else [f"{au}", f"{au}L", f"{au}R"]
    return [axis()[name].column for name in names if name in AU_NAMES()]


@cache
def _side_share(side: str) -> Float32:
    """Return the part (68,) of each FAP that a one-sided shape moves: 1 on its side, 0.5 in the middle."""
    sides = [re.search(r"_([lr])m?(_|$)", row.name) for row in faps()]
    return np.array([0.5 if found is None else found[1] == side.lower() for found in sides], np.float32)


@cache
def shape_faps(mapping: FapMapping | None) -> Float32:
    """Return the FAPs (52, 68), in FAPU, of each shape at weight 1, derived from its action unit."""
    names = ARKIT_NAMES()
    values = np.zeros((len(names), len(axis())), np.float32)
    for row, name in zip(values, names, strict=True):
        row[_columns(shapes()[name].au, shapes()[name].side)] = shapes()[name].intensity
    effects = to_fap(AUFrames(np.zeros(len(names)), values), mapping).values
    for k, name in enumerate(names):
        if shapes()[name].side:
            effects[k] *= _side_share(shapes()[name].side)
    for slide in csv_rows("arkit_slides.csv", _Slide):
        effects[names.index(slide.name), slide.fap - 1] = slide.value
    lips = -effects[names.index(OPEN)]
    lips[[fap - 1 for fap in JAW]] = 0
    effects[names.index(CLOSE)] = lips
    return effects
