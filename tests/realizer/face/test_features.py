"""Tests of the feature points of a face, and of the distances between them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer.face.features import NAMES, Point, fapu_of, read_features, write_features
from realizer.face.load import list_faces, load_face
from realizer.face.model import Face

FACES = [info.name for info in list_faces()]


@pytest.fixture(params=FACES)
def face(request: pytest.FixtureRequest) -> Face:
    return load_face(request.param)


def test_features_are_84_points(face: Face) -> None:
    assert sorted(face.points) == sorted(NAMES)
    assert len(NAMES) == 84


def test_fapu_are_a_persons_distances(face: Face) -> None:
    fapu = face.fapu
    assert 0.007 < fapu.irisd0 < 0.014
    assert 0.050 < fapu.es0 < 0.072
    assert 0.030 < fapu.ens0 < 0.060
    assert 0.010 < fapu.mns0 < 0.030
    assert 0.035 < fapu.mw0 < 0.065


def test_features_are_read_as_they_were_written(tmp_path: Path) -> None:
    points = {name: Point(name, k, k / 1000, -0.5, 0.25) for k, name in enumerate(NAMES)}
    write_features(tmp_path / "features.csv", points)
    assert read_features(tmp_path / "features.csv") == points


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda rows: rows[:-1], r"wanted 84 feature points, these are missing: 11\.6"),
        (lambda rows: [*rows, rows[-1]], r"feature point 11\.6 is there twice"),
        (lambda rows: [*rows[:-1], rows[-1].replace(",83,", ",x,")], "vertex"),
    ],
)
def test_features_with_a_bad_row_are_refused(tmp_path: Path, change: object, words: str) -> None:
    path = tmp_path / "features.csv"
    write_features(path, {name: Point(name, k, 0, 0, 0) for k, name in enumerate(NAMES)})
    path.write_text("\n".join(change(path.read_text().splitlines())))  # type: ignore[operator]
    with pytest.raises(FaceError, match=words):
        read_features(path)


def test_fapu_are_not_measured_between_exchanged_points() -> None:
    points = dict(load_face().points)
    assert fapu_of(points).mw0 == pytest.approx(points["8.3"][0] - points["8.4"][0])
    points["8.3"], points["8.4"] = points["8.4"], points["8.3"]
    with pytest.raises(FaceError, match=r"wanted 8\.3 beyond 8\.4 along x, got -0\.0"):
        fapu_of(points)
    points["8.3"] = np.full(3, np.nan, np.float32)
    with pytest.raises(FaceError, match="got nan"):
        fapu_of(points)
