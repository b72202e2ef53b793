"""What the names of a head's materials, meshes and nodes say of its parts."""

import re
from dataclasses import dataclass
from functools import cache

from realizer.tables import csv_rows


@dataclass(frozen=True)
class _Rule:
    part: str
    pattern: str


@cache
def _rules() -> tuple[_Rule, ...]:
    return csv_rows("parts.csv", _Rule, __package__)


def part_of(names: tuple[str, ...]) -> str:
    """Return the part that the names of a material, a mesh and a node suggest, or "".

    A name that says skin is a last resort: whole heads are called so, with all that is in them.
    """
    weak = ""
    for name in names:
        rule = next((rule for rule in _rules() if re.search(rule.pattern, name.lower())), None)
        if rule is not None and rule.part != "skin":
            return rule.part
        weak = weak or (rule.part if rule is not None else "")
    return weak
