"""Recordings of a corpus: folders with FAPs, feature points, labels, words and metadata."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import astuple, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.core.atomic_files import replacing, write_text
from realizer.core.errors import TableError
from realizer.core.toml_text import parse_toml
from realizer.outputs.csv_table import csv_text
from realizer.tables import faps
from realizer_studio.tracking.person_recording import rate_of

CORPUS, META, FAPS, POINTS = "corpus.toml", "meta.toml", "faps.csv", "points.npz"
LABELS, WORDS = "labels.csv", "words.csv"
COLUMNS = {LABELS: ["start", "end", "expression", "annotator"], WORDS: ["start", "end", "word", "speaker"]}
FACTS = ("person", "mood", "fragment", "language", "licence")  # beside fps and frames
SUBJECT = "subject"  # alias of the recorded person as speaker
MAX_FRAMES = 1_000_000


class CorpusError(TableError):
    """A file of a corpus cannot be used; the message names it and a remedy."""


@dataclass(frozen=True, slots=True)
class Annotation:
    """An expression or a word from `start` to `end` seconds, with its annotator or speaker `by`."""

    start: float
    end: float
    text: str
    by: str = ""

    def __post_init__(self) -> None:
        if not (0 <= self.start <= self.end < MAX_FRAMES and self.text):
            given = f"{self.text!r} from {self.start:g} to {self.end:g}"
            raise ValueError(f"a text, a start and a later end in seconds are wanted, got {given}")


@dataclass(frozen=True, slots=True)
class Segment:
    """An expression or a word from its first to its last frame (Wojdel 2005, eq. 6.1)."""

    first: int
    last: int
    text: str
    by: str = ""

    def __len__(self) -> int:
        return self.last - self.first + 1

    def annotation(self, fps: float) -> Annotation:
        """Return the segment in seconds."""
        return Annotation(self.first / fps, (self.last + 1) / fps, self.text, self.by)

    def gap(self, other: Segment) -> int:
        """Return the number of frames between both: 0 if they adjoin, negative if they overlap (eq. 6.12)."""
        return max(self.first - other.last, other.first - self.last) - 1


@dataclass(frozen=True)
class Recording:
    """A recording."""

    name: str  # of its folder
    # Person, mood, fragment, language, licence, fps and frames.
    meta: Mapping[str, Any] = field(default_factory=dict)
    labels: tuple[Annotation, ...] = ()  # expressions with their annotators
    # Words with their speakers, in order; punctuation belongs to the word before it.
    words: tuple[Annotation, ...] = ()
    faps: Float64 | None = None  # (n, 68) FAPs, or None
    # Names and positions (n, points, 3) of feature points, NaN where lost, or None.
    points: tuple[tuple[str, ...], Float64] | None = None

    @property
    def fps(self) -> float:
        return float(self.meta.get("fps", 25.0))

    @cached_property
    def frames(self) -> int:
        """The number of frames of the FAPs or points, and at least up to the last label or word."""
        last = max((one.end for one in (*self.labels, *self.words)), default=0.0)
        parts = self.faps, self.points and self.points[1]
        lengths = [len(part) for part in parts if part is not None]
        return max([*lengths, int(self.meta.get("frames", 0)), math.ceil(last * self.fps - 1e-6)])

    @property
    def has_frames(self) -> bool:
        return self.faps is not None or self.points is not None

    @property
    def annotators(self) -> list[str]:
        return sorted({label.by for label in self.labels})

    def segments(self, annotator: str | None = None) -> list[Segment]:
        """Return the expressions of an annotator, by default the first, as segments in order."""
        selected = annotator if annotator is not None else next(iter(self.annotators), "")
        return self._in_frames(label for label in self.labels if label.by == selected)

    @cached_property
    def spoken(self) -> list[Segment]:
        """The words as segments; `by` is "subject" if the recorded person speaks, otherwise "other"."""
        subject_names = {SUBJECT, "", self.meta.get("person", SUBJECT)}
        return self._in_frames(
            replace(one, by=SUBJECT if one.by in subject_names else "other") for one in self.words
        )

    def _in_frames(self, spans: Iterable[Annotation]) -> list[Segment]:
        starts = ((round(span.start * self.fps), span) for span in spans)
        found = [Segment(at, max(at, round(s.end * self.fps) - 1), s.text, s.by) for at, s in starts]
        return sorted(found, key=lambda one: (one.first, one.last))


def read_corpus(folder: Path) -> list[Recording]:
    """Return the recordings of a corpus by name; raises CorpusError."""
    if not (folder / CORPUS).is_file():
        raise CorpusError(f"{folder}: wanted a corpus, got no {CORPUS}; make one by `realizer corpus init`")
    parts = (META, LABELS, WORDS, FAPS, POINTS)
    paths = [path for path in sorted(folder.iterdir()) if any((path / name).exists() for name in parts)]
    if not paths:
        raise CorpusError(f"{folder}: wanted a recording or more, got none; see `realizer corpus add`")
    return [read_recording(path) for path in paths]


def read_recording(folder: Path) -> Recording:
    """Return the recording in a folder; raises CorpusError."""
    if not (folder / META).is_file():
        raise CorpusError(
            f"{folder}: wanted {META}, got none; it is half written: add it, or track its film, again"
        )
    return read_parts(folder)


def read_parts(folder: Path) -> Recording:
    """Return a recording from a folder that may have no metadata; raises CorpusError."""
    path = folder / META
    try:
        meta = parse_toml(path.read_text("utf-8")) if path.is_file() else {}
        if unknown := sorted(meta.keys() - {*FACTS, "fps", "frames"}):
            raise ValueError(f"{unknown[0]} is none of {', '.join(FACTS)}, fps, frames")
        if not (0 < meta.get("fps", 25.0) <= 1000 and 0 <= meta.get("frames", 0) <= MAX_FRAMES):
            raise ValueError(f"fps up to 1000 and up to {MAX_FRAMES} frames are wanted")
        spans = {}
        for name in COLUMNS:
            if (path := folder / name).is_file():
                spans[name] = read_annotations(path.read_text("utf-8"))
        values = points = None
        if (path := folder / FAPS).is_file():
            values = read_faps(path.read_text("utf-8"))[0]
        if (path := folder / POINTS).is_file():
            with np.load(path, allow_pickle=False) as data:
                names, positions = tuple(map(str, data["names"])), np.asarray(data["points"], np.float64)
            points = names, positions.reshape(len(positions), len(names), 3)
    except (OSError, ValueError, TypeError, KeyError, EOFError) as error:
        raise CorpusError(f"{path}: wanted a file of a recording, got: {error}; add it again") from None
    return Recording(folder.name, meta, spans.get(LABELS, ()), spans.get(WORDS, ()), values, points)


def write_recording(folder: Path, recording: Recording) -> None:
    """Write a recording; the metadata are last, so that incomplete recordings are recognised."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, spans in ((LABELS, recording.labels), (WORDS, recording.words)):
        if spans or (folder / name).exists():
            write_text(folder / name, csv_text(COLUMNS[name], map(astuple, spans)))
    if recording.faps is not None:
        rows = (
            [f"{k / recording.fps:.4f}", *map("{:.6g}".format, row)] for k, row in enumerate(recording.faps)
        )
        write_text(folder / FAPS, csv_text(["time", *(row.name for row in faps())], rows))
    if recording.points is not None:
        with replacing(folder / POINTS) as path, path.open("wb") as file:
            np.savez_compressed(file, names=np.array(recording.points[0]), points=recording.points[1])
    meta = {**recording.meta, "fps": recording.fps, "frames": recording.frames}
    lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in meta.items()]
    write_text(folder / META, "".join(lines))


