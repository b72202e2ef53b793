"""Faults of documents: an error if no block results, a problem if only a part is dropped.

BMLError               no block: too big, no usable id, not a <bml>
├── BMLSizeError       too many bytes or behaviours
└── BMLSyntaxError     not well-formed XML, or XML with a DTD or entities
"""

import difflib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import NamedTuple

from lxml.etree import _Element

# Warning types of the standard, in its (American) spelling.
PARSING_FAILURE = "PARSING_FAILURE"
BEHAVIOR_TYPE_NOT_SUPPORTED = "BEHAVIOR_TYPE_NOT_SUPPORTED"
CUSTOM_BEHAVIOR_NOT_SUPPORTED = "CUSTOM_BEHAVIOR_NOT_SUPPORTED"
CUSTOM_ATTRIBUTE_NOT_SUPPORTED = "CUSTOM_ATTRIBUTE_NOT_SUPPORTED"
# A type of our own: the document is in a dialect, and the text says how it was read.
NOT_BML_1_0 = "NOT_BML_1_0"


class Place(NamedTuple):
    """A position: 1-based line in the text (where the start tag begins), and element path."""

    line: int
    path: str

    def with_place(self, text: str) -> str:
        """Return a sentence with the place in front."""
        return at(self.line, self.path, text)


def at(line: int | None, path: str, text: str) -> str:
    """Return one sentence with its place: `line 3, /bml/head[1]: amount: wanted 0..1, got 7`."""
    where = ", ".join(filter(None, (f"line {line}" if line else "", path)))
    return f"{where}: {text}" if where else text


class BMLError(Exception):
    """The error for a stretch of text without a block.

    Attributes:
        text: expected and actual value, without the place.
        line: 1-based line in the text, or None.
        path: element path such as "/bml"; "" if the text is not well-formed.
        block: the block's id, or None if it could not be read.
    """

    def __init__(
        self, text: str, *, line: int | None = None, path: str = "", block: str | None = None
    ) -> None:
        super().__init__(at(line, path, text))
        self.text = text
        self.line = line
        self.path = path
        self.block = block

    def __reduce__(self) -> tuple[object, ...]:
        # Errors are pickled (batch workers), and the default does not keep keyword arguments.
        return partial(type(self), line=self.line, path=self.path, block=self.block), (self.text,)


class BMLSizeError(BMLError):
    """The document has too many bytes or behaviours."""


class BMLSyntaxError(BMLError):
    """The text is not well-formed XML, or has a DTD or entities."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """A part of a document that was dropped while parsing; it becomes one BML warning."""

    id: str  # "block:behaviour" ("block:path" for a behaviour without id), "block:constraint", or the block's
    type: str  # BML warning type, such as PARSING_FAILURE
    text: str  # expected and actual value, without the place; str(problem) includes the place
    line: int  # position of the fault
    path: str  # position of the fault
    # What was dropped with it: "behaviour:sync" for a reference, a constraint's id or path.
    lost_references: tuple[str, ...] = ()
    fatal: bool = False  # the whole block is dropped, because the part was inside <required>
    dropped: bool = True  # a behaviour or constraint was dropped; if false only attributes were

    def __str__(self) -> str:
        return at(self.line, self.path, self.text)


class Fault(Exception):
    """A fault of an element; it becomes the Problem of the behaviour or constraint around it.

    Attributes:
        path: of the element in its behaviour, if that is not where the element is now; else None.
    """

    def __init__(
        self, text: str, element: _Element, type: str = PARSING_FAILURE, path: str | None = None
    ) -> None:
        super().__init__(text)
        self.path = path
        self.text = text
        self.element = element
        self.type = type


_LONGEST_SHOWN = 60  # characters of a value in a message


def quoted(value: str) -> str:
    """Format a value for a message: numbers bare, everything else quoted, long values cut."""
    if len(value) > _LONGEST_SHOWN:
        value = value[:_LONGEST_SHOWN] + "..."
    return value if re.fullmatch(r"[+-]?[0-9.]+", value) else f'"{value}"'


def listed(words: Sequence[str], most: int = 10) -> str:
    """Return `a, b and 3 more`, with at most so many words."""
    rest = len(words) - most
    return ", ".join(words[:most]) + (f" and {rest} more" if rest > 0 else "")


_MAX_CHOICES = 500  # difflib is slow; this many take about a millisecond


def did_you_mean(word: str, choices: Iterable[str], cutoff: float = 0.6) -> str:
    """Return `, did you mean "nod1"?` if one of the first 500 choices is close, else ""."""
    if len(word) > _LONGEST_SHOWN:
        return ""
    near = difflib.get_close_matches(
        word, [c for c in islice(choices, _MAX_CHOICES) if len(c) <= _LONGEST_SHOWN], cutoff=cutoff
    )
    return f', did you mean "{near[0]}"?' if near else ""
