"""Recordings of a corpus: a folder each, with FAPs, feature points, labels, words and facts."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
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

CORPUS, META, FAPS, POINTS = "corpus.toml", "meta.toml", "faps.csv", "points.npz"
LABELS, WORDS = "labels.csv", "words.csv"
COLUMNS = {LABELS: ["start", "end", "expression", "annotator"], WORDS: ["start", "end", "word", "speaker"]}
FACTS = ("person", "mood", "fragment", "language", "licence")  # beside fps and frames
SUBJECT = "subject"  # speaker whose face is recorded, beside the person's name
MAX_FRAMES = 1_000_000


class CorpusError(TableError):
    """A file of a corpus that cannot be used; the message names it and what to do."""


@dataclass(frozen=True, slots=True)
class Annotation:
    """An expression or a word from `start` to `end` seconds, and who labelled or said it.

    Raises:
        CorpusError: times that are not in order, or no text.
    """

    start: float
    end: float
    text: str
    by: str = ""

    def __post_init__(self) -> None:
        if not (0 <= self.start <= self.end < MAX_FRAMES and self.text):
            raise CorpusError(f"wanted a text, a start and a later end in seconds; got {self}")


@dataclass(frozen=True, slots=True)
class Segment:
    """An expression or a word from its first to its last frame (eq. 6.1)."""

    first: int
    last: int
    text: str
    by: str = ""

    def __len__(self) -> int:
        return self.last - self.first + 1

    def annotation(self, fps: float) -> Annotation:
        """Return it in seconds."""
        return Annotation(self.first / fps, (self.last + 1) / fps, self.text, self.by)

    def meets(self, other: Segment) -> bool:
        """Return whether both share a frame."""
        return self.first <= other.last and other.first <= self.last


@dataclass(frozen=True)
class Recording:
    """A recording.

    Attributes:
        name: of its folder.
        meta: person, mood, fragment, language, licence, fps and frames.
        labels: expressions with their annotators.
        words: words with their speakers, in order; punctuation belongs to the word before it.
        faps: (n, 68) FAPs, or None.
        points: names and positions (n, points, 3) of feature points, NaN where lost, or None.
    """

    name: str
    meta: Mapping[str, Any] = field(default_factory=dict)
    labels: tuple[Annotation, ...] = ()
    words: tuple[Annotation, ...] = ()
    faps: Float64 | None = None
    points: tuple[tuple[str, ...], Float64] | None = None

    @property
    def fps(self) -> float:
        return float(self.meta.get("fps", 25.0))

    @cached_property
    def frames(self) -> int:
        """The number of frames: of the FAPs or points, or at least to the last label or word."""
        last = max((one.end for one in (*self.labels, *self.words)), default=0.0)
        known = [len(self.faps)] if self.faps is not None else []
        known += [len(self.points[1])] if self.points is not None else []
        return max([*known, int(self.meta.get("frames", 0)), math.ceil(last * self.fps - 1e-6)])

    @property
    def annotators(self) -> list[str]:
        return sorted({label.by for label in self.labels})

    def segments(self, annotator: str | None = None) -> list[Segment]:
        """Return the expressions in frames, in order; of one annotator, or of the first."""
        wanted = annotator if annotator is not None else next(iter(self.annotators), "")
        return self._in_frames(label for label in self.labels if label.by == wanted)

    @cached_property
    def spoken(self) -> list[Segment]:
        """The words in frames; `by` is "subject" if the recorded person speaks, else "other"."""
        own = {SUBJECT, "", self.meta.get("person", SUBJECT)}
        return self._in_frames(
            replace(word, by=SUBJECT if word.by in own else "other") for word in self.words
        )

    def _in_frames(self, spans: Iterable[Annotation]) -> list[Segment]:
        starts = ((round(span.start * self.fps), span) for span in spans)
        found = [Segment(at, max(at, round(s.end * self.fps) - 1), s.text, s.by) for at, s in starts]
        return sorted(found, key=lambda one: (one.first, one.last))


def read_corpus(folder: Path) -> list[Recording]:
    """Return the recordings of a corpus by name.

    Raises:
        CorpusError: no corpus, no recordings, or a file that cannot be used.
    """
    if not (folder / CORPUS).is_file():
        raise CorpusError(f"{folder}: wanted a corpus, got no {CORPUS}; make one by `realizer corpus init`")
    parts = (META, LABELS, WORDS, FAPS, POINTS)
    paths = [path for path in sorted(folder.iterdir()) if any((path / name).exists() for name in parts)]
    if not paths:
        raise CorpusError(f"{folder}: wanted a recording or more, got none; see `realizer corpus add`")
    return [read_recording(path) for path in paths if path.name != "report"]


def read_recording(folder: Path) -> Recording:
    """Return the recording in a folder; errors as for `read_corpus`."""
    path = folder / META
    if not path.is_file():
        raise CorpusError(f"{folder}: wanted {META}, got none; it is half written, add it again")
    try:
        meta = parse_toml(read_text(path))
        fps, frames = float(meta.get("fps", 25.0)), int(meta.get("frames", 0))
    except (TypeError, ValueError) as error:
        raise CorpusError(f"{path}: wanted TOML with numbers fps and frames, got: {error}") from None
    if unknown := sorted(meta.keys() - {*FACTS, "fps", "frames"}):
        raise CorpusError(f"{path}: wanted {', '.join(FACTS)}, fps, frames; got {unknown[0]}")
    if not 0 < fps <= 1000 or not 0 <= frames <= MAX_FRAMES:
        raise CorpusError(f"{path}: wanted fps up to 1000 and up to {MAX_FRAMES} frames, got {fps}, {frames}")
    labels, words = (
        read_annotations(read_text(folder / name), folder / name) if (folder / name).is_file() else ()
        for name in COLUMNS
    )
    values = read_faps(read_text(folder / FAPS), folder / FAPS)[0] if (folder / FAPS).is_file() else None
    points = _read_points(folder / POINTS) if (folder / POINTS).is_file() else None
    return Recording(folder.name, meta, labels, words, values, points)


def write_recording(folder: Path, recording: Recording) -> None:
    """Write a recording; its facts come last, so that what is half written is seen."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, spans in ((LABELS, recording.labels), (WORDS, recording.words)):
        if spans:
            write_text(folder / name, annotations_text(name, spans))
    if recording.faps is not None:
        rows = (
            [f"{k / recording.fps:.4f}", *(f"{value:.6g}" for value in row)]
            for k, row in enumerate(recording.faps.tolist())
        )
        write_text(folder / FAPS, csv_text(["time", *(row.name for row in faps())], rows))
    if recording.points is not None:
        names, places = recording.points
        with replacing(folder / POINTS) as path, path.open("wb") as file:
            np.savez_compressed(file, names=np.array(names), points=places.astype(np.float32))
    meta = {**recording.meta, "fps": recording.fps, "frames": recording.frames}
    lines = [f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in meta.items()]
    write_text(folder / META, "".join(lines))


