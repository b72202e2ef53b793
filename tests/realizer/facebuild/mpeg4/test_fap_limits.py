"""What is usual of a FAP comes from what action units ask of it."""

import pytest

from realizer.facebuild.mpeg4.fap_limits import accompanying_faps, required_range, usual_range
from realizer.tables import au_to_fap, faps


def test_every_displacement_has_a_usual_reach_inside_the_coding_range() -> None:
    for row in faps()[2:]:
        for sign, most in ((1, row.most), (-1, -row.least)):
            if most > 0:
                assert 0 < usual_range(row.fap, sign) <= most


@pytest.mark.parametrize(("fap", "least"), [(6, 150), (33, 160), (61, 100), (65, 100)])
def test_what_a_face_bears_is_no_less_than_usual_or_faces_reach(fap: int, least: float) -> None:
    assert required_range(fap, -1) >= max(least, usual_range(fap, -1))


def test_a_lower_lip_counts_what_it_does_beyond_its_jaw() -> None:
    whole = accompanying_faps(52, -1)
    assert -whole[52] > usual_range(52, -1)
    assert whole[3] > 0


@pytest.mark.parametrize(("fap", "sign"), [(19, 1), (31, 1), (12, 1), (52, -1)])
def test_company_is_the_action_unit_that_asks_most(fap: int, sign: int) -> None:
    most = max(sign * row.fap_to for row in au_to_fap() if row.fap == fap)
    assert sign * accompanying_faps(fap, sign)[fap] == most


def test_nobody_asks_for_ears() -> None:
    assert accompanying_faps(65, 1) == {}
