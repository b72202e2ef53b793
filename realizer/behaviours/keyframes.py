"""facekeyframe: BMLT's keyframes of FAPs, action units or morphs as channels; documents of FAP clips."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from bml_schema import Block, FaceInterpolator, FaceKeyframe, Required, write
from realizer import tables
from realizer.animation.axis import Target, au, fap
from realizer.animation.channel import Channel
from realizer.animation.fap.fap_clip import FAPClip
from realizer.behaviours import pose_channels
from realizer.behaviours.fap_values import RECORDED, out_of_range
from realizer.behaviours.kind import BehaviourKind, Fault, PlanningContext
from realizer.behaviours.pose_channels import track
from realizer.core.array_types import Float64
from realizer.core.errors import RealizerError
from realizer.scheduling.timing import Timing
from realizer.tables.arkit_names import canonical, shapes
from realizer.tables.lexemes import SIDES, face_lexemes

NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?")
PLAIN = re.compile(r"[0-9.eE+\-\s]*")  # the characters of numbers; float accepts more
MOST = 1e6
PART = {
    "MORPH": re.compile(r"\S{1,100}"),
    "FAPS": re.compile(r"\d{1,3}"),
    "FACS": re.compile(r"(\d{1,3})(?:\.(LEFT|RIGHT|BOTH))?", re.IGNORECASE),
}
WANTED = {
    "MORPH": 'names of morphs such as "mouthSmileLeft SMILE"',
    "FAPS": 'FAP numbers 3..68 such as "31 32"',
    "FACS": 'action units such as "1.BOTH 12.LEFT"',
}


# The number of a FAP, an AU with its side, or the name of a morph.
KeyPart: TypeAlias = int | tuple[int, str] | str

VALUES = {"FACS": "action units", "MORPH": "morphs"}


class KeyframeError(Exception):
    """A facekeyframe that cannot be played; the message has the fault."""


@dataclass(frozen=True, eq=False)
class Keys:
    """The keys of a <FaceInterpolator>."""

    parts: tuple[KeyPart, ...]  # of each column
    times: Float64  # (k,) seconds, rising
    values: Float64  # (k, number of parts); FAPs in FAPU, AUs 0..1


def timing(node: FaceKeyframe, context: PlanningContext) -> Timing:
    """Return the duration from its first to its last key; it can stretch."""
    times = keys_of(node).times
    return Timing(("start", "end"), times[-1:] - times[0], np.zeros(1), np.array([RECORDED]))


def expand(node: FaceKeyframe, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels through its keys from start to end, with eased beginning and end."""
    keys = keys_of(node)
    first, last = keys.times[0], keys.times[-1]
    at = times[0] + (keys.times - first) * ((times[-1] - times[0]) / (last - first))
    channels = []
    for column, part in enumerate(keys.parts):
        values = keys.values[:, column]
        # A FAP of 0 is held at 0; an action unit of 0 has no effect.
        shown = values.any() or isinstance(part, int)
        channels += [track(t, at, values * share, node.id) for t, share in _targets(part) if shown]
    return tuple(channels)


def check(node: FaceKeyframe, context: PlanningContext) -> tuple[Fault, ...]:
    """Return faults: unreadable keys are fatal, a FAP out of range and unknown morphs are not."""
    try:
        keys = keys_of(node)
    except KeyframeError as error:
        return (Fault("CANNOT_CREATE_BEHAVIOR", str(error)),)
    least, most = keys.values.min(axis=0), keys.values.max(axis=0)
    if unknown := [part for part in keys.parts if isinstance(part, str) and not _targets(part)]:
        names = ", ".join(unknown[:10])
        text = f"parts: wanted morphs of ARKit, face lexemes or action units such as AU12, got {names}"
        return (Fault("CUSTOM_ATTRIBUTE_NOT_SUPPORTED", f"{text}; they do not move", fatal=False),)
    return tuple(
        fault
        for column, part in enumerate(keys.parts)
        if isinstance(part, int)
        for fault in out_of_range(part, float(least[column]), float(most[column]))
    )


def claims(node: FaceKeyframe, context: PlanningContext) -> frozenset[str]:
    """Return claims on its FAPs, which replace each other; AUs blend."""
    return frozenset(f"FAP {part}" for part in keys_of(node).parts if isinstance(part, int))


def keys_of(node: FaceKeyframe) -> Keys:
    """Return its keys; raises KeyframeError."""
    if node.interpolator is None:
        raise KeyframeError(f"wanted <FaceInterpolator parts=...> with keys of {WANTED[node.type]}, got none")
    return _read(node.type, node.interpolator.parts, node.interpolator.keys)


@lru_cache(maxsize=64)
def _read(type: str, parts: str, text: str) -> Keys:
    columns = _parts(type, parts)
    lines = [line.split() for line in text.splitlines() if line.strip()]
    if len(lines) < 2:
        raise KeyframeError(f"keys: wanted at least two lines, got {len(lines)}")
    rows = _at_once(lines, len(columns) + 1) if PLAIN.fullmatch(text) else None
    if rows is None or (type != "FAPS" and not ((rows[:, 1:] >= 0) & (rows[:, 1:] <= 1)).all()):
        rows = _by_lines(type, lines, len(columns))
    return Keys(columns, rows[:, 0], rows[:, 1:])


