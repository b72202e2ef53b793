"""The text of documents and an element path in, line, column and length of what stands there out.

The parser knows lines only; this reads the text once more, forgivingly, to underline what a fault means.
"""

from __future__ import annotations

import codecs
import html
import re
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

__all__: list[str] = []

_OPENER = re.compile(r"<!--|<!\[CDATA\[|<!DOCTYPE|<\?|</|<(?=[^\s<>/='\"!?])")
_CLOSER = {"<!--": "-->", "<![CDATA[": "]]>", "<?": "?>", "<!DOCTYPE": ">"}
_NAME = re.compile(r"[^\s<>/='\"]+")
_ATTRIBUTE = re.compile(r"""\s*([^\s<>/='"]+)\s*=\s*(?:"([^"<]*)"|'([^'<]*)')""")
_TAG_END = re.compile(r"\s*/?>")
_SLIPPED = re.compile(r"\s*([^\s<>/='\"]+)(?:\s*=\s*([^\s<>]*))?")
_BAD_ENTITY = re.compile(r"&(?!(?:amp|lt|gt|quot|apos|#[0-9]+|#x[0-9a-fA-F]+);)[^\s<>;\"'&]{0,30};?")
_STEP = re.compile(r"([^/\[\]]+)(?:\[([0-9]{1,9})\])?")
_ENCODING = re.compile(rb"""<\?xml[^>]*?encoding\s*=\s*["']([A-Za-z0-9._-]+)["']""")
_WHOLE_DOCUMENT = "bml"


class Spot(NamedTuple):
    """Where something stands in a text: line and column from 1, length in characters, not beyond its line."""

    line: int
    column: int
    length: int


class Slip(NamedTuple):
    """A place that no XML parser takes, what is wrong there, and the offset of what it does not fit or -1."""

    offset: int
    length: int
    text: str
    related: int = -1


@dataclass(slots=True)
class Element:
    """A start tag.

    Attributes:
        name: as written, with its prefix.
        offset, end: of "<", and behind ">".
        attributes: name as written -> (offset, end) of its value without the quotes.
        parent: number of the element around it, -1 for none.
        nth: which one of its name among the children of its parent, from 1.
        root: number of the nearest <bml> around it, itself included, -1 for none.
    """

    name: str
    offset: int
    end: int
    parent: int
    nth: int = 1
    root: int = -1
    attributes: dict[str, tuple[int, int]] = field(default_factory=dict)


