"""The recursive-descent parser of one <bml> element.

A behaviour or constraint with a fault is dropped and reported in one Problem; the rest of the block stays.
Unknown attributes are reported too, and nothing is dropped because of them.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import count
from types import MappingProxyType
from typing import Any, NamedTuple

from lxml import etree

from bml_schema.behaviours import Speech
from bml_schema.canonical import attributes
from bml_schema.errors import (
    BEHAVIOR_TYPE_NOT_SUPPORTED,
    CUSTOM_ATTRIBUTE_NOT_SUPPORTED,
    CUSTOM_BEHAVIOR_NOT_SUPPORTED,
    NOT_BML_1_0,
    BMLError,
    BMLSizeError,
    Fault,
    Place,
    Problem,
    listed,
    quoted,
)
from bml_schema.node_schema import local, path_below, schema_of
from bml_schema.nodes import CORE, EXTENSIONS, Behaviour, Block, Constraint, Required
from bml_schema.reading.block_outline import BlockOutline, Entry, flat
from bml_schema.reading.dropped_references import ReferenceRemover
from bml_schema.reading.element_reader import ElementReader, Vocabulary
from bml_schema.steps import next_element
from bml_schema.sync_refs import Names
from bml_schema.values import block_names, describe_mismatch, is_name
from bml_schema.values import name as NAME

MAX_BEHAVIOURS = 10_000  # in one block; scheduled in about a second
# BMLA writes this in composition or in an attribute of its own.
_APPEND_AFTER = re.compile(r"\s*APPEND-AFTER\s*\(([^()]*)\)\s*", re.IGNORECASE)
_BLOCK_LISTS = {a.field for a in schema_of(Block).attributes.values() if a.value is block_names}
_MAX_ID = 256  # characters of an id that a warning repeats


def read_block(
    root: etree._Element,
    vocabulary: Vocabulary,
    *,
    lines_before: int = 0,
    begins: Mapping[tuple[int, str], int] = MappingProxyType({}),
    max_behaviours: int = MAX_BEHAVIOURS,
    lenient: bool = True,
    notes: Sequence[str] = (),
    rescued: Mapping[etree._Element, Sequence[Fault]] | None = None,
) -> Block:
    """Read the block of a <bml> element.

    Args:
        root: as lxml parsed it, without comments and processing instructions.
        vocabulary: Clark tag -> node class.
        lines_before: number of lines in the text before the part that lxml parsed.
        begins: (line where a start tag ends, its local name) -> line where it begins, if they differ.
        max_behaviours: the limit of behaviours and constraints together.
        lenient: what is not BML 1.0 is read where its meaning is plain.
        notes: what was read as something else; they become one Problem of the block.
        rescued: element -> how it was read; attributes of speech with faults are then left out. None drops
            speech with faults.

    Raises:
        BMLError: not a <bml>, no usable id, or too many behaviours.
    """
    elements = ElementReader(vocabulary, lenient=lenient)
    lines = _Lines(lines_before, begins)
    line = lines.of(root)
    if elements.tag(root) != Block.tag:
        raise BMLError(f"wanted <bml> in namespace {CORE}, got {quoted(str(root.tag))}", line=line)
    try:
        values, wrong_attributes = _block_attributes(root, line, lenient)
    except Fault as wrong:
        raise BMLError(wrong.text, line=line, path="/bml") from None
    names = elements.names = Names(values["id"])
    outline = BlockOutline(elements, names)
    tree = outline.entries(root, "/bml", required=False)
    reader = _Reader(outline, lines, rescued)
    if (count := len(flat(tree))) > max_behaviours:
        text = f"wanted at most {max_behaviours} behaviours and constraints in a block, got {count}"
        raise BMLSizeError(text, line=line, path="/bml", block=names.block)
    if notes:
        reader.problem(names.block, Fault("; ".join(notes), root, NOT_BML_1_0), "/bml", root, dropped=False)
    if wrong_attributes:
        reader.problem(names.block, Fault(wrong_attributes, root), "/bml", root, dropped=False)
    if unknown := elements.describe_unknown(schema_of(Block), root, values["unknown_attributes"], False):
        fault = Fault(unknown, root, CUSTOM_ATTRIBUTE_NOT_SUPPORTED)
        reader.problem(names.block, fault, "/bml", root, dropped=False)
    for text, parent, path in outline.loose:
        # The text belongs to no behaviour, so the problem is the block's.
        reader.problem(
            names.block, Fault(f"wanted elements, got the text {quoted(text)}", parent), path, parent
        )
    children = tuple(reader.children(tree))
    if respelled := list(dict.fromkeys(elements.respelled)):
        text = f"times are read as BML 1.0 writes them: {listed(respelled, 3)}"
        reader.problem(names.block, Fault(text, root, NOT_BML_1_0), "/bml", root, dropped=False)
    next_element()
    block = Block(**values, children=children, problems=tuple(reader.problems), places=reader.places)
    block = reader.pruned(block)
    for constraint in block.constraints:
        if constraint.id and constraint.place:
            reader.places.setdefault(constraint.id, constraint.place)
    next_element()
    return block


def read_behaviour(element: etree._Element, vocabulary: Vocabulary) -> Behaviour | None:
    """Read a single behaviour of a prediction; return None if its element is unknown or has a fault.

    Its id can contain colons ("block:behaviour"), and its references are not checked.
    """
    elements = ElementReader(vocabulary)
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


def _block_attributes(root: etree._Element, line: int, lenient: bool) -> tuple[dict[str, Any], str]:
    """Return attribute values by field, and a message about faults; raise BMLError for a fault in the id."""
    known = schema_of(Block).attributes
    values: dict[str, Any] = {"unknown_attributes": {}}
    faults: list[str] = []
    after: tuple[str, ...] = ()
    if "id" not in root.attrib:
        raise BMLError("id: wanted one, got none", line=line, path="/bml")
    for name, text in attributes(root):
        spec = known.get(name)
        if spec is None:
            values["unknown_attributes"][name] = text
            continue
        try:
            if name == "composition" and (listed := _APPEND_AFTER.fullmatch(text)):
                after = block_names.read(listed[1])
            else:
                values[spec.field] = spec.value.read(text)
        except ValueError:
            if lenient and (folded := spec.value.fold(text)) is not None:
                values[spec.field] = folded
                continue
            fault = f"{local(name)}: {describe_mismatch(spec.value.wanted, text, quoted(text))}"
            if name == "id":
                raise BMLError(fault, line=line, path="/bml") from None
            if text.strip():
                default = "" if spec.default is None else spec.value.write(spec.default)
                faults.append(f"{fault}; taken as {default or 'none'}")
    if after:
        values["append_after"] = tuple(dict.fromkeys((*values.get("append_after", ()), *after)))
    for field in _BLOCK_LISTS & values.keys():
        # A block cannot wait for itself; its own id is ignored.
        values[field] = tuple(id for id in values[field] if id != values["id"])
    return values, "; ".join(faults)


class _Lines(NamedTuple):
    """Lines of the text where start tags begin; lxml only knows where they end, in the part it parsed."""

    before: int
    begins: Mapping[tuple[int, str], int]

    def of(self, element: etree._Element) -> int:
        line: Any = element.sourceline
        if self.begins:
            line = self.begins.get((line, local(str(element.tag))), line)
        return int(line or 1) + self.before


class _Reader:
    """The state of reading one block."""

    __slots__ = ("elements", "line", "names", "numbers", "owners", "places", "problems", "rescued")

    def __init__(
        self,
        outline: BlockOutline,
        lines: _Lines,
        rescued: Mapping[etree._Element, Sequence[Fault]] | None,
    ) -> None:
        self.rescued = rescued
        self.numbers = count(1)  # of speeches without an id
        self.elements = outline.elements
        self.names = outline.names
        self.owners = outline.owners
        self.line = lines.of
        self.problems: list[Problem] = []
        self.places: dict[str, Place] = {}

    def children(self, tree: list[Entry | list[Entry]]) -> Iterator[Behaviour | Required | Constraint]:
        """Yield the nodes of a tree of entries, without those that are dropped."""
        for item in tree:
            if isinstance(item, list):
                inside = map(self.node, item)
                yield Required(children=tuple(node for node in inside if node is not None))
            elif (node := self.node(item)) is not None:
                yield node

    def node(self, entry: Entry) -> Behaviour | Constraint | None:
        """Return the node of an entry, or None, with a Problem, if it is dropped."""
        next_element()
        remarks = self.elements.remarks
        if self.rescued:
            remarks += self.rescued.get(entry.element, ())
        if self.rescued is not None and entry.kind.cls is Speech:
            self.elements.forgiving = not entry.required
            entry = entry if entry.required else self.with_id(entry)
        try:
            is_constraint = entry.kind.tag == Constraint.tag
            node = self.constraint(entry) if is_constraint else self.behaviour(entry)
        except Fault as fault:
            self.problem(self.warned(entry), fault, entry.path, entry.element, entry.required)
            node = None
            remarks.clear()
        self.elements.forgiving = False
        for remark in remarks:
            self.problem(self.warned(entry), remark, entry.path, entry.element, dropped=False)
        remarks.clear()
        return node

    def behaviour(self, entry: Entry) -> Behaviour:
        cls, element = entry.kind.cls, entry.element
        if cls is None:
            raise self.unknown(entry)
        owner = self.owners.get(entry.id, entry)
        if owner is not entry:
            line = self.line(owner.element)
            raise Fault(f"id: wanted one of its own, got {quoted(entry.id)}, which line {line} has", element)
        node: Behaviour = self.elements.node(cls, element, timed=True)
        self.places[node.id] = Place(self.line(element), entry.path)
        return node

    def with_id(self, entry: Entry) -> Entry:
        """Return the entry of a speech with an id of its own, with a remark if it had none."""
        wrong = ""
        if not is_name(entry.id):
            wrong = f"id: wanted {NAME.wanted}, got {quoted(entry.id) if entry.id else 'none'}"
        if not wrong and self.owners.get(entry.id, entry) is entry:
            return entry
        id = next(id for n in self.numbers if (id := f"speech{n}") not in self.owners)
        reason = wrong or f"id: wanted one of its own, got {quoted(entry.id)}"
        element = entry.element
        element.set("id", id)
        text = f'{reason}; it is called "{id}"'
        self.elements.remarks.append(Fault(text, element, CUSTOM_ATTRIBUTE_NOT_SUPPORTED))
        self.owners[id] = entry = entry._replace(id=id)
        return entry

    def unknown(self, entry: Entry) -> Fault:
        tag, element = entry.kind.tag, entry.element
        standard = (f"{{{CORE}}}", f"{{{EXTENSIONS}}}")
        if not tag.startswith(standard):
            space = tag.removesuffix(local(tag))
            beside = (local(t) for t in self.elements.vocabulary if space and t.startswith(space))
            text = f"no behaviour {quoted(tag)} is known here{self.names.suggest(local(tag), beside, 0.7)}"
            return Fault(text, element, CUSTOM_BEHAVIOR_NOT_SUPPORTED)
        name = local(tag)
        elsewhere = [t for t in self.elements.vocabulary if local(t) == name]
        if elsewhere:
            hint = f", but one in the namespace {elsewhere[0][1:].partition('}')[0]}"
        else:
            known = [t for t in self.elements.vocabulary if t.startswith(standard)]
            around = [local(t) for t in known if name in schema_of(self.elements.vocabulary[t]).by_local]
            hint = f", it stands inside <{'> or <'.join(around)}>" if around else ""
            hint = hint or self.names.suggest(name, map(local, known), 0.7)
        return Fault(f"no behaviour <{name}> in BML 1.0{hint}", element, BEHAVIOR_TYPE_NOT_SUPPORTED)

    def constraint(self, entry: Entry) -> Constraint:
        values = self.elements.constraint(entry.element)
        place = Place(self.line(entry.element), entry.path)
        return Constraint(**values, required=entry.required, place=place)

    def warned(self, entry: Entry) -> str:
        """Return the id of warnings about an entry, which may have none."""
        if 0 < len(entry.id) <= _MAX_ID:
            return f"{self.names.block}:{entry.id}"
        is_constraint = entry.kind.tag == Constraint.tag
        return self.names.block if is_constraint else f"{self.names.block}:{entry.path}"

    def pruned(self, block: Block) -> Block:
        """Return the block without references to dropped behaviours, which are named in their Problems."""
        gone = self.owners.keys() - self.places.keys()
        if not gone:
            return block
        remover = ReferenceRemover(gone)
        rest, prefix = block.with_children(remover.without), f"{self.names.block}:"
        for n, problem in enumerate(self.problems):
            id = problem.id.removeprefix(prefix) if problem.id.startswith(prefix) else ""
            lost = tuple(remover.lost_references.pop(id, ()))
            if lost:
                text = f"{problem.text}; with it went {listed(lost)}"
                fatal = problem.fatal or id in remover.fatal
                self.problems[n] = replace(problem, text=text, lost_references=lost, fatal=fatal)
        return replace(rest, problems=tuple(self.problems))

    def problem(
        self,
        id: str,
        fault: Fault,
        path: str,
        element: etree._Element,
        required: bool = False,
        dropped: bool = True,
    ) -> None:
        where = path_below(fault.element, element, path) if fault.path is None else path + fault.path
        line = self.line(fault.element)
        self.problems.append(
            Problem(
                id=id,
                type=fault.type,
                text=fault.text,
                line=line,
                path=where,
                fatal=required,
                dropped=dropped,
            )
        )
