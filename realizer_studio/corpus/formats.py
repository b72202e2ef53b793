"""Readers and writers of other programs' files that belong to a recording."""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from realizer.animation.axis import au, axis
from realizer.animation.fap.fap_reader import read_fap
from realizer.core.array_types import Float64
from realizer.core.errors import FaceError, RealizerError
from realizer.core.json_reader import parse_json
from realizer.face.features import fapu_of
from realizer.outputs.speech_spans import Span
from realizer.outputs.textgrid import intervals_text
from realizer.tables import faps
from realizer.tables.arkit_names import shapes
from realizer.tables.lexemes import SIDES
from realizer_studio.analysis.faps_from_points import COLUMNS as POINT_COLUMNS
from realizer_studio.analysis.faps_from_points import bridge, faps_from_points, read_points
from realizer_studio.corpus.face_map import faps_of
from realizer_studio.corpus.recording import (
    COLUMNS,
    LABELS,
    WORDS,
    Annotation,
    CorpusError,
    Recording,
    numbers,
    read_annotations,
    read_faps,
)
from realizer_studio.tracking.person_recording import rate_of

WORD_TIER = re.compile(r"words?\b\s*(.*)", re.IGNORECASE)
INTERVAL = re.compile(r'xmin = ([\d.eE+-]+)\s*xmax = ([\d.eE+-]+)\s*text = "((?:[^"]|"")*)"')
TIER = re.compile(r'class = "IntervalTier"\s*name = "((?:[^"]|"")*)"')
EAF = """\
<?xml version="1.0" encoding="UTF-8"?>
<ANNOTATION_DOCUMENT AUTHOR="" FORMAT="3.0" VERSION="3.0">
<HEADER MEDIA_FILE="" TIME_UNITS="milliseconds"/>
<TIME_ORDER>{slots}</TIME_ORDER>
{tiers}
<LINGUISTIC_TYPE LINGUISTIC_TYPE_ID="default" TIME_ALIGNABLE="true"/>
</ANNOTATION_DOCUMENT>
"""
# Errors of readers of damaged files; that of XML is a SyntaxError.
DAMAGE = (
    OSError,
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    RecursionError,
    SyntaxError,
    RealizerError,
)
Spans = Iterable[tuple[float, float, str]]


def read_part(path: Path) -> Recording:
    """Return the part of a recording in a file: FAPs, points, labels or words.

    - .csv: labels, words, FAPs or action units as this project writes them, tracked points, OpenFace's
      features, or Live Link's blend shapes;
    - .fap: FAPs;
    - .eaf (ELAN) and .TextGrid (Praat): tiers of intervals; a tier `words` or `words SPEAKER` has words, any
      other labels by the annotator of its name;
    - .json: results of MediaPipe's face landmarker, or words of `realizer align`.

    Raises:
        CorpusError: another file, or one that is damaged.
    """
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise CorpusError(f"{path}: wanted a file that ends in {', '.join(READERS)}, got another")
    try:
        text = path.read_text("utf-8-sig")
        if not text.strip():
            raise ValueError("an empty file; save or copy it again")
        return reader(text)
    except DAMAGE as error:
        raise CorpusError(
            f"{path}: wanted a file of one of the formats in docs/corpus.md, got: {error}"
        ) from None


def write_annotations(path: Path, recording: Recording) -> None:
    """Write labels and words as .eaf of ELAN or .TextGrid of Praat; raises CorpusError."""
    tiers: dict[str, list[Annotation]] = {}
    named = [(one.by or "labels", one) for one in recording.labels]
    named += [(f"words {one.by}".strip(), one) for one in recording.words]
    for name, one in sorted(named, key=lambda pair: (pair[1].start, pair[1].end)):
        number, tier = 1, name  # overlapping annotations go to another tier with a number
        while tier in tiers and tiers[tier][-1].end > one.start + 1e-6:
            number += 1
            tier = f"{name} ({number})"
        tiers.setdefault(tier, []).append(one)
    if path.suffix.lower() not in (".eaf", ".textgrid"):
        raise CorpusError(f"{path}: wanted a name that ends in .eaf or .TextGrid")
    if path.suffix.lower() == ".eaf":
        path.write_text(_eaf(tiers), "utf-8")
        return
    spans = {name: [Span(one.start, one.end, one.text) for one in tier] for name, tier in tiers.items()}
    path.write_text(intervals_text(spans, recording.frames / recording.fps), "utf-8")


