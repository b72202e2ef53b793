"""Tests of `realizer.expressions.expression`."""

import pytest

from realizer.expressions.expression import key
from realizer.expressions.library import builtin


def test_visible_duration_is_the_apex_and_half_of_onset_and_offset() -> None:
    one = builtin()["SURPRISE"]
    assert one.duration == pytest.approx(one.onset + one.apex + one.offset)
    assert one.visible_duration == pytest.approx(one.duration - (one.onset + one.offset) / 2)


def test_units_have_the_notation_of_facs() -> None:
    assert builtin()["SURPRISE"].units == "1+2+5+25+26"
    assert builtin()["RAISE_LEFT_BROW"].units == "1L+2L"


@pytest.mark.parametrize(
    "name", ["template:ironic smile", "TEMPLATE:IRONIC_SMILE", " template : ironic-smile "]
)
def test_key_is_the_same_for_all_spellings(name: str) -> None:
    assert key(name) == "TEMPLATE:IRONIC_SMILE"
