"""What a sheet shows: everything once, as far as it goes."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.cli import poses
from realizer.tables import action_units, faps
from realizer.tables.emotions import archetypes


def test_every_fap_is_there_in_each_of_its_directions() -> None:
    shown = [pose for series in poses.of_faps(512) for pose in series.poses]
    # Paul 2010, 4.4: 66 FAPs, of which five go one way only.
    assert len(shown) == 127
    directions = {(int(np.flatnonzero(pose.row)[0]) + 1, bool(pose.row.sum() > 0)) for pose in shown}
    assert len(directions) == 127
    assert {fap for fap, _ in directions} == set(range(3, 69))


@pytest.mark.parametrize("value", [100, 512, 4320])
def test_no_fap_leaves_its_range_and_angles_go_along(value: int) -> None:
    ranges = {row.fap: row for row in faps()}
    for series in poses.of_faps(value):
        for pose in series.poses:
            (column,) = np.flatnonzero(pose.row)
            row = ranges[int(column) + 1]
            assert row.least <= pose.row[column] <= row.most
            if row.unit != "angle_unit":
                assert abs(pose.row[column]) <= value
    (yaw, _) = (p for s in poses.of_faps(512) for p in s.poses if p.row[48])
    assert np.degrees(yaw.row[48] * 1e-5) == pytest.approx(20, abs=0.01)


def test_every_action_unit_is_there_and_half_of_it_is_less() -> None:
    whole, half = ([p for s in poses.of_aus(part) for p in s.poses] for part in (1.0, 0.5))
    assert len(whole) == len(action_units())
    assert {p.title.split()[0] for p in whole} == {f"AU{row.au}" for row in action_units()}
    assert sum(np.abs(p.row).sum() for p in half) < sum(np.abs(p.row).sum() for p in whole)


def test_every_archetype_is_there_and_none_is_neutral() -> None:
    shown = poses.of_emotions()[0].poses
    assert [pose.title for pose in shown] == [emotion.name.lower() for emotion in archetypes()]
    assert all(pose.row.any() for pose in shown)
    assert not poses.neutral().poses[0].row.any()
