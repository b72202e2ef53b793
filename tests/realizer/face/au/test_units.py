"""Tests of the table of action units."""

from __future__ import annotations

from realizer.face.au.units import Unit, units


def test_units_are_wojdel_s() -> None:
    table = units()
    assert len(table) == 32
    assert [unit.au for unit in table.values() if unit.kind == "eyes"] == [61, 62, 63, 64]
    assert [unit.au for unit in table.values() if unit.kind == "head"] == [51, 52, 53, 54, 55, 56]
    # Her sub-object action units (4.3.2) are all split.
    assert all(table[au].split for au in (10, 16, 18, 22, 25, 27, 28))
    for unit in table.values():
        assert bool(unit.mixture) == (unit.kind == "displacement")
        assert bool(unit.turn) == (unit.kind != "displacement")


def test_unit_mixture_has_the_weights_of_face_units() -> None:
    unit = Unit(99, "displacement", False, "", "98 97", "browDown:0.5 eyeBlink:1")
    assert unit.mixture == {"browDown": 0.5, "eyeBlink": 1.0}
    assert unit.names == (99, 98, 97)
