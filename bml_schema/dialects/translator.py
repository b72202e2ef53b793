"""Translates an element tree from a dialect to BML 1.0, in place, before it is parsed."""

from collections.abc import Callable, Iterable, Iterator
from copy import deepcopy
from itertools import count, repeat
from typing import Any

from lxml import etree

from bml_schema.canonical import MAX_ATTRIBUTES
from bml_schema.dialects.intentions import show_intentions
from bml_schema.dialects.recorded_lines import read_recorded_lines
from bml_schema.dialects.speech_text import translate_speech
from bml_schema.dialects.sync_points import POINTS, SyncPoints
from bml_schema.dialects.table import Report, Row, table
from bml_schema.dialects.values import FUNCTIONS
from bml_schema.node_schema import local
from bml_schema.nodes import BMLA, BMLT, CORE, DRAFTS, NAMESPACES, OWN
from bml_schema.reading.undeclared_prefixes import SMARTBODY, remove_element

_OURS = frozenset({BMLA, BMLT, OWN})
_JOINTS = frozenset({"eyes", "head", "neck", "chest", "back"})  # SmartBody's children of <gaze>


def translate(root: etree._Element, wrapper: str, block_ids: Iterator[str], fml: Any = None) -> Report:
    """Translate a document to BML 1.0 in place, and return what was translated; BML 1.0 does not change.

    Args:
        wrapper: local name of the element around <bml>, or "".
        block_ids: ids for blocks of a dialect without an id.
        fml: Greta's <fml> beside <bml>, or None.
    """
    space = str(root.tag).rpartition("}")[0][1:]
    if space not in ("", CORE, *DRAFTS):
        return Report()
    translation = _Translation(root)
    read_recorded_lines(root, translation.apply)
    translation.run()
    if not (translation.applied or wrapper or space in DRAFTS):
        return Report()
    translation.in_dialect = True
    if wrapper == "fml-apml":
        translation.add_composition()
    translation.run()
    made = translation.add_ids()
    if fml is not None:
        show_intentions(root, fml, translation.used, translation.apply)
    if wrapper == "act":
        translation.add_character()
    if not root.get("id", "").strip():
        root.set("id", next(block_ids))
        made = [f'the block as "{root.get("id")}"', *made]
    return Report(translation.applied, made, wrapper)


def translate_elements(root: etree._Element) -> dict[Any, str]:
    """Translate, in place, what elements of a BML 1.0 document have from dialects.

    Rows for any dialect do not apply, and no behaviour is removed: what is not known stays unknown.

    Returns:
        Element, or the root for its attributes -> how it was read.
    """
    translation = _Translation(root)
    translation.translate_attributes()
    applied: dict[Any, dict[Row, None]] = {root: translation.applied}
    for element in list(translation.timed()):
        translation.applied = applied[element] = {}
        translation.translate_element(element)
    points = translation.points()
    for element in list(translation.timed()):
        translation.applied = applied[element]
        translation.translate_points(element, points)
    return {element: Report(rows).text for element, rows in applied.items() if rows}


def dialect_of(root: etree._Element, wrapper: str) -> str:
    """Return the name of the dialect of a document, "" for BML 1.0; for the arguments see `translate`."""
    report = translate(deepcopy(root), wrapper, repeat("b"))
    return report.dialect if report else ""


