"""A parser of TOML that also refuses text which other parts of the program could not handle."""

import tomllib
from typing import Any

LARGEST = 2**63  # TOML promises 64 bits; Python does not print numbers of thousands of digits


def parse_toml(text: str) -> dict[str, Any]:
    """Parse TOML.

    Raises:
        ValueError: the text is not TOML, is nested too deeply, or has an integer of more than 64 bits.
    """
    try:
        found = tomllib.loads(text)
        _check(found)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    return found


def _check(value: object) -> None:
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        for inner in value:
            _check(inner)
    elif isinstance(value, int) and not -LARGEST <= value < LARGEST:
        raise ValueError("it has an integer of more than 64 bits")