def read_annotations(text: str) -> tuple[Annotation, ...]:
    """Parse labels or words in CSV; raises ValueError."""
    head, *rows = list(csv.reader(io.StringIO(text))) or [[]]
    if head not in COLUMNS.values():
        raise ValueError(f"columns {','.join(head)[:80]}, not {','.join(COLUMNS[LABELS])}")
    found = []
    for number, row in enumerate(rows, 2):
        try:
            start, end, what, by = (cell.strip() for cell in row)
            found.append(Annotation(float(start), float(end), what, by))
        except ValueError as error:
            raise ValueError(f"line {number}: {error}") from None
    return tuple(found)


def read_faps(text: str) -> tuple[Float64, float]:
    """Parse a CSV with columns time and FAP names; return FAPs (n, 68) and the rate; raises ValueError."""
    columns = numbers(text)
    indices = [row.fap - 1 for row in faps() if row.name in columns]
    if "time" not in columns or not indices:
        raise ValueError(f"no column time, or no columns named as FAPs, but {','.join(columns)[:80]}")
    values = np.zeros((len(columns["time"]), 68))
    values[:, indices] = np.stack([columns[faps()[index].name] for index in indices], axis=1)
    if not np.isfinite(values).all() or not 0 < len(values) <= MAX_FRAMES:
        raise ValueError(f"values that are not finite, none, or more than {MAX_FRAMES}")
    return values, rate_of(columns["time"])


