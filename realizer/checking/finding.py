"""The finding value: text, labelled places and help."""

from __future__ import annotations

from dataclasses import dataclass

from bml_schema.source import Spot


@dataclass(frozen=True, slots=True)
class Label:
    """A labelled place; `primary` for the fault itself, else for what it conflicts with."""

    spot: Spot
    text: str = ""
    primary: bool = True


@dataclass(frozen=True, slots=True)
class Finding:
    """A fault of a document, or advice.

    Attributes:
        file: as the user named it.
        type: BML warning type, or "ADVICE".
        id: of the block, "block:behaviour", or a constraint's.
        path: of the element, or "".
        text: all of it in one line.
        head: the text, if labels and notes say the rest.
        labels: the first primary one says the line and column of the whole.
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
