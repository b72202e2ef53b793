"""A parser of JSON that also refuses text which other parts of the program could not handle."""

import json
from typing import Any

# What works on the value recursively afterwards (`repr`, `json.dumps`, pydantic) stays far from its limit.
DEEPEST = 100
# Characters of an integer; one of 64 bits has 20.
LONGEST = 24


def parse_json(text: str | bytes) -> Any:
    """Parse JSON.

    Raises:
        ValueError: the text is not JSON, is nested more than 100 deep, or has an integer of more than 24
            digits.
    """
    try:
        found = json.loads(text, parse_int=_integer)
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    brackets = (b"[", b"{") if isinstance(text, bytes) else ("[", "{")
    if sum(map(text.count, brackets)) > DEEPEST:  # type: ignore[arg-type]
        _check_depth(found)
    return found


def _integer(digits: str) -> int:
    if len(digits) > LONGEST:
        raise ValueError(f"it has an integer of {len(digits)} digits")
    return int(digits)


def _check_depth(value: object) -> None:
    level = [value]
    for _ in range(DEEPEST):
        nested = [inner for inner in level if isinstance(inner, dict | list)]
        if not nested:
            return
        level = [one for inner in nested for one in (inner.values() if isinstance(inner, dict) else inner)]
    raise ValueError("it is nested too deeply")
