"""A parser of the answers of espeak-ng's process."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from realizer.core.array_types import Int16

WORD, MARK, END, PHONEME = 1, 3, 5, 7

Event = tuple[int, int, int, str]

# espeak_EVENT of speak_lib.h; `text` is a phoneme's, eight bytes without an end where all eight are used.
LAYOUT = np.dtype(
    [
        ("type", np.intc),
        ("unique_identifier", np.uintc),
        ("place", np.intc),
        ("length", np.intc),
        ("audio_position", np.intc),
        ("sample", np.intc),
        ("user_data", np.uintp),
        ("text", "S8"),
    ],
    align=True,
)


def read_answer(head: Mapping[str, Any], body: bytes) -> tuple[list[Event], Int16]:
    """(type, sample, place, text) in order, of those that are of use, and (n,) int16 that nobody can write.

    `text` is a phoneme's IPA or a mark's name.

    Args:
        head, body: of the answer to "say", as `espeak_worker` gives them.
    """
    size: int = head["events"]
    told = np.frombuffer(body, LAYOUT, size // LAYOUT.itemsize)
    marks = iter(head["marks"])
    events: list[Event] = []
    columns = (told[name].tolist() for name in ("type", "sample", "place", "text"))
    for kind, sample, place, raw in zip(*columns, strict=True):
        if kind == PHONEME:
            events.append((kind, sample, place, _label(raw)))
        elif kind == MARK:
            events.append((kind, sample, place, next(marks)))
        elif kind in (WORD, END):
            events.append((kind, sample, place, ""))
    return events, np.frombuffer(body, "<i2", offset=size)


# A language has some hundred of them.
@lru_cache(maxsize=2048)
def _label(raw: bytes) -> str:
    return raw.split(b"\0")[0].decode("utf-8", "replace")