class _Translation:
    """The translation of one document.

    Attributes:
        applied: the rows of the table that it has used, in order.
        in_dialect: whether the document is in a dialect, so that rows for any dialect apply too.
    """

    def __init__(self, root: etree._Element) -> None:
        self.root: Any = root
        self.table = table()
        self.applied: dict[Row, None] = {}
        self.in_dialect = False
        self.used = {e.get("id", "").strip() for e in self.timed()}
        self.numbers: dict[str, Iterator[int]] = {}

    def run(self) -> None:
        self.translate_attributes()
        self._children(self.root)
        points = self.points()
        for element in self.timed():
            points.translate(element)
        self._references(self.root, points)

    def translate_attributes(self) -> None:
        self._attributes(self.root, "bml")

    def translate_element(self, element: Any) -> None:
        """Translate one behaviour or constraint, which stays in any case."""
        self._element(element, stays=True)

    def translate_points(self, element: Any, points: SyncPoints) -> None:
        """Translate the sync points of one behaviour or constraint, and those that it refers to."""
        points.translate(element)
        self._references(element, points)

    def points(self) -> SyncPoints:
        kinds = {e.get("id", "").strip(): self._kind(e) for e in self.timed()}
        return SyncPoints(kinds, self.apply, self.in_dialect)

    def _references(self, inside: Any, points: SyncPoints) -> None:
        for sync in inside.iter("{*}sync", "{*}before", "{*}after", "{*}synchronize", "{*}synchronise"):
            if "ref" in sync.attrib:
                sync.set("ref", points.reference(sync.get("ref")))

    def _children(self, parent: Any) -> None:
        for element in list(parent):
            self._element(element)

    def _element(self, element: Any, *, stays: bool = False) -> None:
        """Translate an element and what is inside; one that `stays` is not removed."""
        name, key = self._name(element)
        if key is None:
            return
        if name == "description":
            self._attributes(element, name)
            return
        parent = element.getparent()
        if name in _JOINTS and local(str(parent.tag)) == "gaze":
            key = name = "sbm:joint"
        if name == "speech":
            translate_speech(element, self.apply, words=self.in_dialect)
        translate_reference(element, name, self.apply)
        own, tag = self.table.elements.get(key) or self.table.elements.get(name), element.tag
        if stays and own is not None and own.becomes == "-":
            return
        if not self._attributes(element, name, key, stays):
            return
        stayed = element.tag == tag  # what an attribute says of the element comes first
        if own is not None and own.becomes and stayed and not self._translate_element(element, own):
            return
        renamed, _ = self._name(element)
        if renamed != name and not self._attributes(element, renamed, stays=stays):
            return
        name = renamed
        if name == "text":  # its content is words, syncs and SSML
            return
        for row in self.table.missing.get(name, ()) if self.in_dialect else ():
            if not element.get(row.attribute, "").strip():
                self.apply(row)
                for attribute, value in self._assignments(row, element, ""):
                    element.set(attribute, value)
        self._children(element)

    def _name(self, element: Any) -> tuple[str, str | None]:
        """Return the local name of an element, and its name in the table, or None for an extension."""
        space, _, name = str(element.tag).rpartition("}")
        if space[1:] in _OURS:
            return name, None
        return name, f"sbm:{name}" if space[1:] == SMARTBODY else name

    def apply(self, row: Row) -> None:
        self.applied[row] = None

    # attributes

    def _attributes(self, element: Any, name: str, key: str | None = None, stays: bool = False) -> bool:
        """Translate the attributes of an element; return whether it stays, as with `stays` it does."""
        known = self.table.attributes.get(name) or {}
        if key and key != name:
            known = {**known, **self.table.attributes.get(key, {})}
        everywhere = self.table.attributes["*"]
        if len(element.attrib) > MAX_ATTRIBUTES:
            return True  # the parser will refuse it
        for attribute, value in element.items():
            short = attribute.rpartition("}")[2]
            rows = known.get(short) or (everywhere.get(short) if name in POINTS or key != name else None)
            row = self._row(rows, value) if rows else None
            if row is not None and row.becomes == "!" and stays:
                continue
            if row is not None and not self._attribute(element, attribute, value, row):
                return False
        return True

    def _row(self, rows: Iterable[Row], value: str) -> Row | None:
        """Return the first row for a value."""
        fitting = (row for row in rows if (self.in_dialect or row.dialect != "any") and row.fits(value))
        return next(fitting, None)

    def _attribute(self, element: Any, attribute: str, value: str, row: Row) -> bool:
        """Apply a row to an attribute; return whether the element stays."""
        if not row.becomes:
            self.apply(row)
            return True
        if row.becomes == "!":
            self.apply(row)
            remove_element(element)
            return False
        tag, _, becomes = row.becomes.rpartition(": ")
        assignments: list[tuple[str, str]] | None = None
        if becomes.startswith("@"):
            found = FUNCTIONS[becomes[1:]](element, value)
            if found is None:
                return True
            assignments = list(found.items())
        elif "=" in becomes:
            assignments = list(self._assignments(row, element, value))
            if not tag and assignments == [(attribute, value)]:
                return True
        elif becomes != "-":
            assignments = [(becomes, value)]
        self.apply(row)
        element.attrib.pop(attribute, None)
        for name, text in assignments or ():
            if name not in element.attrib:
                element.set(name, text)
        if tag:
            self._rename(element, tag)
        return True

    def _assignments(self, row: Row, element: Any, value: str) -> Iterator[tuple[str, str]]:
        """Yield (name, value) of the attributes that a row sets."""
        for part in row.becomes.rpartition(": ")[2].split(";"):
            name, _, text = part.partition("=")
            if "{id}" in text and not element.get("id", "").strip():
                element.set("id", self._free_id(element))
            yield name, text.format(value=value.strip(), id=element.get("id", "").strip())

    def _translate_element(self, element: Any, row: Row) -> bool:
        """Apply the row of an element; return whether the element stays."""
        self.apply(row)
        if row.becomes == "-":
            remove_element(element)
            return False
        tag, colon, _ = row.becomes.partition(": ")
        if colon:
            for name, text in self._assignments(row, element, ""):
                if name not in element.attrib:
                    element.set(name, text)
        self._rename(element, tag)
        return True

    def _rename(self, element: Any, name: str) -> None:
        prefix, colon, short = name.rpartition(":")
        space = NAMESPACES[prefix] if colon else str(self.root.tag).rpartition("}")[0][1:]
        element.tag = f"{{{space}}}{short}" if space else short

    def timed(self) -> Iterator[Any]:
        """Yield the behaviours."""
        for element in self.root:
            if local(str(element.tag)) == "required":
                yield from element
            else:
                yield element

    def _kind(self, element: Any) -> str:
        return local(str(element.tag))

    # ids

    def add_ids(self) -> list[str]:
        """Set the ids of behaviours with no id or with that of another one; return descriptions of them."""
        seen: set[str] = set()
        made = []
        for element in self.timed():
            id = element.get("id", "").strip()
            ours = id and str(element.tag)[1:].startswith(tuple(_OURS))
            if self._kind(element) == "constraint" or ours:
                continue
            if not id or id in seen:
                element.set("id", self._free_id(element))
                made.append(f'<{self._kind(element)}> without an id of its own as "{element.get("id")}"')
            seen.add(element.get("id"))
        return made

    def _free_id(self, element: Any) -> str:
        kind = self._kind(element)
        numbers = self.numbers.setdefault(kind, count(1))
        id = next(id for n in numbers if (id := f"{kind}{n}") not in self.used)
        self.used.add(id)
        return id

    def add_composition(self) -> None:
        """Set the composition of Greta's <fml-apml>."""
        around = self.root.getparent()
        if around is not None and "composition" in around.attrib and "composition" not in self.root.attrib:
            self.root.set("composition", around.get("composition"))

    def add_character(self) -> None:
        """Set the character that SmartBody's <participant> names."""
        around = self.root.getparent()
        participants = around.findall("{*}participant") if around is not None else []
        if (
            participants
            and (id := participants[0].get("id", "").strip())
            and "characterId" not in self.root.attrib
        ):
            self.root.set("characterId", id)


_WORDS = frozenset(("lexeme", "type", "rotation", "orientation", "au", "shape"))
_PARTS = ("{*}lexeme", "{*}faceLexeme", "{*}facs", "{*}faceFacs")


def translate_reference(element: Any, name: str, apply: Callable[[Row], None]) -> None:
    """Give a head or face without a lexeme the one that its description refers to; `apply` gets the row."""
    if name not in ("head", "face") or not _WORDS.isdisjoint(element.keys()):
        return
    row = next(row for row in table().attributes["description"]["type"] if row.dialect == "Greta")
    for description in element.findall("{*}description"):
        reference = description.findtext("{*}reference", "").rpartition("=")[2].strip()
        if not reference or not row.fits(description.get("type", "")):
            continue
        if name == "head":
            element.set("lexeme", reference)
            apply(row)
        elif all(element.find(part) is None for part in _PARTS):
            space = str(element.tag).rpartition("}")[0]
            etree.SubElement(element, f"{space}}}lexeme" if space else "lexeme", lexeme=reference)
            apply(row)
