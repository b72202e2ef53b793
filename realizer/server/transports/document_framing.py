"""Framing of BML documents in a byte stream."""

from __future__ import annotations

import re
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Fault:
    """A stretch of the stream that gave no document: why, and the block's id where it can be read.

    Attributes:
        large: it was longer than a document may be.
    """

    text: str
    block: str | None = None
    large: bool = False


# What decides where documents begin and end, and what may hide such marks. The lookahead wants the byte
# after a name, so that no mark is taken for another one while it is still coming in.
_NAME = rb"(?:[\w.\x80-\xff-]{1,64}:)?bml(?=[\s/>])"
_MARK = re.compile(rb"<!--|<!\[CDATA\[|<!DOCTYPE|<\?|<" + _NAME + rb"|</" + _NAME)
# What the end of the data may turn into a mark when more comes; no mark is longer.
_COMING = re.compile(rb"<[^\s<>]{0,79}\Z")
_CLOSERS = {b"<!--": b"-->", b"<![CDATA[": b"]]>", b"<?": b"?>"}
_IN_TAG = re.compile(rb"[<>\"']")
_IN_VALUE = {b'"': re.compile(rb'[<"]'), b"'": re.compile(rb"[<']")}
_IN_DOCTYPE = re.compile(rb"[<>\[]")
_END_OF_SUBSET = re.compile(rb"\]\s{0,16}>")
_EDGE = re.compile(rb"[<>]")
_ID = re.compile(rb"""\sid\s*=\s*(?:"([^"<]{1,256})"|'([^'<]{1,256})')""")
_BLANKS = b" \t\r\n\xef\xbb\xbf"  # and the bytes of a BOM
_SOLID = re.compile(rb"[^" + _BLANKS + rb"]")
_SHOWN = 60  # bytes of a stray stretch that its message shows


