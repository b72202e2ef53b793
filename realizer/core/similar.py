"""Similar names, for messages about unknown ones."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

LONGEST = 100  # characters of a name that are compared: difflib is slow
ALIKE = 3  # letters at the beginning that two names share if nothing else is similar, as HAPPY and HAPPINESS


def similar(name: str, known: Iterable[str], most: int = 3, cutoff: float = 0.6) -> list[str]:
    """Return the known names most similar to a name, at most `most`, the most similar first.

    Args:
        cutoff: the least similarity, 0..1; where no name has it, names that begin with the same letters
            are returned, except with a cutoff above the usual one.
    """
    names = list(known)
    found = get_close_matches(name[:LONGEST], names, most, cutoff)
    if found or len(name) < ALIKE or cutoff > 0.6:
        return found
    return [one for one in names if one.startswith(name[:ALIKE])][:most]


def did_you_mean(names: Iterable[str]) -> str:
    """Return ", did you mean A or B?", or "" without names."""
    words = " or ".join(names)
    return f", did you mean {words}?" if words else ""
