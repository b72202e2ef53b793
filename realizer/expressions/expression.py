"""The expression value: action units, meaning and duration."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from realizer.tables.timing import Gap

LETTERS = {"LEFT": "L", "RIGHT": "R", "BOTH": ""}


@dataclass(frozen=True, slots=True)
class Expression:
    """A named facial expression (Wojdel 2005, 5.4.1).

    Attributes:
        name: name as written, such as "template:surprise" or "SMILE".
        features: description of the visible features.
        means: words and phrases for searching.
        aus: (AU, side LEFT | RIGHT | BOTH) -> intensity 0..1 at intensity 1.
        gaps: onset, apex and offset, in seconds.
        possible, probable: least and most seconds for which people show it; None if unknown.
        source: where the expression comes from.
        file: file of a user's expression; None for a built-in one.
    """

    name: str
    features: str
    means: tuple[str, ...]
    aus: Mapping[tuple[int, str], float]
    gaps: tuple[Gap, Gap, Gap]
    possible: tuple[float, float] | None = None
    probable: tuple[float, float] | None = None
    source: str = ""
    file: Path | None = None

    @property
    def onset(self) -> float:
        """Seconds of the onset."""
        return self.gaps[0].preferred

    @property
    def apex(self) -> float:
        """Seconds of the apex."""
        return self.gaps[1].preferred

    @property
    def offset(self) -> float:
        """Seconds of the offset."""
        return self.gaps[2].preferred

    @property
    def duration(self) -> float:
        """Seconds from the start of the onset to the end of the offset."""
        return self.onset + self.apex + self.offset

    @property
    def visible_duration(self) -> float:
        """Seconds for which it is visible: the apex, and half of onset and offset."""
        return self.onset / 2 + self.apex + self.offset / 2

    @property
    def units(self) -> str:
        """The action units in the notation of FACS: "1+2+12L"."""
        return "+".join(f"{au}{LETTERS[side]}" for au, side in self.aus)

    def to_json(self) -> dict[str, Any]:
        """Return the expression as JSON; a range without an end has null there."""

        def bounds(ends: tuple[float, float] | None) -> list[float | None] | None:
            return None if ends is None else [end if end < float("inf") else None for end in ends]

        return {
            "name": self.name,
            "features": self.features,
            "means": list(self.means),
            "aus": {f"{au}{LETTERS[side]}": value for (au, side), value in self.aus.items()},
            **{
                name: {"seconds": round(gap.preferred, 4), "source": gap.source}
                for name, gap in zip(("onset", "apex", "offset"), self.gaps, strict=True)
            },
            "possible": bounds(self.possible),
            "probable": bounds(self.probable),
            "source": self.source,
            "file": None if self.file is None else str(self.file),
        }


@lru_cache(maxsize=4096)
def key(name: str) -> str:
    """Return the key of a name, which ignores case and separators."""
    return re.sub(r"[\s_-]+", "_", re.sub(r"\s*:\s*", ":", name.strip())).upper()