def annotations_text(name: str, spans: Iterable[Annotation]) -> str:
    """Return labels or words as CSV."""
    return csv_text(COLUMNS[name], ((f"{s.start:.4f}", f"{s.end:.4f}", s.text, s.by) for s in spans))


def read_annotations(text: str, path: Path) -> tuple[Annotation, ...]:
    """Parse labels or words in CSV; raises CorpusError for other columns, or an invalid row."""
    head, *rows = list(csv.reader(io.StringIO(text))) or [[]]
    if head not in COLUMNS.values():
        wanted = " or ".join(",".join(columns) for columns in COLUMNS.values())
        raise CorpusError(f"{path}: wanted the columns {wanted}, got {','.join(head)[:80]}")
    found = []
    for number, row in enumerate(rows, 2):
        try:
            start, end, what, by = (cell.strip() for cell in row)
            found.append(Annotation(float(start), float(end), what, by))
        except (ValueError, CorpusError):
            raise CorpusError(
                f"{path}, line {number}: wanted {','.join(head)} with times in order, got {row}"
            ) from None
    return tuple(found)


def read_faps(text: str, path: Path) -> tuple[Float64, float]:
    """Return the FAPs (n, 68) of a CSV with the columns time and names of FAPs, and the frame rate.

    Raises:
        CorpusError: other columns, or values that are not finite.
    """
    head, *rows = list(csv.reader(io.StringIO(text))) or [[]]
    places = {head.index(row.name): row.fap - 1 for row in faps() if row.name in head}
    if "time" not in head or not places or not rows:
        raise CorpusError(f"{path}: wanted a column time, columns named as FAPs, and rows; got {head[:5]}")
    try:
        cells = np.array([[float(cell) for cell in row] for row in rows]).reshape(len(rows), len(head))
    except ValueError as error:
        raise CorpusError(f"{path}: wanted numbers, as many in each row; got: {error}") from None
    if not np.isfinite(cells).all() or len(cells) > MAX_FRAMES:
        raise CorpusError(f"{path}: wanted finite values of up to {MAX_FRAMES} frames, got others")
    values = np.zeros((len(cells), 68))
    values[:, list(places.values())] = cells[:, list(places)]
    return values, rate_of(cells[:, head.index("time")])


def rate_of(times: Float64) -> float:
    """Return the frames per second of times in seconds; 25 if they do not tell."""
    usual = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    return round(1 / usual, 3) if usual > 0 else 25.0


def read_text(path: Path) -> str:
    """Return a text in UTF-8; raises CorpusError."""
    try:
        return path.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise CorpusError(f"{path}: wanted a text in UTF-8, got: {error}") from None


def _read_points(path: Path) -> tuple[tuple[str, ...], Float64]:
    try:
        with np.load(path, allow_pickle=False) as data:
            names, places = tuple(map(str, data["names"])), np.asarray(data["points"], np.float64)
        return names, places.reshape(len(places), len(names), 3)
    except (OSError, ValueError, KeyError, EOFError) as error:
        raise CorpusError(f"{path}: wanted arrays names and points, got: {error}; add it again") from None
