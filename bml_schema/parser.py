"""One parsed <bml> element in, a Block out.

Faults stay where they are: a behaviour or constraint with a fault is left out and told of in one Problem.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from operator import attrgetter
from types import MappingProxyType
from typing import Any, NamedTuple

from lxml import etree

from bml_schema.behaviours import SpeechText, Sync
from bml_schema.canonical import attributes
from bml_schema.elements import Elements, Vocabulary
from bml_schema.errors import (
    BEHAVIOR_TYPE_NOT_SUPPORTED,
    CUSTOM_BEHAVIOR_NOT_SUPPORTED,
    BMLError,
    Fault,
    Place,
    Problem,
    shown,
)
from bml_schema.losses import Losses
from bml_schema.nodes import CORE, EXTENSIONS, Behaviour, Block, Constraint, Description, Required
from bml_schema.shape import local, shape_of
from bml_schema.sync_refs import Names, Points
from bml_schema.values import block_names, unwanted

__all__ = ["MOST_BEHAVIOURS"]

MOST_BEHAVIOURS = 10_000  # in one block; more than anybody writes, and still scheduled in about a second
_MOST_LISTED = 10  # lost references named in a warning's text; `Problem.lost` has them all
# BMLA says this in composition or in an attribute of its own.
_APPEND_AFTER = re.compile(r"\s*APPEND-AFTER\s*\(([^()]*)\)\s*", re.IGNORECASE)
_BLOCK_LISTS = {a.field for a in shape_of(Block).attributes.values() if a.value is block_names}
_MOST_ID = 256  # characters of an id a warning repeats
# A NamedTuple of thousands is made in a third of the time without its own `__new__`, which is Python.
_tuple = tuple.__new__


def read_block(
    root: etree._Element,
    vocabulary: Vocabulary,
    *,
    lines_before: int = 0,
    begins: Mapping[tuple[int, str], int] = MappingProxyType({}),
    most_behaviours: int = MOST_BEHAVIOURS,
) -> Block:
    """The block of a <bml> element.

    Args:
        root: as lxml parsed it, without comments and processing instructions.
        vocabulary: Clark tag -> node class.
        lines_before: lines of the text in front of what lxml saw.
        begins: (line where a start tag ends, its local name) -> line where it begins, if that is another.
        most_behaviours: more (constraints counted with them) are refused.

    Raises:
        BMLError: not a <bml>, no usable id, or too many behaviours.
    """
    elements = Elements(vocabulary)
    lines = _Lines(lines_before, begins)
    line = lines.of(root)
    if elements.tag(root) != Block.tag:
        raise BMLError(f"wanted <bml> in namespace {CORE}, got {shown(str(root.tag))}", line=line)
    try:
        values, wrong_attributes = _block_attributes(root, line)
    except Fault as wrong:
        raise BMLError(wrong.text, line=line, path="/bml") from None
    names = elements.names = Names(values["id"])
    reader = _Reader(elements, names, lines)
    tree = reader.entries(root, "/bml", required=False)
    entries = _flat(tree)
    if len(entries) > most_behaviours:
        said = f"wanted at most {most_behaviours} behaviours and constraints in a block, got {len(entries)}"
        raise BMLError(said, line=line, path="/bml", block=names.block)
    if wrong_attributes:
        reader.problem(names.block, Fault(wrong_attributes, root), "/bml", root)
    nodes: dict[int, Behaviour | Constraint] = {}
    for n, entry in enumerate(entries):
        read = reader.constraint if entry.kind.tag == Constraint.tag else reader.behaviour
        node = read(entry)
        if node is not None:
            nodes[n] = node
    reader.prune(nodes)
    for node in nodes.values():
        if isinstance(node, Constraint) and node.id and node.place:
            reader.places.setdefault(node.id, node.place)
    return Block(
        **values,
        children=_grouped(tree, nodes),
        problems=tuple(reader.problems),
        places=reader.places,
    )


def read_behaviour(element: etree._Element, vocabulary: Vocabulary) -> Behaviour | None:
    """A behaviour on its own, as predictions hold them; None if its kind is unknown or it has a fault.

    Its id may hold colons ("block:behaviour"), and its references are not looked up.
    """
    elements = Elements(vocabulary)
    cls = vocabulary.get(elements.tag(element))
    if cls is None:
        return None
    id = element.get("id", "")
    element.set("id", "_")
    try:
        node: Behaviour = elements.node(cls, element, timed=True)
    except Fault:
        return None
    return replace(node, id=id)


def _block_attributes(root: etree._Element, line: int) -> tuple[dict[str, Any], str]:
    """Values by field, and what is wrong with them; a fault in the id is an error."""
    known = shape_of(Block).attributes
    values: dict[str, Any] = {"foreign": {}}
    faults: list[str] = []
    after: tuple[str, ...] = ()
    if "id" not in root.attrib:
        raise BMLError("id: wanted one, got none", line=line, path="/bml")
    for name, text in attributes(root):
        spec = known.get(name)
        if spec is None:
            values["foreign"][name] = text
            continue
        try:
            if name == "composition" and (listed := _APPEND_AFTER.fullmatch(text)):
                after = block_names.read(listed[1])
            else:
                values[spec.field] = spec.value.read(text)
        except ValueError:
            said = f"{local(name)}: {unwanted(spec.value.wanted, text, shown(text))}"
            if name == "id":
                raise BMLError(said, line=line, path="/bml") from None
            if text.strip():
                default = "" if spec.default is None else spec.value.write(spec.default)
                faults.append(f"{said}; taken as {default or 'none'}")
    if after:
        values["append_after"] = tuple(dict.fromkeys((*values.get("append_after", ()), *after)))
    for field in _BLOCK_LISTS & values.keys():
        # A block cannot wait for itself; its id in such a list says nothing.
        values[field] = tuple(id for id in values[field] if id != values["id"])
    return values, "; ".join(faults)


class _Lines(NamedTuple):
    """Lines of the text where start tags begin; lxml knows where they end, in what it was given."""

    before: int
    begins: Mapping[tuple[int, str], int]

    def of(self, element: etree._Element) -> int:
        line: Any = element.sourceline
        if self.begins:
            line = self.begins.get((line, local(str(element.tag))), line)
        return int(line or 1) + self.before


class _Kind(NamedTuple):
    """What children of the block of one tag have in common.

    Attributes:
        step: name in paths.
        cls: None for a constraint and for what is unknown.
        points: what references may name; None if that depends on the element, or nobody knows.
    """

    tag: str
    step: str
    cls: type[Behaviour] | None = None
    points: Points | None = None


def _kind_of(cls: type[Behaviour]) -> _Kind:
    kind = _KINDS.get(cls)
    if kind is None:
        shape = shape_of(cls)
        points = None if cls.marks or shape.strokes else Points(shape.points)
        kind = _KINDS[cls] = _Kind(cls.tag, shape.name, cls, points)
    return kind


_KINDS: dict[type[Behaviour], _Kind] = {}


class _Entry(NamedTuple):
    """A child of the block: a behaviour, a constraint, or unknown."""

    element: etree._Element
    kind: _Kind
    id: str
    path: str
    required: bool


class _Reader:
    """What is known while one block is read."""

    __slots__ = ("elements", "kinds", "line", "names", "owners", "places", "problems")

    def __init__(self, elements: Elements, names: Names, lines: _Lines) -> None:
        self.elements = elements
        self.names = names
        # Nearly always lxml's lines are those of the text.
        self.line: Callable[[etree._Element], int] = lines.of if any(lines) else attrgetter("sourceline")
        self.kinds: dict[str, _Kind] = {}  # by tag as it stands
        self.problems: list[Problem] = []
        self.places: dict[str, Place] = {}
        self.owners: dict[str, _Entry] = {}

    # bml := (behaviour | constraint | required)*

    def entries(self, parent: etree._Element, path: str, *, required: bool) -> list[_Entry | list[_Entry]]:
        """What stands in a block, as a tree: a list for each <required>; one inside another adds nothing."""
        tree: list[_Entry | list[_Entry]] = []
        counts: dict[str, int] = {}
        loose = parent.text
        kinds = self.kinds
        owners, points = self.owners, self.names.points
        for element in parent:
            raw: Any = element.tag
            kind = kinds.get(raw)
            if kind is None:
                kind = kinds[raw] = self.kind(element)
            step = kind.step
            counts[step] = n = counts.get(step, 0) + 1
            here = f"{path}/{step}[{n}]"
            if not loose or loose.isspace():
                loose = element.tail
            if kind.tag == Required.tag:
                inside = self.entries(element, here, required=True)
                tree.append(_flat(inside))
                continue
            id = element.get("id", "").strip()
            entry = _tuple(_Entry, (element, kind, id, here, required))
            tree.append(entry)
            # What references may say of it, before any is read.
            if id and id not in owners and kind.tag != Constraint.tag:
                owners[id] = entry
                points[id] = kind.points or self.points(element, kind)
        if loose and not loose.isspace():
            # Nobody's text, so the block's problem.
            fault = Fault(f"wanted elements, got the text {shown(loose.strip())}", parent)
            self.problem(self.names.block, fault, path, parent)
        return tree

    def kind(self, element: etree._Element) -> _Kind:
        tag = self.elements.tag(element)
        cls = self.elements.vocabulary.get(tag)
        return _Kind(tag, local(tag)) if cls is None else _kind_of(cls)

    def points(self, element: etree._Element, kind: _Kind) -> Points | None:
        """What references may name of an element whose kind does not tell."""
        if kind.cls is None:
            return None
        names = shape_of(kind.cls).points
        if not kind.cls.marks:
            times = element.get("repetition", "1").strip()
            return Points(names, int(times) if times.isdecimal() and len(times) < 6 else 1)
        marks: list[str] = []
        for child in element:
            tag = self.elements.tag(child)
            if tag == SpeechText.tag:
                marks += [s.get("id", "").strip() for s in child if self.elements.tag(s) == Sync.tag]
            elif tag == Description.tag:
                # It may name points that the core text leaves out.
                marks += [m.get("name", "").strip() for m in child.iterdescendants("{*}mark")]
        return Points(names.union(m for m in marks if ":" not in m) if marks else names)

    def behaviour(self, entry: _Entry) -> Behaviour | None:
        """The node of an entry; None, and a Problem, if it is dropped."""
        element = entry.element
        try:
            cls = entry.kind.cls
            if cls is None:
                raise self.unknown(entry)
            owner = self.owners.get(entry.id, entry)
            if owner is not entry:
                line = self.line(owner.element)
                said = f"id: wanted one of its own, got {shown(entry.id)}, which line {line} has"
                raise Fault(said, element)
            node: Behaviour = self.elements.node(cls, element, timed=True)
        except Fault as fault:
            id = entry.id if 0 < len(entry.id) <= _MOST_ID else entry.path
            self.problem(f"{self.names.block}:{id}", fault, entry.path, element, entry.required)
            return None
        self.places[node.id] = _tuple(Place, (self.line(element), entry.path))
        return node

    def unknown(self, entry: _Entry) -> Fault:
        tag, element = entry.kind.tag, entry.element
        standard = (f"{{{CORE}}}", f"{{{EXTENSIONS}}}")
        if not tag.startswith(standard):
            return Fault(f"no behaviour {shown(tag)} is known here", element, CUSTOM_BEHAVIOR_NOT_SUPPORTED)
        name = local(tag)
        elsewhere = [t for t in self.elements.vocabulary if local(t) == name]
        if elsewhere:
            hint = f", but one in the namespace {elsewhere[0][1:].partition('}')[0]}"
        else:
            hint = self.names.suggest(
                name, [local(t) for t in self.elements.vocabulary if t.startswith(standard)]
            )
        return Fault(f"no behaviour <{name}> in BML 1.0{hint}", element, BEHAVIOR_TYPE_NOT_SUPPORTED)

    def constraint(self, entry: _Entry) -> Constraint | None:
        """The node of an entry; None, and a Problem, if it is dropped."""
        element = entry.element
        try:
            values = self.elements.constraint(element)
        except Fault as fault:
            id = entry.id if 0 < len(entry.id) <= _MOST_ID else self.names.block
            self.problem(id, fault, entry.path, element, entry.required)
            return None
        place = Place(self.line(element), entry.path)
        return Constraint(**values, required=entry.required, place=place)

    # What went, and what went with it

    def prune(self, nodes: dict[int, Behaviour | Constraint]) -> None:
        """Take references to dropped behaviours out of what is left, and tell of them in the Problems."""
        gone = self.owners.keys() - self.places.keys()
        if not gone:
            return
        losses = Losses(gone)
        for n, node in list(nodes.items()):
            left = losses.without(node)
            if left is None:
                del nodes[n]
            else:
                nodes[n] = left
        prefix = f"{self.names.block}:"
        for n, problem in enumerate(self.problems):
            id = problem.id.removeprefix(prefix) if problem.id.startswith(prefix) else ""
            lost = tuple(losses.lost.pop(id, ()))
            if lost:
                more = len(lost) - _MOST_LISTED
                named = ", ".join(lost[:_MOST_LISTED]) + (f" and {more} more" if more > 0 else "")
                text = f"{problem.text}; with it went {named}"
                fatal = problem.fatal or id in losses.fatal
                self.problems[n] = replace(problem, text=text, lost=lost, fatal=fatal)

    def problem(
        self, id: str, fault: Fault, path: str, element: etree._Element, required: bool = False
    ) -> None:
        where = _path_below(fault.element, element, path)
        line = self.line(fault.element)
        self.problems.append(
            Problem(id=id, type=fault.type, text=fault.text, line=line, path=where, fatal=required)
        )


def _flat(tree: list[_Entry | list[_Entry]]) -> list[_Entry]:
    return [e for item in tree for e in (item if isinstance(item, list) else (item,))]


def _grouped(
    tree: list[_Entry | list[_Entry]], nodes: Mapping[int, Behaviour | Constraint]
) -> tuple[Behaviour | Required | Constraint, ...]:
    """The nodes that are left, in the tree of their entries."""
    if list not in map(type, tree):
        return tuple(nodes.values())
    out: list[Behaviour | Required | Constraint] = []
    n = 0
    for item in tree:
        if isinstance(item, list):
            span = range(n, n + len(item))
            out.append(Required(children=tuple(nodes[k] for k in span if k in nodes)))
            n += len(item)
        else:
            if n in nodes:
                out.append(nodes[n])
            n += 1
    return tuple(out)


def _path_below(element: etree._Element, top: etree._Element, path: str) -> str:
    """Path of an element inside `top`, whose own path is known."""
    steps = ""
    while element is not top:
        parent = element.getparent()
        if parent is None:
            break
        name = local(str(element.tag))
        n = 1 + sum(local(str(e.tag)) == name for e in element.itersiblings(preceding=True))
        steps = f"/{name}[{n}]{steps}"
        element = parent
    return path + steps
