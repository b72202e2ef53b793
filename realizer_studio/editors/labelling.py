"""The answers to the tab Label: recordings of a corpus, their films, and saving of labels."""

from __future__ import annotations

import json
import mimetypes
from collections.abc import Iterable
from dataclasses import astuple, replace
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.errors import RealizerError
from realizer.core.settings import Settings
from realizer.outputs.csv_table import csv_text
from realizer.server.runtime.edit_folder import EditError, EditFolder, version_of
from realizer_studio.corpus.agreement import agreement
from realizer_studio.corpus.films import films
from realizer_studio.corpus.recording import (
    COLUMNS,
    CORPUS,
    LABELS,
    META,
    Annotation,
    CorpusError,
    Recording,
    change,
    read_recording,
)
from realizer_studio.editors.packed_messages import packed, unpacked

MOST_FILM = 2**30  # bytes
FOR_SETTING = "start `realizer corpus label DIR --page`, or the service with --corpus DIR"


class Labelling:
    """The tab Label of one page.

    Args:
        settings: of the service, with the corpus.
        may_save: whether this page may change labels.
    """

    def __init__(self, settings: Settings, may_save: bool) -> None:
        self._folder, self._may_save = settings.corpus, may_save

    def answer(self, message: str | bytes) -> str | bytes:
        """Return the answer to a message, which is JSON with `id` and `type`.

        Returns:
            JSON, or JSON packed with arrays; {"id", "error"} for errors, with the stored version as
            `conflict` if somebody else has changed the labels.
        """
        number = None
        try:
            request, _ = unpacked(message)
            number = request.get("id")
            handlers = {"list": self._list, "open": self._open, "compare": self._compare, "save": self._save}
            if request.get("type") not in handlers:
                raise CorpusError(
                    f"type: wanted one of {', '.join(handlers)}, got {str(request.get('type'))[:80]!r}"
                )
            header, arrays = handlers[request["type"]](request)
        except (RealizerError, OSError) as error:
            text = str(error) if self._folder is None else str(error).replace(f"{self._folder}/", "")
            return json.dumps({"id": number, "error": text, **getattr(error, "fields", {})})
        header = {"id": number, "type": request["type"], **header}
        return packed(header, arrays) if arrays else json.dumps(header)

    def close(self) -> None:
        """Do nothing: there are no resources."""

    def _corpus(self) -> Path:
        if self._folder is None:
            raise CorpusError(f"there is no corpus here: {FOR_SETTING}")
        if not (self._folder / CORPUS).is_file():
            raise CorpusError(f"{self._folder.name}: wanted a corpus, got no {CORPUS}")
        return self._folder

    def _recording(self, request: dict[str, Any]) -> Recording:
        name, folder = str(request.get("recording", "")), self._corpus()
        names = [path.name for path in sorted(folder.iterdir()) if (path / META).is_file()]
        if name not in names:
            raise CorpusError(f"recording: wanted one of {', '.join(names)}, got {name[:80]!r}")
        return read_recording(folder / name)

    def _list(self, request: dict[str, Any]) -> Any:
        """Return the recordings with the names of their labels; unreadable ones have an error instead."""
        rows: list[dict[str, Any]] = []
        for path in sorted(self._corpus().iterdir()):
            if path.is_dir() and ((path / META).is_file() or (path / LABELS).is_file()):
                try:
                    found = read_recording(path)
                    names = sorted({label.text for label in found.labels})
                    rows.append({"name": path.name, "annotators": found.annotators, "names": names})
                except CorpusError as error:
                    rows.append({"name": path.name, "error": str(error).replace(f"{self._folder}/", "")})
        return {"corpus": self._corpus().name, "recordings": rows, "editable": self._may_save}, {}

    def _open(self, request: dict[str, Any]) -> Any:
        """Return a recording with its film or, without `film`, its points (frames, points, 2)."""
        found = self._recording(request)
        paths = (film for film, target in films(self._corpus()).items() if target.name == found.name)
        film = next(paths, None) if request.get("film", True) else None
        header = {
            "recording": found.name,
            "fps": found.fps,
            "frames": found.frames,
            "words": [[one.start, one.end, one.text] for one in found.words],
            "annotators": {name: _rows(found, name) for name in found.annotators},
            "versions": {name: _version(found, name) for name in found.annotators},
            "none": version_of(b"[]"),  # of an annotator without labels
            "points": 0,
            "media": None,
        }
        if film is not None and film.stat().st_size <= MOST_FILM:
            header["media"] = mimetypes.guess_type(film.name)[0] or "video/mp4"
            return header, {"film": np.fromfile(film, np.uint8)}
        if found.points is None:
            return header, {}
        flat = found.points[1][..., :2].astype(np.float32)
        return header | {"points": flat.shape[1]}, {"points": flat}

    def _compare(self, request: dict[str, Any]) -> Any:
        """Return the agreement of `annotator`, with the message's `labels`, and the annotator `other`."""
        changed, annotator = self._changed(request, self._recording(request))
        pair = (annotator, str(request.get("other", "")))
        both = replace(changed, labels=tuple(label for label in changed.labels if label.by in pair))
        rows = agreement([both]).rows if len(both.annotators) == 2 else ()
        return {"agreement": [list(row) for row in rows]}, {}

    def _changed(self, request: dict[str, Any], found: Recording) -> tuple[Recording, str]:
        """Return a recording with an annotator's labels replaced by those of a message, and the annotator."""
        annotator = str(request.get("annotator", "")).strip()
        if not annotator or len(annotator) > 64 or not annotator.isprintable():
            raise CorpusError(f"annotator: wanted a name of up to 64 characters, got {annotator[:80]!r}")
        try:
            added = [(float(start), float(end), str(text)) for start, end, text in request["labels"]]
        except (KeyError, TypeError, ValueError):
            raise CorpusError("labels: wanted a list of [start, end, expression]") from None
        remaining = replace(found, labels=tuple(label for label in found.labels if label.by != annotator))
        return change(remaining, annotator, added), annotator

    def _save(self, request: dict[str, Any]) -> Any:
        if not self._may_save:
            raise CorpusError("your token does not allow to save labels; the draft stays in this browser")
        found = self._recording(request)
        changed, annotator = self._changed(request, found)
        if (now := _version(found, annotator)) != request.get("version"):
            raise Conflict(f"{found.name}: the labels of {annotator} were changed since you opened them", now)
        folder = EditFolder(self._corpus() / found.name)
        text = csv_text(COLUMNS[LABELS], map(astuple, changed.labels))
        try:
            file = folder.path("labels", suffix=".csv")
            folder.write(file, text.encode(), version_of(file.read_bytes()) if file.exists() else None)
        except EditError as error:
            raise CorpusError(f"{found.name}/{error}; the draft stays in this browser") from None
        return {"version": _version(changed, annotator), "labels": _rows(changed, annotator)}, {}


class Conflict(CorpusError):
    """Somebody else has changed the labels; `fields` has the stored version."""

    def __init__(self, text: str, version: str) -> None:
        super().__init__(f"{text}: open the recording again, or save again to replace them")
        self.fields = {"conflict": version}


def _rows(recording: Recording, annotator: str) -> list[list[object]]:
    """Return the labels of an annotator as [start, end, expression]."""
    labels: Iterable[Annotation] = (label for label in recording.labels if label.by == annotator)
    return [[one.start, one.end, one.text] for one in labels]


def _version(recording: Recording, annotator: str) -> str:
    """Return the version of one annotator's labels, which is independent of other annotators."""
    return version_of(json.dumps(_rows(recording, annotator)).encode())
