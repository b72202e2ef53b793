"""A scanner of start tags and attributes that also works on text that is not well-formed."""

import re
from dataclasses import dataclass, field
from typing import NamedTuple

DOCUMENT = "bml"
_OPENER = re.compile(r"<!--|<!\[CDATA\[|<!DOCTYPE|<\?|</|<(?=[^\s<>/='\"!?])")
_CLOSER = {"<!--": "-->", "<![CDATA[": "]]>", "<?": "?>", "<!DOCTYPE": ">"}
_NAME = re.compile(r"[^\s<>/='\"]+")
_ATTRIBUTE = re.compile(r"""\s*([^\s<>/='"]+)\s*=\s*(?:"([^"<]*)"|'([^'<]*)')""")
_TAG_END = re.compile(r"\s*/?>")
_BROKEN_ATTRIBUTE = re.compile(r"\s*([^\s<>/='\"]+)(?:\s*=\s*([^\s<>]*))?")
_BAD_ENTITY = re.compile(r"&(?!(?:amp|lt|gt|quot|apos|#[0-9]+|#x[0-9a-fA-F]+);)[^\s<>;\"'&]{0,30};?")


class ScanError(NamedTuple):
    """A syntax error: its place, a message, and the offset of a related place, or -1."""

    offset: int
    length: int
    text: str
    related: int = -1


@dataclass(slots=True)
class Element:
    """A start tag."""

    name: str  # as written, with its prefix
    offset: int  # of "<"
    end: int  # after ">"
    parent: int  # number of the parent element, or -1
    nth: int = 1  # position among the children of the parent with the same name, from 1
    root: int = -1  # number of the nearest <bml> around it, or its own; -1 if there is none
    # Name as written -> (offset, end) of its value without the quotes.
    attributes: dict[str, tuple[int, int]] = field(default_factory=dict)


def scan(text: str) -> tuple[list[Element], list[ScanError]]:
    """Return every start tag and every syntax error, in order."""
    result = _Scan(text)
    result.run()
    return result.elements, sorted(result.errors)


class _Scan:
    """One pass over a text, in linear time."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.elements: list[Element] = []
        self.errors: list[ScanError] = []
        self.open: list[int] = []
        self.names: dict[str, int] = {}  # number of open elements by name
        self.counts: dict[tuple[int, str], int] = {}
        self.never: set[str] = set()  # closers that do not occur any more

    def run(self) -> None:
        offset = 0
        while match := _OPENER.search(self.text, offset):
            self.entities(offset, match.start())
            offset = self.tag(match[0], match.start(), match.end())
        self.entities(offset, len(self.text))
        if self.open:
            first = self.elements[self.open[-1]]
            end = len(self.text.rstrip())
            words = f"<{first.name}> is never closed"
            self.errors.append(ScanError(max(0, end - 1), 1, words, first.offset))

    def tag(self, opener: str, start: int, end: int) -> int:
        """Read the construct at `start`; return the offset after it."""
        if opener in _CLOSER:
            closer = _CLOSER[opener]
            close = -1 if closer in self.never else self.text.find(closer, end)
            if close < 0:
                self.never.add(closer)
                self.errors.append(ScanError(start, len(opener), f"{opener} is never closed by {closer}"))
                return end
            return close + len(closer)
        name = _NAME.match(self.text, end)
        if opener == "</":
            return self.close(name[0] if name else "", start, name.end() if name else end)
        assert name is not None
        return self.start_tag(name[0], start, name.end())

    def start_tag(self, name: str, start: int, offset: int) -> int:
        parent, number = self.open[-1] if self.open else -1, len(self.elements)
        local = name.rpartition(":")[2]
        nth = self.counts[parent, local] = self.counts.get((parent, local), 0) + 1
        parent_root = self.elements[parent].root if self.open else -1
        element = Element(name, start, offset, parent, nth, number if local == DOCUMENT else parent_root)
        self.elements.append(element)
        while not (end := _TAG_END.match(self.text, offset)):
            match = _ATTRIBUTE.match(self.text, offset)
            if match is None:
                offset = self.report_errors(name, offset)
                break
            key, quoted = match[1], 2 if match[2] is not None else 3
            if key in element.attributes:
                words = f"{key} is given twice"
                self.errors.append(ScanError(match.start(1), len(key), words, element.attributes[key][0]))
            else:
                element.attributes[key] = match.span(quoted)
            self.entities(*match.span(quoted))
            offset = match.end()
        element.end = end.end() if end else offset
        if not end or self.text[end.end() - 2] != "/":
            self.open.append(number)
            self.names[name] = self.names.get(name, 0) + 1
        return element.end

    def report_errors(self, tag: str, offset: int) -> int:
        """Report the error in a start tag; return where to look for the next tag."""
        errors, text = self.errors, self.text
        match = _BROKEN_ATTRIBUTE.match(text, offset)
        if match is None:
            at = offset + len(text[offset : offset + 200]) - len(text[offset : offset + 200].lstrip())
            errors.append(ScanError(at, 1, f"wanted an attribute or the end of <{tag}>"))
            return offset
        name, value = match[1], match[2]
        if value is None:
            place, length, words = 1, len(name), f'wanted {name}="...", got no value'
        elif value[:1] in ('"', "'"):
            place, length, words = 2, len(value), f"the value of {name} is never closed by {value[0]}"
        else:
            place, length, words = 2, max(1, len(value)), f"wanted quotes around the value of {name}"
        errors.append(ScanError(match.start(place), length, words))
        return match.end()

    def close(self, name: str, start: int, end: int) -> int:
        inner = self.elements[self.open[-1]] if self.open else None
        if inner is None:
            self.errors.append(ScanError(start, end - start, f"</{name}> closes nothing"))
        elif inner.name != name:
            words = f"wanted </{inner.name}>, got </{name}>"
            self.errors.append(ScanError(start, end - start, words, inner.offset))
        while self.names.get(name):
            last = self.elements[self.open.pop()].name
            self.names[last] -= 1
            if last == name:
                break
        return end

    def entities(self, start: int, end: int) -> None:
        for match in _BAD_ENTITY.finditer(self.text, start, end):
            if match[0].endswith(";"):
                words = f"no entity {match[0]} in XML, write the character itself"
            else:
                words = "wanted &amp; for the character &"
            self.errors.append(ScanError(match.start(), len(match[0]), words))
