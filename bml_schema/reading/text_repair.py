"""A repair of what is spoken in a document that is not well-formed: its words are kept."""

import html
import re

from lxml import etree

from bml_schema.canonical import xml_parser
from bml_schema.escape import escape, escape_value, sanitized
from bml_schema.reading.ssml import MARKS

_STARTS = re.compile(r"<((?:[\w.-]+:)?(?:text|speak))(?=[\s>])[^<>]*(?<!/)>")
_TAG = re.compile(r"<(/?)(?:[\w.-]+:)?([A-Za-z_][\w.-]*)([^<>]*)>")
_ATTRIBUTE = re.compile(
    r"""(?<![\w:.-])((?:xml:)?[A-Za-z_][\w.-]*)\s*=\s*(?:"([^"]*)"|'([^']*)'|([^\s"'/=]+))"""
)
_ATTRIBUTES = r"""(?:\s+[\w:.-]+\s*=\s*(?:"[^"<>]*"|'[^'<>]*'|[^\s<>]+))*+\s*/?"""
_LIKE_ATTRIBUTES = re.compile(_ATTRIBUTES)
_ENTITY = re.compile(r"&(?:#\d+|#[xX][\da-fA-F]+|\w+);")
# What `bare_signs` repairs alone.
_BARE = re.compile(rf"&(?!(?:amp|lt|gt|quot|apos);)|<(?!/?[A-Za-z_][\w:.-]*{_ATTRIBUTES}>|[!?])")
_SHOWN = 80  # characters of a text that a warning shows
# Elements without content, which HTML and people do not close.
_EMPTY = frozenset({*MARKS, "br", "break"})


def repaired(document: str) -> tuple[str, str]:
    """Return a document with well-formed content of each <text> and <speak>, and a note about it, or "".

    Tags that do not match are closed or left out, attributes without quotes get them; bare `&` and `<` and
    entities of HTML beside them are the characters. Text with comments or CDATA sections stays as it is.
    """
    out: list[str] = []
    notes: list[str] = []
    at = 0
    for start in _STARTS.finditer(document):
        if start.start() < at:  # <speak> in <text>
            continue
        end = document.find(f"</{start[1]}", start.end())
        if end < 0:
            break
        content = document[start.end() : end]
        if not _is_well_formed(_BARE.sub("", content)) and "<!" not in content:
            read = _balanced(content)
            out += (document[at : start.end()], read)
            notes.append(f"<{start[1]}> is not well-formed: read as {_shortened(read)!r}")
            at = end
    return "".join([*out, document[at:]]), "; ".join(dict.fromkeys(notes))


def _is_well_formed(content: str) -> bool:
    if "<" not in content and "&" not in content:
        return True
    try:
        etree.fromstring(f"<x>{content}</x>".encode(), xml_parser())
    except (etree.XMLSyntaxError, UnicodeEncodeError):
        return False
    return True


def _balanced(content: str) -> str:
    """Return the words of a content and its tags, without prefixes, so that each that opens closes too."""
    out: list[str] = []
    opened: list[str] = []
    at = 0
    for tag in _TAG.finditer(content):
        out.append(_words(content[at : tag.start()]))
        at, name = tag.end(), tag[2]
        if not _LIKE_ATTRIBUTES.fullmatch(tag[3]):  # "<b and c>"
            out.append(_words(tag[0]))
        elif not tag[1]:
            is_empty = name in _EMPTY or tag[3].endswith("/")
            out.append(f"<{name}{_attributes(tag[3])}{'/' if is_empty else ''}>")
            opened += [] if is_empty else [name]
        elif name in opened:
            while (last := opened.pop()) != name:
                out.append(f"</{last}>")
            out.append(f"</{name}>")
    out.append(_words(content[at:]))
    return "".join([*out, *(f"</{name}>" for name in reversed(opened))])


def _words(text: str) -> str:
    return escape(_characters(text))


def _characters(text: str) -> str:
    """Return a text with the characters of entities, and U+FFFD for those that XML cannot hold."""
    return sanitized(_ENTITY.sub(lambda entity: html.unescape(entity[0]), text))


def _attributes(text: str) -> str:
    values = {name: _characters(a or b or c) for name, a, b, c in _ATTRIBUTE.findall(text.rstrip("/"))}
    return "".join(f' {name}="{escape_value(value)}"' for name, value in values.items())


def _shortened(text: str) -> str:
    return text if len(text) <= _SHOWN else text[:_SHOWN] + "..."
