"""Findings: faults or advice with labelled places and help."""

from dataclasses import dataclass, field

from bml_schema.reading.tolerant_scanner import Element
from bml_schema.source import Source, Spot


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
        is_impossible: whether it is advice about a length that was never observed.
    """

    file: str
    type: str
    id: str
    path: str
    text: str
    head: str
    labels: tuple[Label, ...] = ()
    notes: tuple[str, ...] = ()
    is_impossible: bool = False

    @property
    def spot(self) -> Spot | None:
        first = next((label for label in self.labels if label.primary), None)
        return first.spot if first else None

    @property
    def line(self) -> int | None:
        """The line of the fault, from 1, or None if it has no place."""
        return self.spot.line if self.spot else None

    @property
    def column(self) -> int | None:
        """The column of the fault, from 1, or None if it has no place."""
        return self.spot.column if self.spot else None

    @property
    def help(self) -> str:
        """The suggestions, such as "did you mean ...?", or ""."""
        return " ".join(note.removeprefix("help: ") for note in self.notes if note.startswith("help: "))

    def __str__(self) -> str:
        """Return `file:line:column: TYPE id: line N, path: text`, on one line."""
        return self.one_line(self.text)

    def one_line(self, text: str) -> str:
        """Return the finding on one line, with another text."""
        spot = self.spot
        at = f":{spot.line}:{spot.column}" if spot else ""
        where = ", ".join(filter(None, (f"line {spot.line}" if spot else "", self.path)))
        words = " ".join(text.split())
        return f"{self.file}{at}: {self.type} {self.id}: {f'{where}: ' if where else ''}{words}"


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
