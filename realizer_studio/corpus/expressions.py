"""Expressions of a corpus as entries of the expression library: action units and timing."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from realizer.animation.axis import au_row
from realizer.core.array_types import Float64
from realizer.core.atomic_files import write_text
from realizer.tables import action_units, au_to_fap
from realizer.tables.lexemes import SIDES
from realizer.tables.templates import PREFIX
from realizer.tables.timing import gaps
from realizer_studio.corpus.face_map import explain, faps_of, features
from realizer_studio.corpus.recording import Recording, Segment
from realizer_studio.corpus.statistics import FEWEST, Study

FOLDER = "expressions"
FACE_UNITS = range(1, 51)  # action units of the face; the others move head and eyes
MOST, LEAST_GAIN = (
    6,
    0.04,
)  # units of an expression at most; least share of its squared displacement that a unit explains
LEAST = 0.1  # intensity of a unit
RISING = 0.1, 0.9  # of a segment's strength; onset and offset are measured between these
AROUND = 1.0  # s before and after a segment that are searched for onset and offset
PROBABLE = 25, 75  # percentiles of the lengths of segments, the ends of the probable range


@dataclass(frozen=True)
class Found:
    """An expression of a corpus.

    Attributes:
        aus: unit such as "12" or "12L" -> intensity 0..1.
        gaps: seconds of onset, apex and offset.
        possible, probable: ranges of its duration in seconds; None for too few segments.
        source: a sentence about its origin.
    """

    name: str
    aus: Mapping[str, float]
    gaps: tuple[float, float, float]
    possible: tuple[float, float] | None
    probable: tuple[float, float] | None
    source: str


def found_expressions(study: Study) -> list[Found]:
    """Return the expressions of recordings with FAPs, most frequent first.

    The median face of all segments is approximated by a few action units (matching pursuit, with
    intensities by non-negative least squares). Onset and offset are the median times from 10 to 90 % of a
    segment's strength and back.
    """
    face_frames = {id(one): features(one) for one in study.recordings if one.faps is not None}
    found = []
    for name in study.totals:
        occurrences = [
            (recording, one)
            for recording, segments in study.parts
            for one in segments
            if one.text == name
            and id(recording) in face_frames
            and one.first < len(face_frames[id(recording)])
        ]
        if not occurrences:
            continue
        faces = [np.median(face_frames[id(r)][one.first : one.last + 1], axis=0) for r, one in occurrences]
        face = np.median(faces, axis=0)
        if aus := units_of(face):
            ramps = [
                _ramps(face_frames[id(r)] @ face / max(float(face @ face), 1e-12), one, r)
                for r, one in occurrences
            ]
            found.append(
                _expression_of(
                    name, aus, np.median(ramps, axis=0), [len(one) / r.fps for r, one in occurrences]
                )
            )
    return found


def units_of(face: Float64) -> dict[str, float]:
    """Return the action units that explain a face (68,) in millimetres, as `face_map.features` returns it."""
    names, unit_faces = _units()
    chosen, weights = explain(face[None], unit_faces, MOST, LEAST_GAIN)
    pairs = sorted(zip(chosen, weights[0].tolist(), strict=True))
    return {names[k]: round(min(weight, 1.0), 2) for k, weight in pairs if weight >= LEAST}


def write_expressions(folder: Path, study: Study) -> list[str]:
    """Write a file of the expression library for each expression, and return their names."""
    names: list[str] = []
    for one in found_expressions(study):
        name = f"{FOLDER}/{re.sub(r'[^a-z0-9]+', '-', one.name.lower()).strip('-') or len(names)}.toml"
        (folder / FOLDER).mkdir(exist_ok=True)
        write_text(folder / name, _toml(one))
        names.append(name)
    return names


@cache
def _units() -> tuple[tuple[str, ...], Float64]:
    """Return names and FAP displacements (n, 68), mm, of action units of both sides and of each side."""
    moving = {row.au for row in au_to_fap()} & {*FACE_UNITS}
    keys = [
        (row.au, side)
        for row in action_units()
        if row.au in moving
        for side in (SIDES if row.sides else ("",))
    ]
    unit_faps = faps_of(np.stack([au_row({(number, SIDES[side]): 1.0}) for number, side in keys]))
    return tuple(f"{number}{side}" for number, side in keys), features(Recording("", faps=unit_faps))


def _ramps(strength: Float64, one: Segment, recording: Recording) -> tuple[float, float]:
    """Return the seconds of a segment's onset and offset."""
    top = float(np.quantile(strength[one.first : one.last + 1], 0.9))
    around = round(AROUND * recording.fps)
    before = strength[max(one.first - around, 0) : one.last + 1]
    after = strength[one.first : one.last + 1 + around][::-1]
    low, high = (part * top for part in RISING)
    frames = []
    for part in (before, after):
        full = int(np.argmax(part >= high))
        frames.append(full - int(np.flatnonzero(np.r_[True, part[: full + 1] <= low])[-1]) + 1)
    return frames[0] / recording.fps, frames[1] / recording.fps


def _expression_of(name: str, aus: Mapping[str, float], ramps: Float64, lengths: list[float]) -> Found:
    """Return an expression that is visible for the median length, including half of its onset and offset."""
    least = [gap.least for gap in gaps("face").gaps]
    onset, offset = max(float(ramps[0]), least[0]), max(float(ramps[1]), least[2])
    visible = float(np.median(lengths))
    apex = max(visible - onset / 2 - offset / 2, least[1])
    visible_part = apex + onset / 2 + offset / 2
    possible = probable = None
    if len(lengths) >= FEWEST:
        possible = min(*lengths, visible_part), max(*lengths, visible_part)
        low, high = np.percentile(lengths, PROBABLE).tolist()
        probable = (low, high) if low < high else None
    source = f"median of {len(lengths)} segments of a corpus, by `realizer corpus describe`"
    return Found(name, aus, (onset, apex, offset), possible if probable else None, probable, source)


def _toml(one: Found) -> str:
    """Return the file of an expression, which has the name that `enrich` uses."""
    units = ", ".join(f"{unit} = {value:g}" for unit, value in one.aus.items())
    rows = {"name": json.dumps(PREFIX + one.name, ensure_ascii=False), "aus": f"{{ {units} }}"}
    rows["means"] = json.dumps([one.name], ensure_ascii=False)
    rows |= {
        key: f"{seconds:.3f}" for key, seconds in zip(("onset", "apex", "offset"), one.gaps, strict=True)
    }
    for key, ends in (("possible", one.possible), ("probable", one.probable)):
        if ends is not None:
            # Four digits, so that the probable range stays within the possible one.
            rows[key] = f"[{ends[0]:.4f}, {ends[1]:.4f}]"
    rows["source"] = json.dumps(one.source)
    return "".join(f"{key} = {value}\n" for key, value in rows.items())
