"""Framing of BML documents in a byte stream."""

import re
from dataclasses import dataclass

from realizer.core.settings import limit_hint


@dataclass(frozen=True, slots=True)
class Fault:
    """A span of the stream that is no document."""

    text: str
    block: str | None = None


# The marks at which documents begin and end, and constructs that may hide such marks. The lookahead needs the
# byte after a name, so that an incomplete mark is not taken for another one.
_NAME = rb"(?:[\w.\x80-\xff-]{1,64}:)?bml(?=[\s/>])"
# Tags around documents of dialects, and Greta's <fml>, which says what the documents are for.
_WRAPPER = re.compile(rb"</?(act|fml-apml|participant|fml)(?=[\s/>])")
_MARK = re.compile(rb"<!--|<!\[CDATA\[|<!DOCTYPE|<\?|<" + _NAME + rb"|</" + _NAME + rb"|" + _WRAPPER.pattern)
# An end of the data that more data may turn into a mark; no mark is longer.
_COMING = re.compile(rb"<[^\s<>]{0,79}\Z")
# Constructs -> their ends, and how many bytes of an end may have arrived. "[" is the subset in a DOCTYPE.
_ENDS = {
    b"<!--": (re.compile(rb"-->"), 2),
    b"<![CDATA[": (re.compile(rb"\]\]>"), 2),
    b"<?": (re.compile(rb"\?>"), 1),
    b"<!DOCTYPE": (re.compile(rb"[<>\[]"), 0),
    b"[": (re.compile(rb"\]\s{0,16}>"), 17),
    b"<fml": (re.compile(rb"</fml\s{0,16}>"), 22),
}
_IN_TAG = re.compile(rb"[<>\"']")
_IN_VALUE = {b'"': re.compile(rb'[<"]'), b"'": re.compile(rb"[<']")}
_EDGE = re.compile(rb"[<>]")
_ID = re.compile(rb"""\sid\s*=\s*(?:"([^"<]{1,256})"|'([^'<]{1,256})')""")
_BLANKS = b" \t\r\n\xef\xbb\xbf"  # and the bytes of a BOM
_SOLID = re.compile(rb"[^" + _BLANKS + rb"]")
_SHOWN = 60  # bytes of a stray span that its message quotes
_MAX_WRAPPER = 4096  # bytes of the tags around documents