class DocumentFramer:
    """Finds the documents of one stream.

    Between documents blanks, comments, declarations, processing instructions and DOCTYPEs are passed over.
    Of a stretch that holds anything else, of a document whose end never came before the next one began and
    of one that is too large, one Fault tells; reading goes on at the next `<bml`. How the stream was cut into
    reads changes nothing, and no byte is looked at more than a few times.

    Args:
        limit: most bytes of a document, and of a comment between documents.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._data = bytearray()
        self._here = 0  # up to here all is understood
        self._document = -1  # where the open document begins; -1 outside
        self._hidden = b""  # what began and hides marks: the mark itself, a quote within a tag
        self._opened = 0  # where it began
        self._closing = False  # the tag that is being read is an end tag
        self._broken = False  # what gave no document has been told of, up to the next good one
        self._stray = bytearray()
        self._orphans = 0  # end tags that will come of documents that were given up
        self._found: list[str | Fault] = []

    def feed(self, data: bytes) -> list[str | Fault]:
        """What `data` completes, in order: texts of documents, each from `<bml` to its end, and Faults."""
        self._data += data
        while self._step():
            pass
        self._give_up()
        kept = self._document if self._document >= 0 else self._here
        del self._data[:kept]
        self._here -= kept
        self._opened -= kept
        if self._document >= 0:
            self._document = 0
        found, self._found = self._found, []
        return found

    def _step(self) -> bool:
        """Understand the next mark, or what closes the last one; False where more data is needed."""
        if not self._hidden:
            return self._to_mark()
        if self._hidden in _CLOSERS:
            return self._past(_CLOSERS[self._hidden])
        if self._hidden == b"<!DOCTYPE":
            return self._in_doctype()
        if self._hidden == b"[":
            return self._in_subset()
        return self._in_tag()

    def _to_mark(self) -> bool:
        found = _MARK.search(self._data, self._here)
        if found is None:
            coming = _COMING.search(self._data, max(self._here, len(self._data) - 80))
            self._text(coming.start() if coming else len(self._data))
            return False
        start, end = found.span()
        self._text(start)
        self._give_up()
        self._report_stray()
        self._here, self._opened = end, start
        mark = found[0]
        if mark in _CLOSERS or mark == b"<!DOCTYPE":
            if self._document < 0 and mark == b"<![CDATA[":
                self._fault("got <![CDATA[ outside a document")
            self._hidden = mark
            return True
        self._hidden = b"<"
        self._closing = mark.startswith(b"</")
        if not self._closing:
            if self._document >= 0:
                if not self._broken:
                    self._fault("wanted </bml> before the next <bml", self._id(start))
                self._orphans += 1
            self._document = start
        return True

    def _in_tag(self) -> bool:
        """To the end of a tag of <bml>; `>` in a value is none, `<` means that the tag was never closed."""
        inside = _IN_VALUE.get(self._hidden, _IN_TAG)
        found = inside.search(self._data, self._here)
        if found is None:
            self._here = len(self._data)
            return False
        mark, self._here = found[0], found.end()
        if mark in _IN_VALUE:
            self._hidden = b"<" if self._hidden == mark else mark
            return True
        self._hidden = b""
        if mark == b"<":
            self._here = found.start()
        if self._closing or (mark == b">" and self._data[found.start() - 1 : found.start()] == b"/"):
            self._end()
        return True

    def _past(self, closer: bytes) -> bool:
        """To the end of a comment and the like; one that is longer than a document may be is given up."""
        last = self._opened + len(self._hidden) + self._limit
        at = self._data.find(closer, self._here, last)
        if at >= 0:
            self._here, self._hidden = at + len(closer), b""
            return True
        return self._not_yet(last, len(closer) - 1)

    def _not_yet(self, last: int, kept: int) -> bool:
        """What closes a construct is not there: wait for more, or give the construct up at `last`."""
        if len(self._data) < last:
            # A closer may have come in half.
            self._here = max(self._here, len(self._data) - kept)
            return False
        if self._document < 0:
            opener = "<!DOCTYPE" if self._hidden == b"[" else self._hidden.decode()
            self._fault(f"wanted an end of {opener} within {self._limit} bytes")
        self._here, self._hidden = last, b""
        return True

    def _in_doctype(self) -> bool:
        last = self._opened + len(self._hidden) + self._limit
        found = _IN_DOCTYPE.search(self._data, self._here, last)
        if found is None:
            return self._not_yet(last, 0)
        self._here = found.end()
        self._hidden = b"[" if found[0] == b"[" else b""
        if found[0] == b"<":
            self._here = found.start()
            if self._document < 0:
                self._fault("wanted an end of <!DOCTYPE, got <")
        return True

    def _in_subset(self) -> bool:
        last = self._opened + len(b"<!DOCTYPE") + self._limit
        found = _END_OF_SUBSET.search(self._data, self._here, last)
        if found is None:
            return self._not_yet(last, 17)
        self._here, self._hidden = found.end(), b""
        return True

    def _end(self) -> None:
        """A tag that may end a document is read, up to here."""
        self._give_up()
        if self._document < 0:
            if self._orphans:
                self._orphans -= 1
            else:
                self._fault("got </bml> without <bml")
            return
        raw = bytes(self._data[self._document : self._here])
        try:
            self._found.append(raw.decode())
            self._broken = False
        except UnicodeDecodeError as wrong:
            self._broken = False
            self._fault(f"wanted UTF-8, got the byte 0x{raw[wrong.start]:02X}", self._id(self._here))
        self._document = -1

    def _give_up(self) -> None:
        """Drop an open document that has grown too large."""
        if self._document >= 0 and self._here - self._document > self._limit:
            self._broken = False
            words = f"wanted at most {self._limit} bytes in a document, got more"
            self._fault(words, self._id(self._document + self._limit), large=True)
            self._orphans += 1
            self._document = -1

    def _text(self, end: int) -> None:
        """What stands before `end` hides nothing; outside a document it should be blank."""
        if self._document < 0 and not self._broken:
            start = self._here
            if not self._stray:
                solid = _SOLID.search(self._data, start, end)
                start = solid.start() if solid else end
            line = self._data.find(b"\n", start, end)
            room = start + _SHOWN - len(self._stray)
            self._stray += self._data[start : min(room, end if line < 0 else line)]
            if self._stray and (line >= 0 or end >= room):
                self._report_stray()
        self._here = end

    def _report_stray(self) -> None:
        if self._stray:
            shown = bytes(self._stray).strip(_BLANKS).decode("utf-8", "replace")
            self._fault(f"wanted <bml>, got {shown!r}")

    def _fault(self, text: str, block: str | None = None, *, large: bool = False) -> None:
        """One message for a stretch, however much is wrong with it."""
        self._stray.clear()
        if not self._broken:
            self._found.append(Fault(text, block, large))
        self._broken = True

    def _id(self, end: int) -> str | None:
        """The id in the start tag of the open document, where it can be read before `end`."""
        start = self._document
        end = min(end, start + 4096)
        tag = _EDGE.search(self._data, start + 1, end)
        found = _ID.search(self._data, start, tag.start() if tag else end)
        return (found[1] or found[2]).decode("utf-8", "replace") if found else None