def numbers(text: str) -> dict[str, Float64]:
    """Parse a CSV into columns, with NaN for cells that are no numbers."""

    def number(cell: str) -> float:
        try:
            return float(cell)
        except ValueError:
            return math.nan

    head, *rows = list(csv.reader(io.StringIO(text), skipinitialspace=True)) or [[]]
    for line, row in enumerate(rows, 2):
        if len(row) != len(head):
            raise ValueError(f"line {line} with {len(row)} cells, where the first has {len(head)}")
    table = np.array([[number(cell) for cell in row] for row in rows]).reshape(len(rows), len(head))
    return {name: table[:, k] for k, name in enumerate(head)}


Spans = Iterable[tuple[float, float, str]]


def change(recording: Recording, annotator: str, added: Spans = (), removed: Spans = ()) -> Recording:
    """Return a recording with segments of an annotator removed and added.

    Segments are (start, end, expression), in seconds. Removed ones are matched within half a frame.

    Raises:
        CorpusError: a removed segment does not exist, or an added one is invalid, ends after the recording,
        or
            overlaps another one of the same expression.
    """
    labels, slack = list(recording.labels), 0.5 / recording.fps + 1e-6
    for start, end, text in removed:
        same = [one for one in labels if (one.text, one.by) == (text, annotator)]
        near = [one for one in same if abs(one.start - start) <= slack and abs(one.end - end) <= slack]
        if not near:
            existing = ", ".join(f"{one.start:g} to {one.end:g}" for one in same) or "none"
            raise CorpusError(
                f"{recording.name}: wanted a segment of {text!r} by {annotator!r} to remove, got "
                f"{start:g} to {end:g}; there are {existing}"
            )
        labels.remove(near[0])
    last = recording.frames / recording.fps if recording.has_frames else float("inf")
    for start, end, text in added:
        try:
            new = Annotation(start, end, text.strip(), annotator)
        except ValueError as error:
            raise CorpusError(f"{recording.name}: {error}") from None
        if end > last + slack:
            raise CorpusError(f"{recording.name}: wanted an end up to {last:g} s, got {end:g}")
        for one in labels:
            if (one.text, one.by) == (new.text, new.by) and one.start < end and start < one.end:
                raise CorpusError(
                    f"{recording.name}: wanted a segment beside that of {one.start:g} to {one.end:g}, got "
                    f"{start:g} to {end:g}; remove that one first"
                )
        labels.append(new)
    return replace(recording, labels=tuple(sorted(labels, key=lambda one: (one.start, one.end))))
