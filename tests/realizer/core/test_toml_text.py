"""Tests of the TOML parser."""

from __future__ import annotations

import pytest

from realizer.core.toml_text import parse_toml


def test_parse_toml_returns_the_values() -> None:
    text = f"a = {2**63 - 1}\n[b]\nc = [{-(2**63)}, {{ d = true }}]\n"
    assert parse_toml(text) == {"a": 2**63 - 1, "b": {"c": [-(2**63), {"d": True}]}}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("a = ", "Invalid value .at end of document"),
        ("a = 1" + 5000 * "0", "digits"),
        ("a = [0x1" + 5000 * "0" + "]", "an integer of more than 64 bits"),
        (f"[b]\nc = {2**63}", "an integer of more than 64 bits"),
        ("a = " + 5000 * "[" + 5000 * "]", "nested too deeply"),
    ],
)
def test_parse_toml_refuses_what_no_message_could_show(text: str, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        parse_toml(text)