def merged(recording: Recording, part: Recording) -> Recording:
    """Return a recording with the data of another one, whose labels and words are added."""
    return replace(
        recording,
        meta={**recording.meta, **part.meta},
        labels=tuple(dict.fromkeys((*recording.labels, *part.labels))),
        words=tuple(dict.fromkeys((*recording.words, *part.words))),
        faps=part.faps if part.faps is not None else recording.faps,
        points=part.points if part.points is not None else recording.points,
    )


def _csv(text: str) -> Recording:
    head = [cell.strip() for cell in text.partition("\n")[0].split(",")]
    if head == COLUMNS[LABELS]:
        return Recording("", labels=read_annotations(text))
    if head == COLUMNS[WORDS]:
        return Recording("", words=read_annotations(text))
    if head == POINT_COLUMNS or text.startswith("#"):
        moving, rest = read_points(text, names=None)
        if not moving:
            raise ValueError("points without a row")
        tracked = tuple(moving), np.stack(list(moving.values()), axis=1)
        try:
            fapu = fapu_of({name: position.astype(np.float32) for name, position in rest.items()})
        except (KeyError, FaceError):  # too few points for FAPs
            return Recording("", points=tracked)
        return Recording(
            "", faps=faps_from_points(bridge(moving), rest, fapu)[0].astype(float), points=tracked
        )
    columns = {name: np.nan_to_num(cells) for name, cells in numbers(text).items()}
    if "AU01_r" in head:  # OpenFace: intensities of 0 to 5; landmarks in space, y down and z away
        units = {
            (int(name[2:4]), "BOTH"): columns[name] / 5 for name in head if re.fullmatch(r"AU\d\d_r", name)
        }
        marks = tuple(name[2:] for name in head if re.fullmatch(r"X_\d+", name))
        coordinates = np.array([[columns[f"{side}_{mark}"] for mark in marks] for side in "XYZ"])
        points = (marks, coordinates.transpose(2, 1, 0) * [1.0, -1.0, -1.0]) if marks else None
        return Recording("", {"fps": rate_of(columns["timestamp"])}, faps=_faps_of(units), points=points)
    if "blendshapecount" in map(str.lower, head):  # Live Link: names with a capital, 60 frames a second
        weights = {name[:1].lower() + name[1:]: cells for name, cells in columns.items()}
        return Recording("", {"fps": 60.0}, faps=_faps_of(_units_of(weights)))
    if "time" in head and not {row.name for row in faps()} & {*head}:  # action units of `realizer track`
        named = ((re.fullmatch(r"AU(\d+)([LR]?)", name), name) for name in head)
        units = {(int(match[1]), SIDES[match[2]]): columns[name] for match, name in named if match}
        if units:
            return Recording("", {"fps": rate_of(columns["time"])}, faps=_faps_of(units))
    values, fps = read_faps(text)
    return Recording("", {"fps": fps}, faps=values)


def _fap(text: str) -> Recording:
    clip = read_fap(text)
    return Recording("", {"fps": float(clip.fps)}, faps=clip.values.astype(np.float64))


def _json(text: str) -> Recording:
    data = parse_json(text)
    if isinstance(data, dict):
        words = [Annotation(float(w["start"]), float(w["end"]), str(w["text"])) for w in data["words"]]
        return Recording("", words=tuple(words))
    rows, weights = [], []  # MediaPipe: a list of frames; the first face of each is read
    for frame in data:
        marks, blendshapes = (
            frame.get("faceLandmarks") or [[]],
            frame.get("faceBlendshapes") or [{"categories": []}],
        )
        rows.append([[mark["x"], -mark["y"], -mark.get("z", 0.0)] for mark in marks[0]])
        weights.append({one["categoryName"]: one["score"] for one in blendshapes[0]["categories"]})
    count = max(map(len, rows))
    points = np.array([row if len(row) == count else [[np.nan] * 3] * count for row in rows], np.float64)
    times = np.array([float(frame.get("timestamp", 40 * k)) / 1000 for k, frame in enumerate(data)])
    columns = {name: np.array([row.get(name, 0.0) for row in weights]) for name in set().union(*weights)}
    return Recording(
        "",
        {"fps": rate_of(times)},
        faps=_faps_of(_units_of(columns)) if columns else None,
        points=(tuple(map(str, range(count))), points) if count else None,
    )


