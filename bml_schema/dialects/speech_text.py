"""Translation of a <speech> in a dialect: text outside <text>, and other names for <sync>."""

from collections.abc import Callable
from typing import Any

from lxml import etree

from bml_schema.dialects.table import Row, table
from bml_schema.dialects.values import language_tag
from bml_schema.node_schema import local
from bml_schema.nodes import LANGUAGE
from bml_schema.reading.ssml import ELEMENTS

_MARKS = {"sync": "id", "tm": "id", "mark": "name"}


def translate_speech(speech: Any, apply: Callable[[Row], None], *, words: bool) -> None:
    """Move the content of a <speech> into a <text>, and translate <tm> and <mark> to <sync>.

    `apply` is called with each used row of the table. Plain text without marks is moved only with `words`; it
    is a fault of a document in no dialect.
    """
    elements = table().elements
    text = next((child for child in speech if local(str(child.tag)) == "text"), None)
    if text is not None:
        if _is_marked(text):
            apply(elements["text"])
            _rewrite(text, text, apply)
        return
    words = words and any(part and not part.isspace() for part in (speech.text, *(c.tail for c in speech)))
    inside = (e for child in speech if local(str(child.tag)) != "description" for e in child.iter())
    marked = any(local(str(element.tag)) in _MARKS for element in inside)
    if not (words or marked or speech.get("text", "").strip()):
        return
    apply(elements["speech"])
    text = etree.Element(str(speech.tag).replace("speech", "text"))
    text.sourceline = speech.sourceline
    kept = [child for child in speech if local(str(child.tag)) == "description"]
    _rewrite(text, speech, apply)
    if tag := language_tag(speech.get("language") or speech.get("lang") or ""):
        text.set(LANGUAGE, tag)
    del speech[:]
    speech.text = None
    for child in (text, *kept):
        child.tail = None
        speech.append(child)


def _rewrite(text: Any, source: Any, apply: Callable[[Row], None]) -> None:
    """Replace the content of a <text> by the words and marks of an element."""
    content = _Content(str(text.tag).replace("text", "sync"), apply)
    content.add_text(source.text)
    for child in source:
        if local(str(child.tag)) != "description":
            content.add(child)
        content.add_text(child.tail)
    if not "".join(content.element.itertext()).strip():
        content.add_text(source.get("text"))
    text[:] = content.element[:]
    text.text = content.element.text


def _is_marked(text: Any) -> bool:
    return any(local(str(child.tag)) == "tm" for child in text.iterdescendants())


class _Content:
    """The words, <sync> elements and SSML of a text, in order, inside an element."""

    def __init__(self, tag: str, apply: Callable[[Row], None]) -> None:
        self.tag = tag
        self.apply = apply
        self.element: Any = etree.Element("text")
        self.last: Any = None  # the last child of the element
        self.ids: set[str] = set()

    def add_text(self, text: str | None) -> None:
        if self.last is None:
            self.element.text = (self.element.text or "") + (text or "")
        else:
            self.last.tail = (self.last.tail or "") + (text or "")

    def add(self, element: Any) -> None:
        """Add an element: a mark as a sync, SSML as it is, any other as the words inside it."""
        name = local(str(element.tag))
        row = table().elements.get(name)
        if row is not None:
            self.apply(row)
        if name in _MARKS:
            id = element.get(_MARKS[name], "").strip().rpartition(":")[2]
            if id and id not in self.ids:
                self.ids.add(id)
                sync = etree.Element(self.tag, {k: v for k, v in element.items() if k == "ref"})
                sync.set("id", id)
                sync.sourceline = element.sourceline
                self.element.append(sync)
                self.last = sync
        elif name in ELEMENTS:
            inside = _Content(self.tag, self.apply)
            inside.element, inside.ids = etree.Element(element.tag, element.attrib), self.ids
            inside.add_text(element.text)
            for child in element:
                inside.add(child)
                inside.add_text(child.tail)
            self.element.append(inside.element)
            self.last = inside.element
        elif row is None or row.becomes != "-":
            self.add_text(element.text)
            for child in element:
                self.add(child)
                self.add_text(child.tail)
