"""A builder of findings: collects places, labels and notes of one warning."""

from __future__ import annotations

from dataclasses import dataclass, field

from bml_schema.source import Source
from bml_schema.tolerant_scanner import Element
from realizer.checking.finding import Label


@dataclass
class FindingBuilder:
    """A finding in the making.

    Attributes:
        source: the text.
        id: of the warning: a block, "block:behaviour", or a constraint.
        line, path: from the warning; None and "" if it has none.
        head: the first line, "" while the whole text will do.
        labels, notes: as a finding has them.
        element: its source, or None while unknown.
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
