"""A first pass over a <bml> element: its children, and the sync points that references can name."""

from typing import Any, NamedTuple

from lxml import etree

from bml_schema.behaviours import SpeechText
from bml_schema.node_schema import local, schema_of
from bml_schema.nodes import Behaviour, Constraint, Description, Required
from bml_schema.reading.element_reader import ElementReader
from bml_schema.reading.ssml import ANY_MARK, mark_of
from bml_schema.steps import next_element
from bml_schema.sync_refs import Names, Points


class Kind(NamedTuple):
    """The common properties of all children of a block with the same tag."""

    tag: str
    step: str  # name in paths
    cls: type[Behaviour] | None = None  # node class; None for a constraint and an unknown element
    points: Points | None = None  # sync points that references can name; None if unknown
    # The sync points depend on the element: on its number of strokes, or the marks in its text.
    varies: bool = False


class Entry(NamedTuple):
    """A child of the block: a behaviour, a constraint, or unknown."""

    element: etree._Element
    kind: Kind
    id: str
    path: str
    required: bool


class BlockOutline:
    """The children of one block.

    Attributes:
        names: sync points that references can name; filled by `entries`.
        owners: id -> the first behaviour with this id.
        loose: text between elements, with the element around it and its path.
    """

    __slots__ = ("elements", "kinds", "loose", "names", "owners")

    def __init__(self, elements: ElementReader, names: Names) -> None:
        self.elements = elements
        self.names = names
        self.owners: dict[str, Entry] = {}
        self.kinds: dict[str, Kind] = {}  # by tag as written in the document
        self.loose: list[tuple[str, etree._Element, str]] = []

    # bml := (behaviour | constraint | required)*

    def entries(self, parent: etree._Element, path: str, *, required: bool) -> list[Entry | list[Entry]]:
        """Return the children of a block as a tree: each <required> is a list, nested ones are flattened."""
        tree: list[Entry | list[Entry]] = []
        counts: dict[str, int] = {}
        loose = parent.text
        kinds = self.kinds
        owners, points = self.owners, self.names.points
        for element in parent:
            next_element()
            raw: Any = element.tag
            kind = kinds.get(raw)
            if kind is None:
                kind = kinds[raw] = self.kind(element)
            step = kind.step
            counts[step] = n = counts.get(step, 0) + 1
            child_path = f"{path}/{step}[{n}]"
            if not loose or loose.isspace():
                loose = element.tail
            if kind.tag == Required.tag:
                inside = self.entries(element, child_path, required=True)
                tree.append(flat(inside))
                continue
            id = element.get("id", "").strip()
            entry = Entry(element, kind, id, child_path, required)
            tree.append(entry)
            # All names must be known before the first reference is read.
            if id and id not in owners and kind.tag != Constraint.tag:
                owners[id] = entry
                points[id] = self.points(element, kind) if kind.varies else kind.points
        if loose and not loose.isspace():
            self.loose.append((loose.strip(), parent, path))
        return tree

    def kind(self, element: etree._Element) -> Kind:
        """Return the kind of an element, by its tag."""
        tag = self.elements.tag(element)
        cls = self.elements.vocabulary.get(tag)
        if cls is None:
            return Kind(tag, local(tag))
        schema = schema_of(cls)
        varies = cls.marks or ("stroke" in schema.sync_points and "repetition" in schema.attributes)
        return Kind(cls.tag, schema.name, cls, Points(frozenset(schema.sync_points)), varies)

    def points(self, element: etree._Element, kind: Kind) -> Points | None:
        """Return the sync points of an element of a kind that varies."""
        if kind.points is None or kind.cls is None:
            return None
        names = frozenset(kind.points.names)
        if not kind.cls.marks:
            times = element.get("repetition", "").strip()
            return Points(names, int(times)) if times.isdecimal() and len(times) < 6 else kind.points
        marks: list[str] = []
        for child in element:
            tag = self.elements.tag(child)
            if tag == SpeechText.tag:
                marks += [mark_of(mark) for mark in child.iterdescendants(*ANY_MARK)]
            elif tag == Description.tag:
                # It may name points that the core text does not have.
                marks += [m.get("name", "").strip() for m in child.iterdescendants("{*}mark")]
        return Points(names.union(m for m in marks if ":" not in m and m != "bml")) if marks else kind.points


def flat(tree: list[Entry | list[Entry]]) -> list[Entry]:
    """Return the entries of a tree in document order."""
    return [e for item in tree for e in (item if isinstance(item, list) else (item,))]