class DocumentFramer:
    """A splitter of one byte stream into documents.

    Blanks, comments, declarations, processing instructions, DOCTYPEs, and the elements that dialects have
    around documents, are skipped between documents. A span with anything else, a document that has not ended
    before the next one begins, and one that is too large give one Fault each; reading resumes at the next
    `<bml`. The result does not depend on how the stream is cut into reads, and each byte is examined a few
    times at most.

    Args:
        limit: most bytes of a document (the setting max_document), and of a comment between documents.
        wraps: whether a document is returned in the <act> or <fml-apml> around it.
    """

    def __init__(self, limit: int, *, wraps: bool = False) -> None:
        self._limit = limit
        self._wraps = wraps
        self._wrapper = b""  # the tags around the documents
        self._is_wrapper = False  # whether the open document is such a tag
        self._data = bytearray()
        self._parsed = 0  # the data before it is parsed
        self._document = -1  # where the open document begins; -1 outside
        self._hidden = b""  # the open construct that hides marks: its mark, or a quote within a tag
        self._opened = 0  # where it began
        self._closing = False  # whether the open tag is an end tag
        self._broken = False  # whether a fault was reported after the last good document
        self._stray = bytearray()
        self._orphans = 0  # end tags to come of documents that were given up
        self._items: list[str | Fault] = []

    def feed(self, data: bytes) -> list[str | Fault]:
        """Return what `data` completes, in order: documents, each from `<bml` to its end, and Faults."""
        self._data += data
        while self._step():
            pass
        self._give_up()
        consumed = self._document if self._document >= 0 else self._parsed
        del self._data[:consumed]
        self._parsed -= consumed
        self._opened -= consumed
        if self._document >= 0:
            self._document = 0
        items, self._items = self._items, []
        return items

    def _step(self) -> bool:
        """Parse up to the next mark, or the end of the open construct. Return False if data is missing."""
        if not self._hidden:
            return self._to_mark()
        return self._past() if self._hidden in _ENDS else self._in_tag()

    def _to_mark(self) -> bool:
        match = _MARK.search(self._data, self._parsed)
        if match is None:
            coming = _COMING.search(self._data, max(self._parsed, len(self._data) - 80))
            self._text(coming.start() if coming else len(self._data))
            return False
        start, end = match.span()
        self._text(start)
        self._give_up()
        self._report_stray()
        self._parsed, self._opened = end, start
        mark = match[0]
        if match[1]:
            if self._document < 0:
                self._hidden, self._is_wrapper, self._document = b"<", True, start
            return True
        if mark in _ENDS:
            if self._document < 0 and mark == b"<![CDATA[":
                self._fault("got <![CDATA[ outside a document")
            self._hidden = mark
            return True
        self._hidden = b"<"
        self._closing = mark.startswith(b"</")
        if not self._closing:
            if self._document >= 0:
                self._fault("wanted </bml> before the next <bml", self._id(start))
                self._orphans += 1
            self._document = start
        return True

    def _in_tag(self) -> bool:
        """Parse to the end of a <bml> tag. A `>` in a value does not end it, a `<` means it is not closed."""
        inside = _IN_VALUE.get(self._hidden, _IN_TAG)
        match = inside.search(self._data, self._parsed)
        if match is None:
            self._parsed = len(self._data)
            return False
        mark, self._parsed = match[0], match.end()
        if mark in _IN_VALUE:
            self._hidden = b"<" if self._hidden == mark else mark
            return True
        self._hidden = b""
        if mark == b"<":
            self._parsed = match.start()
        if self._is_wrapper:
            self._give_up()
            if self._is_wrapper:
                self._wrap()
        elif self._closing or (mark == b">" and self._data[match.start() - 1 : match.start()] == b"/"):
            self._end()
        return True

    def _wrap(self) -> None:
        """Store a tag around documents; the end of the outermost element ends them."""
        tag = bytes(self._data[self._document : self._parsed])
        self._document, self._is_wrapper = -1, False
        found = _WRAPPER.match(tag)
        assert found is not None
        name, ends = found[1], tag.startswith(b"</")
        if not tag.endswith(b">") or len(self._wrapper) + len(tag) > _MAX_WRAPPER:
            self._fault(f"wanted the end of a tag, got {tag[:_SHOWN].decode('utf-8', 'replace')!r}")
        elif name == b"fml":
            self._hidden = b"" if ends or tag.endswith(b"/>") else b"<fml"
            self._opened = self._parsed - len(b"<fml")
        elif name == b"participant":
            self._wrapper += tag if self._wrapper else b""
        else:
            self._wrapper = b"" if ends or tag.endswith(b"/>") else tag

    def _around(self, document: str) -> str:
        found = _WRAPPER.match(self._wrapper) if self._wraps else None
        if found is None:
            return document
        return f"{self._wrapper.decode('utf-8', 'replace')}{document}</{found[1].decode()}>"

    def _past(self) -> bool:
        """Parse to the end of a comment or the like. Give up one longer than a document may be."""
        closer, kept = _ENDS[self._hidden]
        opener = b"<!DOCTYPE" if self._hidden == b"[" else self._hidden
        last = self._opened + len(opener) + self._limit
        match = closer.search(self._data, self._parsed, last)
        if match is not None:
            self._parsed, self._hidden = match.end(), b"[" if match[0] == b"[" else b""
            if match[0] == b"<":
                self._parsed = match.start()
                if self._document < 0:
                    self._fault("wanted an end of <!DOCTYPE, got <")
            return True
        if len(self._data) < last:
            self._parsed = max(self._parsed, len(self._data) - kept)
            return False
        if self._document < 0:
            self._fault(f"wanted an end of {opener.decode()} within {self._limit} bytes")
        self._parsed, self._hidden = last, b""
        return True

    def _end(self) -> None:
        self._give_up()
        if self._document < 0:
            if self._orphans:
                self._orphans -= 1
            else:
                self._fault("got </bml> without <bml")
            return
        raw = bytes(self._data[self._document : self._parsed])
        try:
            self._items.append(self._around(raw.decode()))
            self._broken = False
        except UnicodeDecodeError as wrong:
            self._broken = False
            self._fault(f"wanted UTF-8, got the byte 0x{raw[wrong.start]:02X}", self._id(self._parsed))
        self._document = -1

    def _give_up(self) -> None:
        if self._document >= 0 and self._parsed - self._document > self._limit:
            self._broken = False
            words = f"wanted at most {self._limit} bytes in a document, got more"
            words = f"{words} {limit_hint('max_document')}"
            self._fault(words, self._id(self._document + self._limit))
            self._orphans += not self._is_wrapper
            self._document, self._is_wrapper = -1, False

    def _text(self, end: int) -> None:
        """Skip text without marks up to `end`; outside a document it should be blank."""
        if self._document < 0 and not self._broken:
            start = self._parsed
            if not self._stray:
                solid = _SOLID.search(self._data, start, end)
                start = solid.start() if solid else end
            line = self._data.find(b"\n", start, end)
            room = start + _SHOWN - len(self._stray)
            self._stray += self._data[start : min(room, end if line < 0 else line)]
            if self._stray and (line >= 0 or end >= room):
                self._report_stray()
        self._parsed = end

    def _report_stray(self) -> None:
        if self._stray:
            shown = bytes(self._stray).strip(_BLANKS).decode("utf-8", "replace")
            self._fault(f"wanted <bml>, got {shown!r}")

    def _fault(self, text: str, block: str | None = None) -> None:
        """Report a fault: of a block, or once for each span between good documents."""
        self._stray.clear()
        if not self._broken or block is not None:
            self._items.append(Fault(text, block))
        self._broken = True

    def _id(self, end: int) -> str | None:
        """Return the id in the start tag of the open document, if it can be read before `end`."""
        start = self._document
        end = min(end, start + 4096)
        tag = _EDGE.search(self._data, start + 1, end)
        match = _ID.search(self._data, start, tag.start() if tag else end)
        return (match[1] or match[2]).decode("utf-8", "replace") if match else None
