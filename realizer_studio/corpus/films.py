"""Films of a corpus: finding those that are not tracked yet, and adding tracked data to recordings."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from realizer.core.array_types import Float64
from realizer_studio.corpus.recording import META, CorpusError, Recording, read_parts, read_recording
from realizer_studio.tracking.follower import Person
from realizer_studio.tracking.markers.film import Markers, faps_of
from realizer_studio.tracking.person_recording import rate_of, record

SUFFIXES = (".mp4", ".m4v", ".mov", ".webm", ".mkv", ".avi", ".mpg", ".mpeg", ".mts")


def is_film(path: Path) -> bool:
    """Return whether a file has the suffix of a film."""
    return path.suffix.lower() in SUFFIXES and path.is_file()


def films(folder: Path) -> dict[Path, Path]:
    """Return film -> folder of its recording, for films in folders of recordings and beside them.

    A film beside the folders belongs to the recording with its name, which may not exist yet.

    Raises:
        CorpusError: two films belong to one recording.
    """
    found: dict[Path, Path] = {}
    for path in sorted(folder.iterdir()):
        for film in [path] if is_film(path) else sorted(path.iterdir()) if path.is_dir() else []:
            if not is_film(film):
                continue
            target = folder / film.stem if film == path else path
            if target in found.values():
                raise CorpusError(
                    f"{target}: wanted one film of the recording, got {film} as well; move one away"
                )
            found[film] = target
    return found


def to_track(target: Path) -> Recording | None:
    """Return the recording of an untracked film, or None if it has points or FAPs.

    An incomplete recording, without meta.toml, keeps its labels and words, and is tracked again.
    """
    if not (target / META).is_file():
        return (
            replace(read_parts(target), faps=None, points=None) if target.is_dir() else Recording(target.name)
        )
    stored = read_recording(target)
    return None if stored.has_frames else stored


def with_face(recording: Recording, person: Person, times: Sequence[float]) -> Recording:
    """Return a recording with the FAPs of a tracked face."""
    found = record(person, times, rate_of(times))
    return replace(recording, meta={**recording.meta, "fps": found.fps}, faps=found.faps)


def with_markers(recording: Recording, markers: Markers, face: str) -> Recording:
    """Return a recording with tracked markers, and their FAPs if they are feature points."""
    points = np.concatenate([markers.points, np.zeros((*markers.points.shape[:2], 1))], axis=2)
    fap_values: Float64 | None = None
    if sum(map(bool, markers.layout.feature_points)) > 1:
        fap_values = faps_of(markers, face)[0]
    meta = {**recording.meta, "fps": markers.fps}
    return replace(recording, meta=meta, faps=fap_values, points=(markers.layout.names, points))
