"""A shipped face goes out as GLB with ARKit's shapes and comes back: it measures and moves the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer.face import Face, check_face, deform, load_face
from realizer.face.arkit import Report, import_head
from realizer.tables import Fap, faps


@pytest.fixture(scope="module")
def brought(ada_glb: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Face, Report]:
    place = tmp_path_factory.mktemp("faces")
    report = import_head(ada_glb, place / "again")
    assert check_face("again", place) == ()
    return load_face("again", place), report


def test_a_head_comes_back_with_its_size_and_parts(brought: tuple[Face, Report]) -> None:
    face, report = brought
    first = load_face("ada")
    assert set(face.parts) == set(first.parts)
    for unit in ("es0", "ens0", "mns0", "mw0", "irisd0"):
        assert getattr(face.fapu, unit) == pytest.approx(getattr(first.fapu, unit), rel=0.05)
    assert any("in metres" in line for line in report.found)
    assert report.missing == ()


LINEAR = [row for row in faps()[2:] if row.direction in ("up", "down", "left", "right")]


@pytest.mark.parametrize(
    "row", [row for row in LINEAR if row.unit != "angle_unit"], ids=lambda row: str(row.fap)
)
def test_every_point_goes_as_far_as_before(brought: tuple[Face, Report], row: Fap) -> None:
    asked = np.zeros((1, 68), np.float32)
    asked[0, row.fap - 1] = 150
    axis = 1 if row.direction in ("up", "down") else 0
    again, before = (
        (deform(face, asked)[0] - face.vertices)[face.feature_points[row.feature_point], axis]
        for face in (brought[0], load_face("ada"))
    )
    assert again == pytest.approx(before, rel=0.05)
