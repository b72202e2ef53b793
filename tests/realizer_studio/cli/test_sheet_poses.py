"""Tests of the poses of face sheets."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.animation.fap.conversion import to_fap
from realizer.tables import action_units, faps
from realizer_studio.cli import sheet_poses


def faps_of(series: list[sheet_poses.Series]) -> np.ndarray:
    return to_fap(sheet_poses.frames(series)).values


def test_of_faps_has_every_fap_in_each_direction() -> None:
    shown = [pose for series in sheet_poses.of_faps(512) for pose in series.poses]
    # Paul 2010, 4.4: 66 FAPs, of which five go one way only.
    assert len(shown) == 127
    rows = faps_of(sheet_poses.of_faps(512))
    directions = {(int(np.flatnonzero(row)[0]) + 1, bool(row.sum() > 0)) for row in rows}
    assert len(directions) == 127
    assert {fap for fap, _ in directions} == set(range(3, 69))


@pytest.mark.parametrize("value", [100, 512, 4320])
def test_of_faps_stays_within_ranges_and_scales_angles(value: int) -> None:
    ranges = {row.fap: row for row in faps()}
    for pose in faps_of(sheet_poses.of_faps(value)):
        (column,) = np.flatnonzero(pose)
        row = ranges[int(column) + 1]
        assert row.least <= pose[column] <= row.most
        if row.unit != "angle_unit":
            assert abs(pose[column]) <= value
    yaw = faps_of(sheet_poses.of_faps(512))[:, 48].max()
    assert np.degrees(yaw * 1e-5) == pytest.approx(20, abs=0.01)


def test_of_aus_has_every_action_unit_at_its_intensity() -> None:
    whole, half = ([p for s in sheet_poses.of_aus(part) for p in s.poses] for part in (1.0, 0.5))
    assert len(whole) == len(action_units())
    assert {p.title.split()[0] for p in whole} == {f"AU{row.au}" for row in action_units()}
    assert sum(np.abs(p.row).sum() for p in half) < sum(np.abs(p.row).sum() for p in whole)


def test_of_emotions_has_every_archetype_and_none_is_neutral() -> None:
    shown = sheet_poses.of_emotions()[0].poses
    assert [pose.title for pose in shown] == ["fear", "sadness", "surprise", "disgust", "anger", "happiness"]
    assert all(pose.row.any() for pose in shown)
    assert not sheet_poses.neutral().poses[0].row.any()


def test_of_emotions_has_17_angles_at_4_growing_activations() -> None:
    series = sheet_poses.of_emotions()[1]
    assert (len(series.poses), series.columns) == (17 * 4, 4)
    strength = np.abs(faps_of([series])).sum(axis=1).reshape(17, 4)
    assert (np.diff(strength, axis=1) > 0).all()
    assert np.array_equal(strength[0], strength[16])  # once around