class Source:
    """A text with any number of documents, whole or broken.

    Args:
        text: as it was read; bytes in any encoding the parser takes, wrong ones become U+FFFD.

    Attributes:
        text: decoded.
        elements: every start tag, in order.
        slips: what is not well-formed, as far as that is seen, in order.
    """

    def __init__(self, text: str | bytes) -> None:
        self.text = _decoded(text) if isinstance(text, bytes) else text
        self.elements: list[Element] = []
        self.slips: list[Slip] = []
        self._starts = [0, *(m.end() for m in re.finditer("\n", self.text))]
        self._children: dict[tuple[int, str, int], int] = {}
        self._roots: list[int] = []
        self._ids: dict[str, list[Element]] = {}
        _Scan(self).run()
        self.slips.sort()

    def line(self, number: int) -> str:
        """The text of a line without its end; "" where there is no such line."""
        if not 1 <= number <= len(self._starts):
            return ""
        end = self._starts[number] - 1 if number < len(self._starts) else len(self.text)
        return self.text[self._starts[number - 1] : end].removesuffix("\r")

    def line_of(self, offset: int) -> int:
        return bisect_right(self._starts, offset)

    def spot(self, offset: int, end: int) -> Spot:
        """The part of text[offset:end] on its first line; at least one character long."""
        number = self.line_of(offset)
        column = offset - self._starts[number - 1]
        longest = len(self.line(number)) - column
        return Spot(number, column + 1, max(1, min(end - offset, longest)))

    def locate(
        self, path: str, attribute: str = "", *, line: int | None = None, block: str | None = None
    ) -> Spot:
        """Where the value of an attribute stands, or the name of the element where it has no such attribute.

        Args:
            path: of the element, such as "/bml/required[1]/head[2]".
            attribute: its name, with prefix, as a Clark name, or its local part.
            line: where the element's start tag begins; tells documents of one text apart.
            block: id of the document; likewise.

        Returns:
            The place; the line alone, without blanks around it, where the path leads nowhere.
        """
        element = self.find(path, line=line, block=block)
        if element is None:
            return self.whole_line(line or 1)
        return self.locate_in(element, attribute)

    def locate_in(self, element: Element, attribute: str) -> Spot:
        """Where the value of an attribute stands, or the element's name where it has no such attribute."""
        value = self.value_span(element, attribute)
        return self.spot(*value) if value else self.name_spot(element)

    def find(self, path: str, *, line: int | None = None, block: str | None = None) -> Element | None:
        """The element at a path; of several documents the one that fits line and id best."""
        steps = [(m[1], int(m[2] or 1)) for m in _STEP.finditer(path)]
        if not steps or steps[0][0] != _WHOLE_DOCUMENT:
            return None
        found = [e for root in self._roots if (e := self._below(root, steps[1:])) is not None]
        return self._best(found, line, block)

    def named(self, id: str, *, line: int | None = None, block: str | None = None) -> Element | None:
        """The first element with an id; of several documents the one that fits line and block id best."""
        return self._best(self._ids.get(id, []), line, block)

    def document(self, id: str) -> Element | None:
        """The last <bml> with an id."""
        roots = (self.elements[n] for n in reversed(self._roots))
        return next((root for root in roots if self.id(root) == id), None)

    def inside(self, element: Element) -> Iterator[Element]:
        """The elements of the document that an element belongs to."""
        return (e for e in self.elements if e.root == element.root)

    def below(self, element: Element) -> Iterator[Element]:
        """The elements inside an element, in order."""
        first = bisect_right(self.elements, element.offset, key=lambda e: e.offset)
        around = {first - 1}
        for number in range(first, len(self.elements)):
            if self.elements[number].parent not in around:
                return
            around.add(number)
            yield self.elements[number]

    def on_line(self, line: int) -> Iterator[Element]:
        """The elements whose start tag begins on a line."""
        first = bisect_right(self.elements, self._starts[line - 1] - 1, key=lambda e: e.offset)
        for number in range(first, len(self.elements)):
            if self.line_of(self.elements[number].offset) != line:
                return
            yield self.elements[number]

    def block(self, element: Element) -> str:
        """The id of the document that an element belongs to; "" for none."""
        return self.id(self.elements[element.root]) if element.root >= 0 else ""

    def id(self, element: Element) -> str:
        return self.value(element, "id").strip()

    def path(self, element: Element) -> str:
        """The path of an element from its <bml>."""
        steps = ""
        while element.parent >= 0 and element is not self.elements[element.root]:
            steps = f"/{element.name.rpartition(':')[2]}[{element.nth}]{steps}"
            element = self.elements[element.parent]
        return f"/{_WHOLE_DOCUMENT}{steps}"

    def value(self, element: Element, attribute: str) -> str:
        """What an attribute holds; "" where there is none."""
        span = self.value_span(element, attribute)
        return html.unescape(self.text[span[0] : span[1]]) if span else ""

    def value_span(self, element: Element, attribute: str) -> tuple[int, int] | None:
        """Offsets of an attribute's value, None where there is none."""
        if attribute in element.attributes:
            return element.attributes[attribute]
        wanted = attribute.rpartition("}")[2]
        for name, span in element.attributes.items():
            prefix, _, local = name.rpartition(":")
            if local == wanted and prefix != "xmlns":
                return span
        return None

    def name_spot(self, element: Element) -> Spot:
        """The name in a start tag."""
        return self.spot(element.offset + 1, element.offset + 1 + len(element.name))

    def attribute_spot(self, element: Element, attribute: str) -> Spot:
        """The name of an attribute, or of the element where it has no such."""
        span = self.value_span(element, attribute)
        if span is None:
            return self.name_spot(element)
        local = attribute.rpartition("}")[2]
        start = self.text.rindex(local, element.offset, span[0])
        return self.spot(start, start + len(local))

    def whole_line(self, number: int) -> Spot:
        """A line from its first to its last character that is no blank."""
        text = self.line(number)
        blanks = len(text) - len(text.lstrip())
        return Spot(number, blanks + 1, max(1, len(text.strip())))

    def slip(self, line: int) -> Slip | None:
        """What is not well-formed on a line, or above it in the same document: parsers notice some late."""
        on = next((s for s in self.slips if self.line_of(s.offset) == line), None)
        if on is not None:
            return on
        roots = (self.elements[n].offset for n in self._roots)
        first = max((r for r in roots if self.line_of(r) <= line), default=0)
        above = [s for s in self.slips if first <= s.offset and self.line_of(s.offset) < line]
        return above[-1] if above else None

    def _below(self, root: int, steps: list[tuple[str, int]]) -> Element | None:
        here: int | None = root
        for name, n in steps:
            here = self._children.get((here, name, n)) if here is not None else None
        return self.elements[here] if here is not None else None

    def _best(self, found: list[Element], line: int | None, block: str | None) -> Element | None:
        def fits(element: Element) -> tuple[bool, bool, bool]:
            # Of a tag over several lines the parser may know its last one only.
            begins, ends = (line == self.line_of(offset) for offset in (element.offset, element.end - 1))
            return begins, ends, block is not None and self.block(element) == block

        return max(found, key=fits, default=None)


