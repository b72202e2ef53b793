"""A builder that collects the parts of a finding."""

from __future__ import annotations

from dataclasses import dataclass, field

from bml_schema.source import Source
from bml_schema.tolerant_scanner import Element
from realizer.checking.finding import Label


@dataclass
class FindingBuilder:
    """The parts of the finding for a warning.

    Attributes:
        source: the text with its positions.
        id: block, "block:behaviour", or constraint.
        line, path: place in the warning, or None and "".
        head: first line; "" for the text of the warning.
        labels, notes: those of the finding.
        element: element that the warning is about; None if unknown.
    """

    source: Source
    id: str
    line: int | None
    path: str
    head: str = ""
    labels: list[Label] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    element: Element | None = None

    def __post_init__(self) -> None:
        if self.path:
            self.element = self.source.find(self.path, line=self.line, block=self.block)
        if self.element is None and ":" in self.id:
            self.element = self.source.named(self.id.partition(":")[2], line=self.line, block=self.block)

    @property
    def block(self) -> str:
        return self.id.partition(":")[0]
