"""A parser of the answers of espeak-ng's process."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from realizer.core.array_types import Int16

WORD, MARK, END, PHONEME = 1, 3, 5, 7

Event = tuple[int, int, int, str]

# espeak_EVENT of speak_lib.h; `text` is a phoneme, which has no terminating 0 if it takes all eight bytes.
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
    """Parse an answer to "say" of `espeak.worker`.

    Returns:
        (type, sample, place, text) of words, marks, phonemes and ends in order, where `text` is a phoneme's
        IPA or a mark's name; and (n,) int16 samples, read-only.
    """
    size: int = head["events"]
    fields = np.frombuffer(body, LAYOUT, size // LAYOUT.itemsize)
    marks = iter(head["marks"])
    events: list[Event] = []
    columns = (fields[name].tolist() for name in ("type", "sample", "place", "text"))
    for kind, sample, place, raw in zip(*columns, strict=True):
        if kind == PHONEME:
            events.append((kind, sample, place, _label(raw)))
        elif kind == MARK:
            events.append((kind, sample, place, next(marks)))
        elif kind in (WORD, END):
            events.append((kind, sample, place, ""))
    return events, np.frombuffer(body, "<i2", offset=size)


# A language has about a hundred.
@lru_cache(maxsize=2048)
def _label(raw: bytes) -> str:
    return raw.split(b"\0")[0].decode("utf-8", "replace")
