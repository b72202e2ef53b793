"""Tests of `realizer.core.json_reader`."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.core.json_reader import DEEPEST, parse_json

VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**63), 2**64) | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
)


@given(VALUES)
def test_parse_json_reads_what_json_writes(value: object) -> None:
    text = json.dumps(value)
    assert parse_json(text) == parse_json(text.encode()) == value


@pytest.mark.parametrize("depth", [DEEPEST, DEEPEST + 1, 900, 990, 1000, 100_000])
@pytest.mark.parametrize(("opens", "closes"), [("[", "]"), ('{"a":', "}"), ('[{"a":', "}]")])
def test_parse_json_refuses_what_is_nested_too_deeply(depth: int, opens: str, closes: str) -> None:
    text = opens * depth + "1" + closes * depth
    if depth * opens.count("[") + depth * opens.count("{") <= DEEPEST:
        assert parse_json(text) == json.loads(text)
        return
    for form in (text, text.encode()):
        with pytest.raises(ValueError, match="nested too deeply"):
            parse_json(form)


def test_parse_json_takes_many_shallow_values() -> None:
    assert len(parse_json(json.dumps([[{}]] * 1000))) == 1000


@pytest.mark.parametrize("digits", [25, 5_000, 100_000])
def test_parse_json_refuses_integers_of_thousands_of_digits(digits: int) -> None:
    with pytest.raises(ValueError, match=f"an integer of {digits} digits"):
        parse_json('{"a": [' + "7" * digits + "]}")
