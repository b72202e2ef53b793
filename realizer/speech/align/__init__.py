"""A recording and what it says in, when it says each word and phoneme out."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from realizer.speech.align.aligner import Aligner, align
    from realizer.speech.align.alignment import AlignError, Alignment
    from realizer.speech.align.recording_marks import recorded

__all__ = ["AlignError", "Aligner", "Alignment", "align", "recorded"]

_HOME = {"AlignError": "alignment", "Alignment": "alignment", "recorded": "given"}


def __getattr__(name: str) -> Any:
    if name in __all__:
        found = getattr(import_module(f"{__name__}.{_HOME.get(name, 'aligner')}"), name)
        globals()[name] = found
        return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
