"""Findings: faults or advice with labelled places and help."""

from __future__ import annotations

from dataclasses import dataclass

from bml_schema.source import Spot


@dataclass(frozen=True, slots=True)
class Label:
    """A labelled place; `primary` marks the fault itself, other labels mark conflicting places."""

    spot: Spot
    text: str = ""
    primary: bool = True


@dataclass(frozen=True, slots=True)
class Finding:
    """A fault of a document, or advice.

    Attributes:
        file: name of the file.
        type: BML warning type, or "ADVICE".
        id: block, "block:behaviour", or constraint.
        path: path of the element, or "".
        text: full text, on one line.
        head: shorter text for use with labels and notes.
        labels: marked places; the first primary one gives line and column of the finding.
        notes: sentences below the source, such as "help: did you mean ...?".
    """

    file: str
    type: str
    id: str
    path: str
    text: str
    head: str
    labels: tuple[Label, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def spot(self) -> Spot | None:
        first = next((label for label in self.labels if label.primary), None)
        return first.spot if first else None
