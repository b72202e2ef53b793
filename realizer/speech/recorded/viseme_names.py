"""A table from viseme names of other systems to phonemes."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from realizer import tables


@dataclass(frozen=True, slots=True)
class NamedViseme:
    """A row of the table; `ipa` is "" for silence."""

    set: str
    viseme: str
    ipa: str


def sound_of(set: str, viseme: str) -> str:
    """Return the IPA whose mouth shape the viseme is; "" for silence.

    Raises:
        KeyError: if there is no such set, or no such viseme in it; the text lists the known ones.
    """
    if set not in _sounds():
        raise KeyError(f"wanted a set of visemes of {', '.join(_sounds())}, got {set!r}")
    known = _sounds()[set]
    if viseme not in known:
        raise KeyError(f"wanted a viseme of {set}: {', '.join(known)}; got {viseme!r}")
    return known[viseme]


@cache
def _sounds() -> Mapping[str, Mapping[str, str]]:
    rows = tables.csv_rows("visemes_given.csv", NamedViseme)
    return {
        name: {r.viseme: r.ipa for r in rows if r.set == name} for name in dict.fromkeys(r.set for r in rows)
    }
