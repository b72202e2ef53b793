"""Files of other programs that belong to a recording: read by suffix and content, written by suffix."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from realizer.analysis.points_file import COLUMNS as POINT_COLUMNS
from realizer.analysis.points_file import read_points
from realizer.animation.axis import au, axis
from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames
from realizer.core.array_types import Float64
from realizer.corpus.recording import (
    COLUMNS,
    LABELS,
    WORDS,
    Annotation,
    CorpusError,
    Recording,
    annotations_text,
    rate_of,
    read_annotations,
    read_faps,
    read_text,
)
from realizer.outputs.textgrid import intervals_text
from realizer.tables.arkit_names import shapes

WORD_TIER = re.compile(r"words?\b\s*(.*)", re.IGNORECASE)
INTERVAL = re.compile(r'xmin\s*=\s*([\d.eE+-]+)\s*xmax\s*=\s*([\d.eE+-]+)\s*text\s*=\s*"((?:[^"]|"")*)"')
TIER = re.compile(r'class\s*=\s*"IntervalTier"\s*name\s*=\s*"((?:[^"]|"")*)"')
READ_ERRORS = (
    ValueError,
    KeyError,
    TypeError,
    IndexError,
    AttributeError,
    RecursionError,
    ElementTree.ParseError,
)


def read_part(path: Path) -> Recording:
    """Return what a file has of a recording: FAPs, points, labels or words.

    - .csv: our labels, words, FAPs (as `realizer realize -o x.csv` writes them) or tracked points, OpenFace's
      features, or Live Link's blend shapes;
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
        return reader(read_text(path), path)
    except READ_ERRORS as error:
        raise CorpusError(f"{path}: wanted {WANTED[path.suffix.lower()]}, got: {error}") from None


def write_annotations(path: Path, recording: Recording) -> None:
    """Write labels and words as .eaf or .TextGrid, or the labels as .csv.

    Raises:
        CorpusError: another suffix.
    """
    suffix = path.suffix.lower()
    if suffix == ".csv":
        text = annotations_text(LABELS, recording.labels)
    elif suffix == ".textgrid":
        text = intervals_text(_tiers(recording), recording.frames / recording.fps)
    elif suffix == ".eaf":
        text = _eaf(_tiers(recording))
    else:
        raise CorpusError(f"{path}: wanted a name that ends in .csv, .eaf or .TextGrid")
    path.write_text(text, "utf-8")


def merged(recording: Recording, part: Recording) -> Recording:
    """Return a recording with what another one has; its labels and words are added."""
    return replace(
        recording,
        meta={**recording.meta, **part.meta},
        labels=tuple(dict.fromkeys((*recording.labels, *part.labels))),
        words=tuple(dict.fromkeys((*recording.words, *part.words))),
        faps=part.faps if part.faps is not None else recording.faps,
        points=part.points if part.points is not None else recording.points,
    )


def _csv(text: str, path: Path) -> Recording:
    head = next(csv.reader(io.StringIO(text), skipinitialspace=True), [])
    if head == COLUMNS[LABELS]:
        return Recording(path.stem, labels=read_annotations(text, path))
    if head == COLUMNS[WORDS]:
        return Recording(path.stem, words=read_annotations(text, path))
    if head == POINT_COLUMNS or text.startswith("#"):
        moving, _ = read_points(text, str(path))
        return Recording(path.stem, points=(tuple(moving), np.stack(list(moving.values()), axis=1)))
    if "AU01_r" in head:
        return _open_face(_numbers(text), path)
    if "blendshapecount" in map(str.lower, head):
        # Live Link names shapes with a capital, and counts 60 frames a second.
        weights = {
            name[:1].lower() + name[1:]: np.nan_to_num(cells) for name, cells in _numbers(text).items()
        }
        return Recording(path.stem, {"fps": 60.0}, faps=_faps_of(_units_of(weights)))
    values, fps = read_faps(text, path)
    return Recording(path.stem, {"fps": fps}, faps=values)


