"""Mappings of AUs to FAPs: the built-in table, and replaced units."""

from __future__ import annotations

from realizer import tables
from realizer.animation.fap.au_fap_mapping import standard
from realizer.tables import AuToFap


def test_standard_mapping_is_the_table() -> None:
    assert standard().rows == tables.au_to_fap()
    assert standard() is standard()


def test_mapping_replaces_units_completely_on_one_side() -> None:
    own = AuToFap(12, "L", 6, 0.0, 1.0, 0.0, 99.0)
    mapping = standard().replaced({(12, "L"): (own,)}, "mine")
    assert [row for row in mapping.rows if (row.au, row.side) == (12, "L")] == [own]
    others = [row for row in mapping.rows if (row.au, row.side) != (12, "L")]
    assert others == [row for row in standard().rows if (row.au, row.side) != (12, "L")]
    assert mapping.sources == ("au_to_fap.csv", "mine")


def test_mapping_replaces_a_unit_by_nothing() -> None:
    mapping = standard().replaced({(25, ""): ()}, "mine")
    assert 25 not in {row.au for row in mapping.rows}