class _Scan:
    """One pass over the text of a source; linear in it, whatever it holds."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.text = source.text
        self.open: list[int] = []
        self.names: dict[str, int] = {}  # how many of these are open
        self.counts: dict[tuple[int, str], int] = {}
        self.never: set[str] = set()  # closers that do not come any more

    def run(self) -> None:
        here = 0
        while found := _OPENER.search(self.text, here):
            self.entities(here, found.start())
            here = self.tag(found[0], found.start(), found.end())
        self.entities(here, len(self.text))
        if self.open:
            first = self.source.elements[self.open[-1]]
            end = len(self.text.rstrip())
            words = f"<{first.name}> is never closed"
            self.source.slips.append(Slip(max(0, end - 1), 1, words, first.offset))

    def tag(self, opener: str, start: int, end: int) -> int:
        """Read what begins at `start`; returns where to go on."""
        if opener in _CLOSER:
            closer = _CLOSER[opener]
            close = -1 if closer in self.never else self.text.find(closer, end)
            if close < 0:
                self.never.add(closer)
                self.source.slips.append(Slip(start, len(opener), f"{opener} is never closed by {closer}"))
                return end
            return close + len(closer)
        name = _NAME.match(self.text, end)
        if opener == "</":
            return self.close(name[0] if name else "", start, name.end() if name else end)
        assert name is not None
        return self.start_tag(name[0], start, name.end())

    def start_tag(self, name: str, start: int, here: int) -> int:
        source, parent = self.source, self.open[-1] if self.open else -1
        number = len(source.elements)
        local = name.rpartition(":")[2]
        element = Element(name, start, here, parent)
        element.root = (
            number if local == _WHOLE_DOCUMENT else source.elements[parent].root if self.open else -1
        )
        nth = self.counts[parent, local] = self.counts.get((parent, local), 0) + 1
        element.nth = nth
        source.elements.append(element)
        source._children[parent, local, nth] = number
        while not (end := _TAG_END.match(self.text, here)):
            found = _ATTRIBUTE.match(self.text, here)
            if found is None:
                here = self.slipped(name, here)
                break
            key, quoted = found[1], 2 if found[2] is not None else 3
            if key in element.attributes:
                words = f"{key} is given twice"
                source.slips.append(Slip(found.start(1), len(key), words, element.attributes[key][0]))
            else:
                element.attributes[key] = found.span(quoted)
            self.entities(*found.span(quoted))
            here = found.end()
        element.end = end.end() if end else here
        if element.root == number:
            source._roots.append(number)
        elif element.root >= 0 and "id" in element.attributes:
            source._ids.setdefault(source.id(element), []).append(element)
        if not end or self.text[end.end() - 2] != "/":
            self.open.append(number)
            self.names[name] = self.names.get(name, 0) + 1
        return element.end

    def slipped(self, tag: str, here: int) -> int:
        """Say what is wrong in a start tag; returns where to look for the next tag."""
        slips, text = self.source.slips, self.text
        found = _SLIPPED.match(text, here)
        if found is None:
            at = here + len(text[here : here + 200]) - len(text[here : here + 200].lstrip())
            slips.append(Slip(at, 1, f"wanted an attribute or the end of <{tag}>"))
            return here
        name, value = found[1], found[2]
        if value is None:
            slips.append(Slip(found.start(1), len(name), f'wanted {name}="...", got no value'))
        elif value[:1] in ('"', "'"):
            slips.append(
                Slip(found.start(2), len(value), f"the value of {name} is never closed by {value[0]}")
            )
        else:
            slips.append(
                Slip(found.start(2), max(1, len(value)), f"wanted quotes around the value of {name}")
            )
        return found.end()

    def close(self, name: str, start: int, end: int) -> int:
        elements = self.source.elements
        if self.names.get(name):
            if elements[self.open[-1]].name != name:
                inner = elements[self.open[-1]]
                words = f"wanted </{inner.name}>, got </{name}>"
                self.source.slips.append(Slip(start, end - start, words, inner.offset))
            while self.names.get(name):
                last = elements[self.open.pop()].name
                self.names[last] -= 1
                if last == name:
                    break
        elif self.open:
            inner = elements[self.open[-1]]
            words = f"wanted </{inner.name}>, got </{name}>"
            self.source.slips.append(Slip(start, end - start, words, inner.offset))
        else:
            self.source.slips.append(Slip(start, end - start, f"</{name}> closes nothing"))
        return end

    def entities(self, start: int, end: int) -> None:
        for found in _BAD_ENTITY.finditer(self.text, start, end):
            if found[0].endswith(";"):
                words = f"no entity {found[0]} in XML, write the character itself"
            else:
                words = "wanted &amp; for the character &"
            self.source.slips.append(Slip(found.start(), len(found[0]), words))


def _decoded(data: bytes) -> str:
    """Text of bytes, by BOM, declaration or as UTF-8; what is no text becomes U+FFFD."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16", "replace")
    named = _ENCODING.match(data.removeprefix(codecs.BOM_UTF8).lstrip())
    try:
        return data.decode(named[1].decode() if named else "utf-8", "replace")
    except LookupError:
        return data.decode("utf-8", "replace")