def _numbers(text: str) -> dict[str, Float64]:
    """Return the columns of a CSV; cells that are no numbers are NaN."""

    def number(cell: str) -> float:
        try:
            return float(cell)
        except ValueError:
            return np.nan

    head, *body = csv.reader(io.StringIO(text), skipinitialspace=True)
    table = np.array([[number(cell) for cell in row] for row in body]).reshape(len(body), len(head))
    return {name: table[:, k] for k, name in enumerate(head)}


def _open_face(columns: Mapping[str, Float64], path: Path) -> Recording:
    """Intensities of OpenFace are 0 to 5; of its landmarks, those in space are taken."""
    units = {
        (int(name[2:4]), "BOTH"): np.nan_to_num(values) / 5.0
        for name, values in columns.items()
        if re.fullmatch(r"AU\d\d_r", name)
    }
    marks = [name[2:] for name in columns if re.fullmatch(r"X_\d+", name)]
    points = None
    if marks:
        places = np.array([[columns[f"{axis}_{mark}"] for mark in marks] for axis in "XYZ"])
        points = tuple(marks), places.transpose(2, 1, 0) * [1.0, -1.0, -1.0]  # y is down, z away
    return Recording(path.stem, {"fps": rate_of(columns["timestamp"])}, faps=_faps_of(units), points=points)


def _json(text: str, path: Path) -> Recording:
    data = json.loads(text)
    if isinstance(data, dict) and "words" in data:
        words = [Annotation(float(w["start"]), float(w["end"]), str(w["text"])) for w in data["words"]]
        return Recording(path.stem, words=tuple(words))
    return _media_pipe(data["frames"] if isinstance(data, dict) else data, path)


def _media_pipe(frames: list[Mapping[str, Any]], path: Path) -> Recording:
    """A list of frames, each with faceLandmarks and faceBlendshapes of its first face; empty where lost."""
    places, weights = [], []
    for frame in frames:
        marks, shown = frame.get("faceLandmarks") or [[]], frame.get("faceBlendshapes") or [[]]
        first = shown[0]["categories"] if isinstance(shown[0], Mapping) else shown[0]
        places.append([[mark["x"], -mark["y"], -mark.get("z", 0.0)] for mark in marks[0]])
        weights.append({one["categoryName"]: one["score"] for one in first})
    count = max(map(len, places))
    points = np.array([row if len(row) == count else [[np.nan] * 3] * count for row in places], np.float64)
    times = np.array([float(frame.get("timestamp", 40 * k)) / 1000 for k, frame in enumerate(frames)])
    names = {name for row in weights for name in row}
    columns = {name: np.array([row.get(name, 0.0) for row in weights]) for name in names}
    return Recording(
        path.stem,
        {"fps": rate_of(times)},
        faps=_faps_of(_units_of(columns)) if names else None,
        points=(tuple(map(str, range(count))), points) if count else None,
    )


def _units_of(weights: Mapping[str, Float64]) -> dict[tuple[int, str], Float64]:
    """Return the action units of weights of ARKit's shapes."""
    units: dict[tuple[int, str], Float64] = {}
    sides = {"L": "LEFT", "R": "RIGHT", "": "BOTH"}
    for shape in shapes().values():
        if shape.au and shape.name in weights:
            key = shape.au, sides[shape.side]
            units[key] = np.maximum(units.get(key, 0.0), weights[shape.name] * shape.intensity)
    return units


def _faps_of(units: Mapping[tuple[int, str], Float64]) -> Float64:
    count = len(next(iter(units.values()), ()))
    values = np.zeros((count, len(axis())), np.float32)
    for (number, side), intensities in units.items():
        for target in au(number, side):
            values[:, target.column] = np.maximum(values[:, target.column], np.clip(intensities, 0, 1))
    return to_fap(AUFrames(np.arange(count, dtype=np.float64), values)).values.astype(np.float64)


def _spans(tiers: Mapping[str, Iterable[tuple[float, float, str]]], path: Path) -> Recording:
    found: dict[bool, list[Annotation]] = {False: [], True: []}
    for name, spans in tiers.items():
        word = WORD_TIER.fullmatch(name.strip())
        by = word[1].strip() if word else re.sub(r" \(\d+\)$", "", name.strip())
        found[bool(word)] += [Annotation(a, b, text.strip(), by) for a, b, text in spans if text.strip()]
    if not any(found.values()):
        raise ValueError("no intervals with a text")
    return Recording(path.stem, labels=tuple(found[False]), words=tuple(found[True]))


