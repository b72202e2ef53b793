"""Tests of the usual and the required ranges of FAPs."""

import pytest

from realizer.tables import au_to_fap, faps
from realizer_studio.faces.mpeg4.fap_limits import accompanying_faps, required_range, usual_range


def test_usual_range_is_inside_the_coding_range() -> None:
    for row in faps()[2:]:
        for sign, most in ((1, row.most), (-1, -row.least)):
            if most > 0:
                assert 0 < usual_range(row.fap, sign) <= most


@pytest.mark.parametrize(("fap", "least"), [(6, 150), (33, 160), (61, 100), (65, 100)])
def test_required_range_is_no_less_than_usual(fap: int, least: float) -> None:
    assert required_range(fap, -1) >= max(least, usual_range(fap, -1))


def test_usual_range_of_a_lower_lip_leaves_out_the_jaw() -> None:
    whole = accompanying_faps(52, -1)
    assert -whole[52] > usual_range(52, -1)
    assert whole[3] > 0


@pytest.mark.parametrize(("fap", "sign"), [(19, 1), (31, 1), (12, 1), (52, -1)])
def test_accompanying_faps_are_of_the_strongest_unit(fap: int, sign: int) -> None:
    most = max(sign * row.fap_to for row in au_to_fap() if row.fap == fap)
    assert sign * accompanying_faps(fap, sign)[fap] == most


def test_accompanying_faps_of_ears_are_none() -> None:
    assert accompanying_faps(65, 1) == {}
