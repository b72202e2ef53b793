"""Source positions: line, column and length of an element or attribute in a text.

The parser only knows lines; this module scans the text again, and tolerates errors.
"""

import html
import re
from bisect import bisect_right
from collections.abc import Iterator
from typing import NamedTuple

from bml_schema.errors import BMLError
from bml_schema.reading.encodings import decode
from bml_schema.reading.tolerant_scanner import DOCUMENT, Element, ScanError, scan

_STEP = re.compile(r"([^/\[\]]+)(?:\[([0-9]{1,9})\])?")


class Spot(NamedTuple):
    """A position: line and column from 1, and a length in characters that does not exceed the line."""

    line: int
    column: int
    length: int


class Source:
    """A text with any number of documents, well-formed or not.

    Args:
        text: str, or bytes in any encoding the parser takes; undecodable bytes become U+FFFD.

    Attributes:
        text: decoded.
        elements: every start tag, in order.
        errors: places that are not well-formed, in order.
    """

    def __init__(self, text: str | bytes) -> None:
        self.text = _decoded(text) if isinstance(text, bytes) else text
        self.elements, self.errors = scan(self.text)
        self._starts = [0, *(m.end() for m in re.finditer("\n", self.text))]
        self._line = 0, ""  # the last result of `line`
        self._children = {
            (e.parent, e.name.rpartition(":")[2], e.nth): n for n, e in enumerate(self.elements)
        }
        self._roots = [n for n, e in enumerate(self.elements) if e.root == n]
        self._ids: dict[str, list[Element]] = {}
        for n, e in enumerate(self.elements):
            if e.root not in (-1, n) and "id" in e.attributes:
                self._ids.setdefault(self.id(e), []).append(e)

    def line(self, number: int) -> str:
        """Return the text of a line without its line end, or "" if there is no such line."""
        if not 1 <= number <= len(self._starts):
            return ""
        if self._line[0] != number:  # one line can hold a whole document with many faults
            self._line = number, self.text[self._starts[number - 1] : self._end_of(number)]
        return self._line[1]

    def _end_of(self, number: int) -> int:
        """Return the offset of the end of a line."""
        end = self._starts[number] - 1 if number < len(self._starts) else len(self.text)
        return end - (self.text[end - 1 : end] == "\r" and end > self._starts[number - 1])

    def line_of(self, offset: int) -> int:
        return bisect_right(self._starts, offset)

    def spot(self, offset: int, end: int) -> Spot:
        """Return the part of text[offset:end] on its first line; at least one character long."""
        number = self.line_of(offset)
        column = offset - self._starts[number - 1]
        longest = self._end_of(number) - offset
        return Spot(number, column + 1, max(1, min(end - offset, longest)))

    def locate(
        self, path: str, attribute: str = "", *, line: int | None = None, block: str | None = None
    ) -> Spot:
        """Return the position of an attribute's value, or of the element's name if it has no such attribute.

        Args:
            path: of the element, such as "/bml/required[1]/head[2]".
            attribute: its name, with prefix, as a Clark name, or its local part.
            line: where the element's start tag begins; selects one of several documents.
            block: id of the document; likewise.

        Returns:
            The position; that of the whole line if no element has this path.
        """
        element = self.find(path, line=line, block=block)
        if element is None:
            return self.whole_line(line or 1)
        return self.locate_in(element, attribute)

    def locate_in(self, element: Element, attribute: str) -> Spot:
        """Return the position of an attribute's value, or of the element's name if there is none."""
        value = self.value_span(element, attribute)
        return self.spot(*value) if value else self.name_spot(element)

    def find(self, path: str, *, line: int | None = None, block: str | None = None) -> Element | None:
        """Return the element at a path; of several documents the one that matches line and id best."""
        steps = [(m[1], int(m[2] or 1)) for m in _STEP.finditer(path)]
        if not steps or steps[0][0] != DOCUMENT:
            return None
        elements = [e for root in self._roots if (e := self._below(root, steps[1:])) is not None]
        return self._best(elements, line, block)

    def named(self, id: str, *, line: int | None = None, block: str | None = None) -> Element | None:
        """Return the first element with an id; of several documents the one that fits line and block best."""
        return self._best(self._ids.get(id, []), line, block)

    def document(self, id: str) -> Element | None:
        """Return the last <bml> with an id."""
        roots = (self.elements[n] for n in reversed(self._roots))
        return next((root for root in roots if self.id(root) == id), None)

    def inside(self, element: Element) -> Iterator[Element]:
        """Return the elements of the document that an element belongs to."""
        return (e for e in self.elements if e.root == element.root)

    def below(self, element: Element) -> Iterator[Element]:
        """Yield the elements inside an element, in order."""
        first = bisect_right(self.elements, element.offset, key=lambda e: e.offset)
        parents = {first - 1}
        for number in range(first, len(self.elements)):
            if self.elements[number].parent not in parents:
                return
            parents.add(number)
            yield self.elements[number]

    def on_line(self, line: int) -> Iterator[Element]:
        """Yield the elements whose start tag begins on a line."""
        first = bisect_right(self.elements, self._starts[line - 1] - 1, key=lambda e: e.offset)
        for number in range(first, len(self.elements)):
            if self.line_of(self.elements[number].offset) != line:
                return
            yield self.elements[number]

    def block(self, element: Element) -> str:
        """Return the id of the document that an element belongs to, or ""."""
        return self.id(self.elements[element.root]) if element.root >= 0 else ""

    def id(self, element: Element) -> str:
        return self.value(element, "id").strip()

    def path(self, element: Element) -> str:
        """Return the path of an element from its <bml>."""
        steps = ""
        while element.parent >= 0 and element is not self.elements[element.root]:
            steps = f"/{element.name.rpartition(':')[2]}[{element.nth}]{steps}"
            element = self.elements[element.parent]
        return f"/{DOCUMENT}{steps}"

    def value(self, element: Element, attribute: str) -> str:
        """Return the value of an attribute, or ""."""
        span = self.value_span(element, attribute)
        return html.unescape(self.text[span[0] : span[1]]) if span else ""

    def value_span(self, element: Element, attribute: str) -> tuple[int, int] | None:
        """Return the offsets of an attribute's value, or None."""
        if attribute in element.attributes:
            return element.attributes[attribute]
        wanted = attribute.rpartition("}")[2]
        for name, span in element.attributes.items():
            prefix, _, local = name.rpartition(":")
            if local == wanted and prefix != "xmlns":
                return span
        return None

    def name_spot(self, element: Element) -> Spot:
        """Return the position of the name in a start tag."""
        return self.spot(element.offset + 1, element.offset + 1 + len(element.name))

    def attribute_spot(self, element: Element, attribute: str) -> Spot:
        """Return the position of an attribute's name, or of the element's name if there is none."""
        span = self.value_span(element, attribute)
        if span is None:
            return self.name_spot(element)
        local = attribute.rpartition("}")[2]
        start = self.text.rindex(local, element.offset, span[0])
        return self.spot(start, start + len(local))

    def whole_line(self, number: int) -> Spot:
        """Return the position of a line without the whitespace around it."""
        text = self.line(number)
        blanks = len(text) - len(text.lstrip())
        return Spot(number, blanks + 1, max(1, len(text.strip())))

    def error_on_line(self, line: int) -> ScanError | None:
        """Return the syntax error on a line, or the last one above it: parsers find some late."""
        on = next((s for s in self.errors if self.line_of(s.offset) == line), None)
        if on is not None:
            return on
        roots = (self.elements[n].offset for n in self._roots)
        first = max((r for r in roots if self.line_of(r) <= line), default=0)
        above = [s for s in self.errors if first <= s.offset and self.line_of(s.offset) < line]
        return above[-1] if above else None

    def _below(self, root: int, steps: list[tuple[str, int]]) -> Element | None:
        number: int | None = root
        for name, n in steps:
            number = self._children.get((number, name, n)) if number is not None else None
        return self.elements[number] if number is not None else None

    def _best(self, elements: list[Element], line: int | None, block: str | None) -> Element | None:
        def fits(element: Element) -> tuple[bool, bool, bool]:
            # Of a tag over several lines the parser may only know the last line.
            begins, ends = (line == self.line_of(offset) for offset in (element.offset, element.end - 1))
            return begins, ends, block is not None and self.block(element) == block

        return max(elements, key=fits, default=None)


def _decoded(data: bytes) -> str:
    """Decode bytes as the parser does; undecodable bytes become U+FFFD."""
    try:
        return decode(data)[0]
    except BMLError:
        return data.decode("utf-8", "replace")