def _units_of(weights: Mapping[str, Float64]) -> dict[tuple[int, str], Float64]:
    """Return the action units of weights of ARKit's shapes."""
    units: dict[tuple[int, str], Float64] = {}
    for shape in shapes().values():
        if shape.au and shape.name in weights:
            key = shape.au, SIDES[shape.side]
            units[key] = np.maximum(units.get(key, 0.0), weights[shape.name] * shape.intensity)
    return units


def _faps_of(units: Mapping[tuple[int, str], Float64]) -> Float64:
    count = len(next(iter(units.values()), ()))
    values = np.zeros((count, len(axis())), np.float32)
    for (number, side), intensities in units.items():
        for target in au(number, side):
            values[:, target.column] = np.maximum(values[:, target.column], np.clip(intensities, 0, 1))
    return faps_of(values)


def _spans(tiers: Mapping[str, Spans]) -> Recording:
    found: dict[bool, list[Annotation]] = {False: [], True: []}
    for name, spans in tiers.items():
        word = WORD_TIER.fullmatch(name.strip())
        by = re.sub(r" \(\d+\)$", "", (word[1] if word else name).strip())
        found[bool(word)] += [Annotation(a, b, text.strip(), by) for a, b, text in spans if text.strip()]
    if not any(found.values()):
        raise ValueError("no interval with a text")
    return Recording("", labels=tuple(found[False]), words=tuple(found[True]))


def _textgrid(text: str) -> Recording:
    pieces = [piece.replace('""', "\0") for piece in TIER.split(re.sub(r" *= *", " = ", text))[1:]]
    tiers = {
        name.replace("\0", '"'): [
            (float(a), float(b), label.replace("\0", '"')) for a, b, label in INTERVAL.findall(rest)
        ]
        for name, rest in zip(pieces[::2], pieces[1::2], strict=True)
    }
    return _spans(tiers)


def _read_eaf(text: str) -> Recording:
    root = ElementTree.fromstring(text.encode())
    slots = {s.attrib["TIME_SLOT_ID"]: int(s.attrib["TIME_VALUE"]) / 1000 for s in root.iter("TIME_SLOT")}

    def span(one: Any) -> tuple[float, float, str]:
        return (
            slots[one.attrib["TIME_SLOT_REF1"]],
            slots[one.attrib["TIME_SLOT_REF2"]],
            one.findtext("*") or "",
        )

    return _spans({t.attrib["TIER_ID"]: map(span, t.iter("ALIGNABLE_ANNOTATION")) for t in root.iter("TIER")})


def _eaf(tiers: Mapping[str, Iterable[Annotation]]) -> str:
    slots: list[str] = []
    parts = []
    for name, spans in tiers.items():
        rows = []
        for one in spans:
            refs = ""
            for number, seconds in enumerate((one.start, one.end), 1):
                refs += f' TIME_SLOT_REF{number}="ts{len(slots)}"'
                slots.append(f'<TIME_SLOT TIME_SLOT_ID="ts{len(slots)}" TIME_VALUE="{seconds * 1000:.0f}"/>')
            value = f"<ANNOTATION_VALUE>{escape(one.text)}</ANNOTATION_VALUE>"
            inner = (
                f'<ALIGNABLE_ANNOTATION ANNOTATION_ID="a{len(slots)}"{refs}>{value}</ALIGNABLE_ANNOTATION>'
            )
            rows.append(f"<ANNOTATION>{inner}</ANNOTATION>")
        parts.append(f'<TIER LINGUISTIC_TYPE_REF="default" TIER_ID={quoteattr(name)}>{"".join(rows)}</TIER>')
    return EAF.format(slots="".join(slots), tiers="\n".join(parts))


READERS: dict[str, Callable[[str], Recording]] = {
    ".csv": _csv, ".fap": _fap, ".json": _json, ".eaf": _read_eaf, ".textgrid": _textgrid,
}  # fmt: skip
