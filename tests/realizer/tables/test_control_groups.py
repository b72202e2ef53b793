"""Tests of `realizer.tables.control_groups`."""

from __future__ import annotations

from realizer import tables
from realizer.tables import control_groups


def test_regions_have_every_action_unit_and_low_level_fap_once() -> None:
    aus = [au for region in control_groups.au_regions() for au in region.members]
    faps = [fap for region in control_groups.fap_regions() for fap in region.members]
    assert sorted(aus) == [row.au for row in tables.action_units()]
    assert faps == list(range(3, 69))


def test_fap_regions_are_the_groups_of_the_standard() -> None:
    groups = {row.fap: row.group for row in tables.faps()}
    for region in control_groups.fap_regions():
        assert len({groups[fap] for fap in region.members}) == 1