def _at_once(lines: list[list[str]], width: int) -> Float64 | None:
    """Return (k, width) numbers, or None if one is wrong; long tables need this speed."""
    if any(len(words) != width for words in lines):
        return None
    try:
        rows = np.array([[float(word) for word in words] for words in lines])
    except ValueError:
        return None
    sound = (np.abs(rows) <= MOST).all() and (np.diff(rows[:, 0]) > 0).all()
    return rows if sound else None


def _by_lines(type: str, lines: list[list[str]], count: int) -> Float64:
    """Return (k, 1 + count) numbers; raise KeyframeError for the first wrong line."""
    before = -np.inf
    rows = np.empty((len(lines), count + 1))
    for row, words in enumerate(lines):
        place, got = f"line {row + 1} of the keys", " ".join(words)[:60]
        wanted = f"wanted a time and {count} value{'s' * (count != 1)}"
        if len(words) != count + 1 or not all(map(NUMBER.fullmatch, words)):
            raise KeyframeError(f"{place}: {wanted}, got {got!r}")
        rows[row] = [float(word) for word in words]
        if not np.all(np.abs(rows[row]) <= MOST):
            raise KeyframeError(f"{place}: wanted numbers within a million, got {got!r}")
        if rows[row, 0] <= before:
            raise KeyframeError(f"{place}: wanted a time after {before:g}, got {words[0]}")
        if type != "FAPS" and not (np.all(rows[row, 1:] >= 0) and np.all(rows[row, 1:] <= 1)):
            raise KeyframeError(f"{place}: wanted {VALUES[type]} 0..1, got {got!r}")
        before = rows[row, 0]
    return rows


def _parts(type: str, text: str) -> tuple[KeyPart, ...]:
    known = tables.by_number()
    parts: list[KeyPart] = []
    for word in text.replace(",", " ").split():
        match = PART[type].fullmatch(word)
        part: KeyPart | None = None
        if match and type == "MORPH":
            part = word
        elif match and type == "FAPS":
            part = int(word) if 3 <= int(word) <= 68 else None
        elif match and int(match[1]) in known:
            sides = known[int(match[1])].sides
            part = (int(match[1]), (match[2] or "BOTH").upper() if sides else "BOTH")
        if part is None:
            raise KeyframeError(f"parts: wanted {WANTED[type]}, got {word[:60]!r}")
        if part in parts:
            raise KeyframeError(f"parts: wanted each once, got {word!r} twice")
        parts.append(part)
    return tuple(parts)


def _targets(part: KeyPart) -> tuple[tuple[Target, float], ...]:
    """Return what a part moves, with shares; () for an unknown morph."""
    if isinstance(part, int):
        return ((fap(part), 1.0),)
    if isinstance(part, tuple):
        return tuple((target, 1.0) for target in au(*part))
    return tuple(pose_channels.columns(_morph(part), 1.0).items())


def _morph(name: str) -> Mapping[tuple[int, str], float]:
    """Return (AU, side) -> intensity of a morph that is one of ARKit, a face lexeme or an action unit."""
    if (lexeme := face_lexemes().get(name.upper())) is not None:
        return lexeme.aus
    unit = re.fullmatch(r"AU_?(\d{1,3})_?(L|R|LEFT|RIGHT)?", name, re.IGNORECASE)
    if unit and int(unit[1]) in tables.by_number():
        side = {"L": "LEFT", "R": "RIGHT"}.get((unit[2] or "").upper()[:1], "BOTH")
        return {(int(unit[1]), side if tables.by_number()[int(unit[1])].sides else "BOTH"): 1.0}
    arkit = canonical(name)
    shape = None if arkit is None else shapes()[arkit]
    return {(shape.au, SIDES[shape.side]): shape.intensity} if shape is not None and shape.au else {}


KINDS = (BehaviourKind(FaceKeyframe, timing, expand, check, claims=claims, parameters={"amount": 1.0}),)


def document_of(clip: FAPClip, block: str) -> str:
    """Return BML text with the clip as keys, a line each; FAPs are limited to the range of the standard.

    FAPs that the clip defines are held, also at 0. FAP 1 and 2 are left out. The behaviour `fap` is required.

    Raises:
        RealizerError: fewer than two frames, or no FAP from 3 on.
    """
    columns = np.flatnonzero(clip.mask[2:]) + 2
    if len(clip.values) < 2 or not len(columns):
        got = f"{len(clip.values)} frames of {len(columns)} FAPs"
        raise RealizerError(f"wanted at least two frames of a FAP from 3 on, got {got}")
    rows = [tables.faps()[column] for column in columns]
    values = np.clip(clip.values[:, columns], [r.least for r in rows], [r.most for r in rows]).astype(int)
    lines = [
        " ".join(map(str, (f"{number / clip.fps:.9g}", *row))) for number, row in enumerate(values.tolist())
    ]
    keys = "\n".join(["", *lines, ""])
    parts = " ".join(str(column + 1) for column in columns)
    node = FaceKeyframe(id="fap", type="FAPS", interpolator=FaceInterpolator(parts=parts, keys=keys))
    return write(Block(id=block, children=(Required(children=(node,)),)))
