"""The axis of what can be animated."""

from __future__ import annotations

import pytest

from realizer import tables
from realizer.animation.targets import AU_NAMES, PRESENCES, au, axis, fap, presence, region


def test_the_axis_is_aus_then_68_faps_then_presences() -> None:
    names = list(axis())
    assert names[: len(AU_NAMES())] == list(AU_NAMES())
    assert names[len(AU_NAMES()) : -len(PRESENCES)] == [row.name for row in tables.faps()]
    assert names[-len(PRESENCES) :] == list(PRESENCES)
    assert [target.column for target in axis().values()] == list(range(len(names)))


def test_an_au_with_sides_has_two_columns_and_one_without_has_one() -> None:
    assert [t.name for t in au(12)] == ["12L", "12R"]
    assert [t.name for t in au(12, "RIGHT")] == ["12R"]
    assert [t.name for t in au(26, "LEFT")] == ["26"]
    with pytest.raises(KeyError):
        au(99)


@pytest.mark.parametrize(
    ("target", "wanted"),
    [
        (au(61)[0], "eyes"),
        (au(66)[0], "eyes"),
        (au(54)[0], "head"),
        (au(12)[0], "face"),
        (au(6)[0], "face"),
        (au(5)[0], "face"),
        (fap(23), "eyes"),
        (fap(48), "head"),
        (fap(19), "face"),
        (presence("eyes"), "eyes"),
        (presence("lips"), "face"),
        (presence("blinks"), "idle"),
        (presence("motion"), "idle"),
    ],
)
def test_a_target_belongs_to_a_region(target: object, wanted: str) -> None:
    assert region(target) == wanted  # type: ignore[arg-type]
