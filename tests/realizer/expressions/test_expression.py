"""One expression as a value."""

from __future__ import annotations

import pytest

from realizer.expressions.expression import key
from realizer.expressions.library import builtin


def test_it_is_seen_for_its_apex_and_half_of_coming_and_going() -> None:
    one = builtin()["SURPRISE"]
    assert one.duration == pytest.approx(one.onset + one.apex + one.offset)
    assert one.visible_duration == pytest.approx(one.duration - (one.onset + one.offset) / 2)


def test_its_units_are_written_as_facs_writes_them() -> None:
    assert builtin()["SURPRISE"].units == "1+2+5+26"
    assert builtin()["RAISE_LEFT_BROW"].units == "1L+2L"


@pytest.mark.parametrize(
    "name", ["template:ironic smile", "TEMPLATE:IRONIC_SMILE", " template : ironic-smile "]
)
def test_spellings_have_one_key(name: str) -> None:
    assert key(name) == "TEMPLATE:IRONIC_SMILE"