def _textgrid(text: str, path: Path) -> Recording:
    pieces = TIER.split(text)[1:]  # name, rest, name, rest ...
    tiers = {
        name.replace('""', '"'): [
            (float(found[1]), float(found[2]), found[3].replace('""', '"'))
            for found in INTERVAL.finditer(rest)
        ]
        for name, rest in zip(pieces[::2], pieces[1::2], strict=True)
    }
    return _spans(tiers, path)


def _read_eaf(text: str, path: Path) -> Recording:
    root = ElementTree.fromstring(text.encode())
    slots = {s.attrib["TIME_SLOT_ID"]: int(s.attrib["TIME_VALUE"]) / 1000 for s in root.iter("TIME_SLOT")}
    tiers = {
        tier.attrib["TIER_ID"]: [
            (slots[a.attrib["TIME_SLOT_REF1"]], slots[a.attrib["TIME_SLOT_REF2"]], a.findtext("*") or "")
            for a in tier.iter("ALIGNABLE_ANNOTATION")
        ]
        for tier in root.iter("TIER")
    }
    return _spans(tiers, path)


def _tiers(recording: Recording) -> dict[str, list[Annotation]]:
    """Return labels and words by tier; what overlaps in a tier is in another one with a number."""
    tiers: dict[str, list[Annotation]] = {}
    named = [(one.by or "labels", one) for one in recording.labels]
    named += [(f"words {one.by}".strip(), one) for one in recording.words]
    for name, one in sorted(named, key=lambda pair: (pair[1].start, pair[1].end)):
        number, tier = 1, name
        while tier in tiers and tiers[tier][-1].end > one.start + 1e-6:
            number += 1
            tier = f"{name} ({number})"
        tiers.setdefault(tier, []).append(one)
    return tiers


def _eaf(tiers: Mapping[str, Iterable[Annotation]]) -> str:
    root = ElementTree.Element("ANNOTATION_DOCUMENT", AUTHOR="", FORMAT="3.0", VERSION="3.0")
    ElementTree.SubElement(root, "HEADER", MEDIA_FILE="", TIME_UNITS="milliseconds")
    order = ElementTree.SubElement(root, "TIME_ORDER")
    count = 0
    for name, spans in tiers.items():
        tier = ElementTree.SubElement(root, "TIER", TIER_ID=name, LINGUISTIC_TYPE_REF="default")
        for one in spans:
            slots = []
            for seconds in (one.start, one.end):
                count += 1
                slots.append(f"ts{count}")
                value = str(round(seconds * 1000))
                ElementTree.SubElement(order, "TIME_SLOT", TIME_SLOT_ID=slots[-1], TIME_VALUE=value)
            outer = ElementTree.SubElement(tier, "ANNOTATION")
            inner = ElementTree.SubElement(
                outer, "ALIGNABLE_ANNOTATION",
                ANNOTATION_ID=f"a{count // 2}", TIME_SLOT_REF1=slots[0], TIME_SLOT_REF2=slots[1],
            )  # fmt: skip
            ElementTree.SubElement(inner, "ANNOTATION_VALUE").text = one.text
    ElementTree.SubElement(root, "LINGUISTIC_TYPE", LINGUISTIC_TYPE_ID="default", TIME_ALIGNABLE="true")
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, "unicode") + "\n"


WANTED = {
    ".csv": "our labels, words, FAPs or points, or a table of OpenFace or Live Link",
    ".json": "results of MediaPipe's face landmarker, or words of `realizer align`",
    ".eaf": "an ELAN file with times for its annotations",
    ".textgrid": "a TextGrid in the long format with interval tiers",
}
READERS: dict[str, Callable[[str, Path], Recording]] = {
    ".csv": _csv,
    ".json": _json,
    ".eaf": _read_eaf,
    ".textgrid": _textgrid,
}
