"""Tests of `realizer_studio.corpus.films`."""

from pathlib import Path

import numpy as np
import pytest

from realizer_studio.corpus.films import films, to_track, with_markers
from realizer_studio.corpus.recording import Annotation, CorpusError, Recording, write_recording
from realizer_studio.tracking.markers.colours import named
from realizer_studio.tracking.markers.film import MarkerSettings, track_markers
from tests.painted import acted, plain, truth


def test_films_are_in_folders_and_beside_them(tmp_path: Path) -> None:
    for name in ("anna/film.mp4", "ben.MOV", "carl/notes.txt", "dora/d.webm"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    found = {film.name: target.name for film, target in films(tmp_path).items()}
    assert found == {"film.mp4": "anna", "ben.MOV": "ben", "d.webm": "dora"}
    (tmp_path / "anna.mkv").touch()
    with pytest.raises(CorpusError, match=r"anna: wanted one film of the recording, got .*anna\.mkv as well"):
        films(tmp_path)


def test_to_track_keeps_what_is_half_written_and_skips_what_is_done(tmp_path: Path) -> None:
    known = Recording("one", {"person": "eva"}, (Annotation(1, 2, "anger", "eva"),), faps=np.zeros((80, 68)))
    assert to_track(tmp_path / "new") == Recording("new")
    write_recording(tmp_path / "one", known)
    assert to_track(tmp_path / "one") is None
    (tmp_path / "one" / "meta.toml").unlink()  # as if the power had failed
    again = to_track(tmp_path / "one")
    assert again is not None
    assert (again.labels, again.faps) == (known.labels, None)


def test_with_markers_adds_points_and_faps() -> None:
    look = MarkerSettings((named("green"), named("blue")))
    markers = track_markers(plain(truth("ada", acted(6))), look, "film")
    found = with_markers(Recording("one", {"person": "eva"}), markers, "ada")
    assert found.points is not None
    assert found.faps is not None
    assert (found.points[1].shape, found.meta["person"], found.frames) == ((6, 31, 3), "eva", 6)
    assert np.abs(found.faps[:, 30]).max() > 50
    few = track_markers(plain(truth("ada", acted(3))[:, :5]), look, "film")
    assert with_markers(found, few, "ada").faps is None
