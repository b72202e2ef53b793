"""The columns of animation frames."""

import pytest

from realizer import tables
from realizer.animation.axis import (
    AU_NAMES,
    MASKED_REGIONS,
    au,
    au_row,
    axis,
    fap,
    mask_channel,
    mixing_order,
    region,
)


def test_axis_has_aus_faps_masks_and_ranks_in_order() -> None:
    names = list(axis())
    faps = len(AU_NAMES())
    presences = faps + 68
    ranks = presences + len(MASKED_REGIONS)
    assert names[:faps] == list(AU_NAMES())
    assert names[faps:presences] == [row.name for row in tables.faps()]
    assert names[presences:ranks] == list(MASKED_REGIONS)
    assert all(name.startswith("rank ") for name in names[ranks:])
    assert [target.column for target in axis().values()] == list(range(len(names)))


def test_au_has_a_column_for_each_side() -> None:
    assert [t.name for t in au(12)] == ["12L", "12R"]
    assert [t.name for t in au(12, "RIGHT")] == ["12R"]
    assert [t.name for t in au(26, "LEFT")] == ["26"]
    with pytest.raises(KeyError):
        au(99)


def test_mixing_order_exists_for_all_aus_but_rotations() -> None:
    assert [mixing_order(number).name for number in (1, 12, 43)] == ["rank 1", "rank 12", "rank 43"]
    for turn in (51, 63, 99):
        with pytest.raises(KeyError):
            mixing_order(turn)


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
        (mask_channel("eyes"), "eyes"),
        (mask_channel("lips"), "face"),
        (mask_channel("blinks"), "idle"),
        (mask_channel("motion"), "idle"),
        (mask_channel("successive"), "face"),
        (mixing_order(12), "face"),
    ],
)
def test_region_of_a_target(target: object, wanted: str) -> None:
    assert region(target) == wanted  # type: ignore[arg-type]


def test_au_row_has_intensities_by_side_and_zeros_elsewhere() -> None:
    row = au_row({(12, "LEFT"): 0.5, (4, "BOTH"): 1.0})
    found = {name: float(row[target.column]) for name, target in axis().items() if row[target.column]}
    assert found == {"12L": 0.5, "4L": 1.0, "4R": 1.0}
