"""A splitter that finds the documents and the broken stretches in a text."""

import re
from collections.abc import Iterator
from itertools import count
from typing import NamedTuple

from bml_schema.errors import BMLError, quoted

_MAX_MARKS = 100_000  # so that a hostile text of 16 MiB costs no more than an ordinary one of 1 MiB

# The marks where documents begin and end, and the constructs that can hide such marks.
_MARKS = re.compile(r"<!--|<!\[CDATA\[|<!DOCTYPE|<\?|<(?:[\w.-]+:)?bml(?=[\s/>])|</(?:[\w.-]+:)?bml\s*>")
NEXT = re.compile(r"<(?:[\w.-]+:)?bml(?=[\s/>])")
_REST_OF_TAG = re.compile(r"""(?:[^<>"']|"[^<"]*"|'[^<']*')*+>""")
_REST_OF_DOCTYPE = re.compile(r"""(?:[^<>"'\[]|"[^<"]*"|'[^<']*')*+[>\[]""")
_CLOSERS = {
    "<!--": re.compile("-->"),
    "<![CDATA[": re.compile(r"\]\]>"),
    "<?": re.compile(r"\?>"),
    "<!DOCTYPE": re.compile(r"\]\s*>"),
}
_BLANKS = " \t\r\n\ufeff"
# Elements around documents: SmartBody's, and Greta's, in which <fml> says what the documents are for.
WRAPPERS = ("act", "fml-apml")
WRAPPER_TAG = re.compile(rf"<({'|'.join(WRAPPERS)})(?=[\s/>])")
# Allowed between documents.
_BETWEEN = re.compile(
    rf"(?:[{_BLANKS}]|</?(?:{'|'.join(WRAPPERS)}|participant)(?=[\s/>])[^<>]*>|"
    r"<fml(?=[\s/>])[^<>]*+>(?:(?<=/>)|(?:[^<]|<(?!/fml))*+</fml\s*>))*+"
)
_EMPTY_DOCTYPE = re.compile(
    r"""<!DOCTYPE\s+fml-apml(?:\s+SYSTEM\s+(?:"[^"<]*"|'[^'<]*'))?\s*(?:\[\s*\])?\s*>"""
)


class DocumentSpan(NamedTuple):
    """A part of a text: `tag` is the start tag of the document, or `fault` tells why it is not a document."""

    start: int
    end: int
    tag: str = ""
    fault: str = ""


class _Mark(NamedTuple):
    """text[start:end]: an "open", "close" or "whole" tag of <bml>, a "doctype", or to "skip" (a comment)."""

    kind: str
    start: int
    end: int


def _marks(text: str, first: int, last: int) -> Iterator[_Mark]:
    """Yield the marks that decide where documents begin and end, in linear time for any text."""
    missing_closers: set[str] = set()  # searched for once, not for each opener
    offset = first
    for n in count():
        match = _MARKS.search(text, offset, last)
        if match is None:
            return
        if n == _MAX_MARKS:
            raise BMLError(f"wanted at most {n} tags of <bml>, comments and the like in one text")
        start, offset = match.span()
        opener = match[0]
        if opener.startswith("</"):
            yield _Mark("close", start, offset)
            continue
        if opener not in _CLOSERS:
            rest = _REST_OF_TAG.match(text, offset, last)
            offset = rest.end() if rest else offset
            yield _Mark("whole" if rest and text[offset - 2] == "/" else "open", start, offset)
            continue
        doctype = opener == "<!DOCTYPE"
        if doctype:
            rest = _REST_OF_DOCTYPE.match(text, offset, last)
            offset = rest.end() if rest else offset
            if rest is None or text[offset - 1] == ">":
                yield _Mark("doctype", start, offset)
                continue
        closer = None if opener in missing_closers else _CLOSERS[opener].search(text, offset, last)
        if closer is None:
            missing_closers.add(opener)
        else:
            offset = closer.end()
        if doctype:
            yield _Mark("doctype", start, offset)
        elif closer is not None and opener != "<![CDATA[":
            yield _Mark("skip", start, offset)


def without_doctype(text: str) -> str:
    """Return the text with blanks for Greta's <!DOCTYPE fml-apml>, which declares no entities."""
    return _EMPTY_DOCTYPE.sub(lambda found: re.sub(r"\S", " ", found[0]), text)


def document_spans(text: str, first: int = 0, last: int | None = None) -> Iterator[DocumentSpan]:
    """Yield the documents in text[first:last] and the broken stretches between them, in order."""
    last = len(text) if last is None else last
    marks = list(_marks(text, first, last))
    ends: dict[int, int] = {}
    opened: list[int] = []
    for n, mark in enumerate(marks):
        if mark.kind == "open":
            opened.append(n)
        elif mark.kind == "whole":
            ends[n] = mark.end
        elif mark.kind == "close" and opened:
            ends[opened.pop()] = mark.end
    roots = [n for n, mark in enumerate(marks) if mark.kind in ("open", "whole")]
    # A document without an end tag ends where the next one begins.
    next_starts = dict(zip(roots, [marks[n].start for n in roots[1:]], strict=False))
    offset = first
    junk = doctype = -1  # start of a broken stretch that was not reported yet, or -1
    for n, mark in enumerate([*marks, _Mark("end", last, last)]):
        if mark.start < offset:
            continue  # inside a document
        if junk < 0:
            between = _BETWEEN.match(text, offset, mark.start)
            junk = between.end() if between and between.end() < mark.start else -1
        if junk < 0 and mark.kind == "close":
            junk = mark.start
        if doctype < 0 and mark.kind == "doctype":
            doctype = mark.start if junk < 0 else junk
        offset = mark.end
        if mark.kind not in ("open", "whole", "end"):
            continue
        end = ends.get(n) or next_starts.get(n, last)
        if mark.kind == "end":
            begin = doctype if doctype >= 0 else junk
            if begin >= 0:  # nothing but the broken stretch, such as a page of HTML
                yield DocumentSpan(begin, offset, fault=_not_bml(text[begin:offset]))
        elif doctype >= 0:
            yield DocumentSpan(doctype, end, text[mark.start : mark.end], _NO_DTD)
        else:
            if junk >= 0:
                yield DocumentSpan(junk, mark.start, fault=_not_bml(text[junk : mark.start]))
            yield DocumentSpan(mark.start, end, text[mark.start : mark.end])
        offset = end
        junk = doctype = -1


_NO_DTD = "wanted a document without DTD and entities, got <!DOCTYPE"


def _not_bml(text: str) -> str:
    return f"wanted <bml>, got {quoted(text.strip(_BLANKS))}"
