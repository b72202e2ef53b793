"""Translates an element tree from a dialect to BML 1.0, in place, before it is parsed."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from copy import deepcopy
from itertools import count
from typing import Any

from lxml import etree

from bml_schema.canonical import MAX_ATTRIBUTES
from bml_schema.dialects.speech_text import translate_speech
from bml_schema.dialects.table import Row, point_row, squeezed, table
from bml_schema.dialects.values import FUNCTIONS
from bml_schema.node_schema import local
from bml_schema.nodes import BMLA, BMLT, CORE, DRAFTS, EXTENSIONS, OWN
from bml_schema.undeclared_prefixes import SMARTBODY, remove_element
from bml_schema.vocabulary import VOCABULARY

__all__ = ["dialect_of", "is_draft", "made_ids", "translate"]

_SPACES = {"ext": EXTENSIONS, "bmla": BMLA, "bmlt": BMLT, "realizer": OWN}
_OURS = frozenset({BMLA, BMLT, OWN})
_MAX_LISTED = 12  # words in the warning
_NAMES = {"SmartBody": "SmartBody's BML", "Greta": "Greta's BML", "draft": "a draft of BML"}
_READ_AS = "read as "
_POINTS = {local(tag): cls.sync_points for tag, cls in VOCABULARY.items()}
_MARKS = {local(tag) for tag, cls in VOCABULARY.items() if cls.marks}
_REFERENCE = re.compile(r"\s*([^:\s]+)\s*:\s*([A-Za-z_-]+?)(\s*[+-]\s*[0-9.]+\s*)?")
_FUNCTION = re.compile(r"\s*(?:after|before)\s*\((.*)\)\s*")


def is_draft(root: etree._Element) -> bool:
    """Return whether a document is in the namespace of a draft."""
    return str(root.tag).rpartition("}")[0][1:] in DRAFTS


def made_ids() -> Iterator[str]:
    """Yield ids for blocks without one: unnamed1, unnamed2 ..."""
    return (f"unnamed{n}" for n in count(1))


def translate(root: etree._Element, wrapper: str, block_ids: Iterator[str]) -> str:
    """Translate a document to BML 1.0 in place.

    Args:
        root: the <bml> element; elements and attributes of BML 1.0 do not change.
        wrapper: local name of the element around it, or "".
        block_ids: ids for blocks of a dialect without an id.

    Returns:
        The text of a warning that lists the translations; "" if nothing was translated.
    """
    space = str(root.tag).rpartition("}")[0][1:]
    if space not in ("", CORE, *DRAFTS):
        return ""
    translation = _Translation(root)
    translation.run()
    if not (translation.applied or wrapper or space in DRAFTS):
        return ""
    translation.in_dialect = True
    translation.run()
    made = translation.add_ids()
    if wrapper == "act":
        translation.add_character()
    if not root.get("id", "").strip():
        root.set("id", next(block_ids))
        made = [f'the block as "{root.get("id")}"', *made]
    return _described(translation.applied, wrapper, made)


def dialect_of(root: etree._Element, wrapper: str) -> str:
    """Return the name of the dialect of a document, "" for BML 1.0; for the arguments see `translate`."""
    note = translate(deepcopy(root), wrapper, made_ids())
    return note.removeprefix(_READ_AS).partition(":")[0]


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
        self.used = {e.get("id", "").strip() for e in self._timed()}
        self.numbers: dict[str, Iterator[int]] = {}

    def run(self) -> None:
        self._attributes(self.root, "bml")
        self._children(self.root)
        timed = list(self._timed())
        kinds = {e.get("id", "").strip(): self._kind(e) for e in timed}
        for element in timed:
            self._sync_points(element, kinds)
        for sync in self.root.iter("{*}sync", "{*}before", "{*}after", "{*}synchronize", "{*}synchronise"):
            if "ref" in sync.attrib:
                sync.set("ref", self._reference(sync.get("ref"), kinds))

    def _children(self, parent: Any) -> None:
        for element in list(parent):
            name, key = self._name(element)
            if key is None:
                continue
            if name == "description":
                self._attributes(element, name)
                continue
            if name == "speech":
                translate_speech(element, self._apply, words=self.in_dialect)
            own = self.table.elements.get(key) or self.table.elements.get(name)
            if not self._attributes(element, name, key):
                continue
            if own is not None and own.becomes and not self._translate_element(element, own):
                continue
            renamed, _ = self._name(element)
            if renamed != name and not self._attributes(element, renamed):
                continue
            name = renamed
            for row in self.table.missing.get(name, ()) if self.in_dialect else ():
                if not element.get(row.attribute, "").strip():
                    self._apply(row)
                    for attribute, value in self._assignments(row, element, ""):
                        element.set(attribute, value)
            self._children(element)

    def _name(self, element: Any) -> tuple[str, str | None]:
        """Return the local name of an element, and its name in the table, or None for an extension."""
        space, _, name = str(element.tag).rpartition("}")
        if space[1:] in _OURS:
            return name, None
        return name, f"sbm:{name}" if space[1:] == SMARTBODY else name

    def _apply(self, row: Row) -> None:
        self.applied[row] = None

    # attributes

    def _attributes(self, element: Any, name: str, key: str | None = None) -> bool:
        """Translate the attributes of an element; return whether the element stays."""
        known = self.table.attributes.get(name) or {}
        if key and key != name:
            known = {**known, **self.table.attributes.get(key, {})}
        everywhere = self.table.attributes["*"]
        if len(element.attrib) > MAX_ATTRIBUTES:
            return True  # the parser will refuse it
        for attribute, value in element.items():
            short = attribute.rpartition("}")[2]
            rows = known.get(short) or (everywhere.get(short) if name in _POINTS or key != name else None)
            row = self._row(rows, value) if rows else None
            if row is not None and not self._attribute(element, attribute, value, row):
                return False
        return True

    def _row(self, rows: Iterable[tuple[re.Pattern[str] | None, Row]], value: str) -> Row | None:
        """Return the first row for a value."""
        return next(
            (
                row
                for pattern, row in rows
                if (self.in_dialect or row.dialect != "any") and (not pattern or pattern.match(value))
            ),
            None,
        )

    def _attribute(self, element: Any, attribute: str, value: str, row: Row) -> bool:
        """Apply a row to an attribute; return whether the element stays."""
        if not row.becomes:
            self._apply(row)
            return True
        if row.becomes == "!":
            self._apply(row)
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
        self._apply(row)
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
        self._apply(row)
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
        space = _SPACES[prefix] if colon else str(self.root.tag).rpartition("}")[0][1:]
        element.tag = f"{{{space}}}{short}" if space else short

    # sync points and references

    def _timed(self) -> Iterator[Any]:
        """Yield the behaviours."""
        for element in self.root:
            if local(str(element.tag)) == "required":
                yield from element
            else:
                yield element

    def _kind(self, element: Any) -> str:
        return local(str(element.tag))

    def _sync_points(self, element: Any, kinds: Mapping[str, str]) -> None:
        """Rename the sync points of a behaviour, and those that it refers to, to their names in BML 1.0."""
        kind = self._kind(element)
        points = _POINTS.get(kind)
        if points is None or len(element.attrib) > MAX_ATTRIBUTES:
            return
        for name, value in element.items():
            point = name
            if name not in points:
                row = point_row(name)
                meant = self._point(row, name, points) if row is not None else ""
                if row is None or not meant:
                    continue
                self._apply(row)
                del element.attrib[name]
                if meant in element.attrib:
                    continue
                point = meant
            reference = self._reference(value, kinds)
            if reference != value or point != name:
                element.set(point, reference)

    def _point(self, row: Row, name: str, points: tuple[str, ...]) -> str:
        """Return the first sync point of a row that a behaviour has, or "" if the row does not apply."""
        meant = next((point for point in row.becomes.split("|") if point in points), "")
        spelled = name.lower() != meant.lower() and squeezed(name) == squeezed(meant)
        return meant if self.in_dialect or spelled else ""

    def _reference(self, value: str, kinds: Mapping[str, str]) -> str:
        """Return a reference with the name of its sync point in BML 1.0."""
        if function := _FUNCTION.fullmatch(value):
            self._apply(self.table.elements["*"])
            value = function[1]
        found = _REFERENCE.fullmatch(value)
        if found is None:
            return value
        id, point, offset = found.groups()
        if id == "act" and id not in kinds:
            return f"bml:{point}{offset or ''}"
        kind = kinds.get(id)
        points = _POINTS.get(kind or "")
        row = point_row(point)
        if points is None or row is None or point in points:
            return value
        translated = self._point(row, point, points)
        if not translated:
            return value
        self._apply(row)
        return f"{id}:{translated}{offset or ''}"

    # ids

    def add_ids(self) -> list[str]:
        """Set the ids of behaviours with no id or with that of another one; return descriptions of them."""
        seen: set[str] = set()
        made = []
        for element in self._timed():
            id = element.get("id", "").strip()
            if self._kind(element) == "constraint" or str(element.tag)[1:].startswith(tuple(_OURS)):
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


def _described(applied: Mapping[Row, None], wrapper: str, made: list[str]) -> str:
    """Return the text of the warning."""
    if not applied and not made:
        return ""
    counts = {name: sum(row.dialect == name for row in applied) for name in _NAMES}
    dialect = {"act": "SmartBody", "fml-apml": "Greta"}.get(wrapper) or max(counts, key=lambda n: counts[n])
    read: dict[str, None] = {}
    ignored: dict[str, None] = {}
    for row in applied:
        if row.becomes in ("-", "!"):
            ignored[row.name] = None
        else:
            read[f"{row.name} as {_shown(row)}"] = None
    parts = [_listed(list(read) + made)] if read or made else []
    parts += [f"without {_listed(list(ignored))}"] if ignored else []
    return f"{_READ_AS}{_NAMES[dialect]}: {', '.join(parts)}"


def _shown(row: Row) -> str:
    tag, _, becomes = row.becomes.rpartition(": ")
    shown = becomes.replace("{value}", "...").replace("{id}:", "").replace(";", " ").replace("|", " or ")
    return f"{tag} {row.says or row.attribute if becomes[:1] in ('@', '') else shown}".strip()


def _listed(words: list[str]) -> str:
    rest = len(words) - _MAX_LISTED
    return ", ".join(words[:_MAX_LISTED]) + (f" and {rest} more" if rest > 0 else "")
