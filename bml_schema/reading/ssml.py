"""SSML inside <text>, and <speak> documents: what is said as plain text, and as the content of <speak>."""

import re
from collections.abc import Iterator
from copy import deepcopy
from typing import Any

from lxml import etree

from bml_schema.canonical import canonical
from bml_schema.node_schema import local
from bml_schema.nodes import DRAFTS, LANGUAGE, SSML, Block, Description, core
from bml_schema.values import is_name

SPACE = "http://www.w3.org/2001/10/synthesis"
# Names of syncs in BML, SSML, SAPI and Greta, with the attributes that have their ids.
MARKS = {"sync": "id", "mark": "name", "bookmark": "mark", "tm": "id"}
ANY_MARK = tuple(f"{{*}}{name}" for name in MARKS)
# Elements between which words are apart, and those whose text is not spoken.
APART = frozenset({"audio", "break", "p", "paragraph", "s", "sentence"})
HIDDEN = frozenset({"desc", "lexicon", "meta", "metadata"})
# The other elements that change how text is spoken.
ELEMENTS = APART | {"emphasis", "lang", "phoneme", "prosody", "say-as", "sub", "token", "voice", "w"}
_LOCAL = (core(""), *(f"{{{space}}}" for space in DRAFTS))


_NAME = re.compile(r"[^\W\d][\w.-]*")
_PROLOG = re.compile(
    r"(?:[\s\ufeff]|<\?[^<>]*\?>|<!--.*?-->|<!DOCTYPE[^<>\[]*>)*+(?=<(?:[\w.-]+:)?speak[\s/>])", re.DOTALL
)


def start_of_speak(document: str) -> int:
    """Return the index of the first element of a document if that is <speak>, else -1."""
    prolog = _PROLOG.match(document)
    return prolog.end() if prolog else -1


def is_marked_up(text: etree._Element) -> bool:
    """Return whether the content of <text> is more than words and <sync>."""
    return any(local(str(child.tag)) != "sync" for child in text)


def flat(text: etree._Element) -> Iterator[str | etree._Element | None]:
    """Yield the words of a <text>, its syncs of any name, and None where words are apart, in order."""
    yield text.text or ""
    for child in text:
        name = local(str(child.tag))
        if name in MARKS:
            yield child
        if name in APART:
            yield None
        if name not in HIDDEN:
            yield from flat(child)
        if name in APART:
            yield None
        yield child.tail or ""


def mark_of(element: etree._Element) -> str:
    """Return the id of a sync of any name, or ""."""
    return (element.get(MARKS[local(str(element.tag))]) or "").strip()


def described(text: etree._Element) -> Description:
    """Return the description that says the content of a <text> with its SSML."""
    speak = deepcopy(text)
    speak.tail = None
    seen: set[str] = set()
    for element in speak.iter():
        tag = local(str(element.tag))
        if tag in MARKS:
            mark = mark_of(element)
            is_new = is_name(mark) and mark not in seen
            seen.add(mark)
            element.attrib.clear()
            tag = "mark" if is_new else "w"  # which says nothing
            if is_new:
                element.set("name", mark)
        elif not _NAME.fullmatch(tag):  # such as ":x", which has no namespace
            tag = "w"
        if str(element.tag).startswith(_LOCAL) or not str(element.tag).startswith("{"):
            element.tag = f"{{{SPACE}}}{tag}"
    speak.tag = f"{{{SPACE}}}speak"
    for name in set(speak.attrib) - {LANGUAGE}:
        del speak.attrib[name]
    return Description(priority=0, type=SSML, content=canonical(speak))


def document_of(speak: etree._Element, block: str) -> etree._Element:
    """Return the <bml> that says a <speak> document, as the speech "speech", after others."""
    bml = etree.Element(Block.tag, id=block, composition="APPEND")
    speech = etree.SubElement(bml, core("speech"), id="speech")
    text: Any = etree.SubElement(speech, core("text"))
    text.text = speak.text
    text.extend(list(speak))
    if language := speak.get(LANGUAGE):
        text.set(LANGUAGE, language)
    for element in (bml, speech, text):
        element.sourceline = speak.sourceline
    return bml
