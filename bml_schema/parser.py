"""One parsed <bml> element in, a Block out: recursive descent, one function per grammar rule.

Faults stay where they are: a behaviour or constraint with a fault is left out and told of in one Problem.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from lxml import etree

from bml_schema.behaviours import Speech, SpeechText, Sync
from bml_schema.errors import (
    BEHAVIOR_TYPE_NOT_SUPPORTED,
    CUSTOM_BEHAVIOR_NOT_SUPPORTED,
    PARSING_FAILURE,
    BMLError,
    Place,
    Problem,
    at,
    shown,
)
from bml_schema.escape import escape
from bml_schema.losses import Losses
from bml_schema.nodes import (
    CORE,
    EXTENSIONS,
    After,
    Before,
    Behaviour,
    Block,
    Constraint,
    Description,
    Required,
    Synchronize,
    core,
    extension,
)
from bml_schema.shape import Shape, local, shape_of, sync_ref
from bml_schema.sync_refs import Names, Points, SyncRef, read_sync_ref
from bml_schema.values import unwanted

__all__ = ["MOST_BEHAVIOURS", "read_behaviour", "read_block"]

MOST_BEHAVIOURS = 10_000  # in one block; more than anybody writes, and still scheduled in about a second
_MOST_LISTED = 10  # lost references named in a warning's text; `Problem.lost` has them all

Vocabulary = Mapping[str, type[Behaviour]]

# Documents from before the standard name no namespace, or the draft's.
_DRAFTS = frozenset({"http://www.mindmakers.org/projects/BML"})
_SSML = "application/ssml+xml"
_BLOCK, _REQUIRED, _CONSTRAINT = Block.tag, Required.tag, Constraint.tag
_SYNC, _DESCRIPTION = Sync.tag, Description.tag


class _Fault(Exception):
    """What is wrong with an element; turned into the Problem of the behaviour or constraint around it."""

    def __init__(self, text: str, element: etree._Element, type: str = PARSING_FAILURE) -> None:
        super().__init__(text)
        self.text = text
        self.element = element
        self.type = type


class _Entry(NamedTuple):
    """A child of the block that is a behaviour, a constraint, or unknown."""

    element: etree._Element
    tag: str
    path: str
    required: bool


def read_block(
    root: etree._Element,
    vocabulary: Vocabulary,
    *,
    lines_before: int = 0,
    most_behaviours: int = MOST_BEHAVIOURS,
) -> Block:
    """The block of a <bml> element.

    Args:
        root: as lxml parsed it, without comments and processing instructions.
        vocabulary: Clark tag -> node class.
        lines_before: lines of the text in front of what lxml saw.
        most_behaviours: more are refused.

    Raises:
        BMLError: not a <bml>, no usable id, or too many behaviours.
    """
    return _Reader(vocabulary, lines_before).block(root, most_behaviours)


def read_behaviour(element: etree._Element, vocabulary: Vocabulary) -> Behaviour | None:
    """A behaviour on its own, as predictions hold them; None if its kind is unknown or it has a fault.

    Its id may hold colons ("block:behaviour"), and its references are not looked up.
    """
    reader = _Reader(vocabulary, 0)
    cls = vocabulary.get(reader.tag(element))
    if cls is None:
        return None
    id = element.get("id", "")
    element.set("id", "_")
    try:
        node: Behaviour = reader.node(cls, element, timed=True)
    except _Fault:
        return None
    return replace(node, id=id)


class _Reader:
    """What is known while one document is read."""

    __slots__ = ("_tags", "lines_before", "names", "places", "problems", "vocabulary")

    def __init__(self, vocabulary: Vocabulary, lines_before: int) -> None:
        self.vocabulary = vocabulary
        self.lines_before = lines_before
        self.names: Names | None = None
        self.problems: list[Problem] = []
        self.places: dict[str, Place] = {}
        self._tags: dict[str, str] = {}

    # bml := (behaviour | required | constraint)*

    def block(self, root: etree._Element, most_behaviours: int) -> Block:
        if self.tag(root) != _BLOCK:
            raise BMLError(
                f"wanted <bml> in namespace {CORE}, got {shown(str(root.tag))}", line=self.line(root)
            )
        values, foreign, faults = self.block_attributes(root)
        names = self.names = Names(values["id"])
        tree = self.entries(root, "/bml", required=False)
        entries = [e for item in tree for e in (item if isinstance(item, list) else [item])]
        if len(entries) > most_behaviours:
            raise BMLError(
                f"wanted at most {most_behaviours} behaviours and constraints in a block, got {len(entries)}",
                line=self.line(root),
                path="/bml",
                block=names.block,
            )
        for fault in faults:
            self.problem(names.block, fault, "/bml")
        for entry in entries:
            self.name(entry)
        nodes: dict[int, Behaviour | Constraint] = {}
        for n, entry in enumerate(entries):
            node = self.constraint(entry) if entry.tag == _CONSTRAINT else self.behaviour(entry)
            if node is not None:
                nodes[n] = node
        self.prune(nodes)
        return Block(
            **values,
            children=_grouped(tree, nodes),
            foreign=foreign,
            problems=tuple(self.problems),
            places=self.places,
        )

    def block_attributes(self, root: etree._Element) -> tuple[dict[str, Any], dict[str, str], list[_Fault]]:
        shape = shape_of(Block)
        values: dict[str, Any] = {}
        foreign: dict[str, str] = {}
        faults: list[_Fault] = []
        if "id" not in root.attrib:
            raise BMLError("id: wanted one, got none", line=self.line(root), path="/bml")
        for key, raw in root.items():
            name, text = str(key), str(raw)
            spec = shape.attributes.get(name)
            if spec is None:
                foreign[name] = text
                continue
            try:
                values[spec.field] = spec.value.read(text)
            except ValueError:
                said = f"{name}: {unwanted(spec.value.wanted, text, shown(text))}"
                if name == "id":
                    raise BMLError(said, line=self.line(root), path="/bml") from None
                if text.strip():
                    faults.append(_Fault(f"{said}; taken as {spec.default or 'none'}", root))
        return values, foreign, faults

    def entries(self, parent: etree._Element, path: str, *, required: bool) -> list[_Entry | list[_Entry]]:
        """What stands in a block, as a tree: a list for each <required>; one inside another adds nothing."""
        tree: list[_Entry | list[_Entry]] = []
        counts: dict[str, int] = {}
        self.stray(parent, path)
        for element in parent:
            tag = self.tag(element)
            step = local(tag)
            counts[step] = n = counts.get(step, 0) + 1
            here = f"{path}/{step}[{n}]"
            if tag != _REQUIRED:
                tree.append(_Entry(element, tag, here, required))
                continue
            inside = self.entries(element, here, required=True)
            flat = [e for item in inside for e in (item if isinstance(item, list) else [item])]
            tree.append(flat)
        return tree

    def stray(self, parent: etree._Element, path: str) -> None:
        """Character data between behaviours: nobody's, so the block's."""
        loose = next((t for t in (parent.text, *(e.tail for e in parent)) if t and not t.isspace()), None)
        if loose is not None and self.names is not None:
            fault = _Fault(f"wanted elements, got the text {shown(loose.strip())}", parent)
            self.problem(self.names.block, fault, path)

    def name(self, entry: _Entry) -> None:
        """Note what references may say of an entry, before any reference is read."""
        id = entry.element.get("id", "").strip()
        if not id or entry.tag == _CONSTRAINT or self.names is None or id in self.names.points:
            return
        cls = self.vocabulary.get(entry.tag)
        points: Points | None = None
        if cls is not None:
            names: tuple[str, ...] = cls.sync_points
            if cls.marks:
                names += tuple(
                    mark.get("id", "").strip()
                    for child in entry.element
                    if self.tag(child) == SpeechText.tag
                    for mark in child
                    if self.tag(mark) == _SYNC
                )
            strokes = entry.element.get("repetition", "1").strip() if "stroke" in names else "1"
            points = Points(names, int(strokes) if strokes.isdecimal() and len(strokes) < 6 else 1)
        self.names.points[id] = points

    # behaviour := attributes description* children

    def behaviour(self, entry: _Entry) -> Behaviour | None:
        """The node of an entry; None, and a Problem, if it is dropped."""
        element, tag = entry.element, entry.tag
        assert self.names is not None
        try:
            cls = self.vocabulary.get(tag)
            if cls is None:
                raise self.unknown(element, tag)
            node: Behaviour = self.node(cls, element, timed=True)
            if node.id in self.places:
                line = self.places[node.id].line
                raise _Fault(f'id: wanted one of its own, got "{node.id}", which line {line} has', element)
        except _Fault as fault:
            id = element.get("id", "").strip() or entry.path
            self.problem(f"{self.names.block}:{id}", fault, entry.path, entry.required, entry.element)
            return None
        self.places[node.id] = Place(self.line(element), entry.path)
        return node

    def unknown(self, element: etree._Element, tag: str) -> _Fault:
        if not tag.startswith((f"{{{CORE}}}", f"{{{EXTENSIONS}}}")):
            return _Fault(f"no behaviour {shown(tag)} is known here", element, CUSTOM_BEHAVIOR_NOT_SUPPORTED)
        assert self.names is not None
        near = self.names.suggest(local(tag), [local(t) for t in self.vocabulary])
        return _Fault(f"no behaviour <{local(tag)}> in BML 1.0{near}", element, BEHAVIOR_TYPE_NOT_SUPPORTED)

    def node(self, cls: type[Any], element: etree._Element, *, timed: bool = False) -> Any:
        """An element as its class says; timed: with id and sync points of its own."""
        shape = shape_of(cls)
        values, faults = self.attributes(cls, shape, element, timed)
        if faults:
            raise _Fault("; ".join(faults), element)
        if shape.mixed:
            values[shape.mixed] = tuple(self.mixed(shape, element))
        elif shape.text:
            values[shape.text] = self.text(element)
        else:
            self.children(shape, element, values)
        node = cls(**values)
        if isinstance(node, Behaviour) and (said := node.fault()):
            raise _Fault(said, element)
        return node

    def attributes(
        self, cls: type[Any], shape: Shape, element: etree._Element, timed: bool
    ) -> tuple[dict[str, Any], list[str]]:
        """Values by field, and all that is wrong with them."""
        values: dict[str, Any] = {}
        syncs: dict[str, SyncRef] = {}
        foreign: dict[str, str] = {}
        faults: list[str] = []
        known = shape.attributes
        points = cls.sync_points if timed else ()
        got: set[str] = set()
        for key, raw in element.items():
            name, text = str(key), str(raw)
            spec = known.get(name)
            try:
                if spec is not None:
                    got.add(name)
                    values[spec.field] = (
                        self.reference(text) if spec.value is sync_ref else spec.value.read(text)
                    )
                elif name in points:
                    syncs[name] = self.reference(text)
                else:
                    foreign[name] = text
            except _Unresolved as wrong:
                faults.append(f"{name}: {wrong}")
            except ValueError:
                wanted = spec.value.wanted if spec is not None else ""
                faults.append(f"{name}: {unwanted(wanted, text, shown(text))}")
        for spec in shape.required:
            if spec.name in got:
                continue
            if spec.name == "id" and not timed and "syncs" in shape.names:
                values["id"] = ""  # a part of <face>: it has no timing, so nobody need name it
            else:
                faults.append(f"{spec.name}: wanted {spec.value.wanted}, got none")
        if "syncs" in shape.names:
            values["syncs"] = syncs
            values["foreign"] = foreign
        return values, faults

    def reference(self, text: str) -> SyncRef:
        try:
            return read_sync_ref(text, self.names)
        except ValueError as wrong:
            raise _Unresolved(str(wrong)) from None

    def children(self, shape: Shape, element: etree._Element, values: dict[str, Any]) -> None:
        """Child elements into their fields."""
        found: dict[str, list[Any]] = {}
        descriptions: list[Description] = []
        self.no_text(element)
        for child in element:
            tag = self.tag(child)
            if tag == _DESCRIPTION and "descriptions" in shape.names:
                descriptions.append(self.description(child))
                continue
            spec = shape.by_tag.get(tag)
            if spec is None and tag.startswith(f"{{{CORE}}}"):
                spec = shape.by_local.get(local(tag))
            if spec is not None:
                found.setdefault(spec[0].field, []).append(self.node(spec[1], child))
            elif tag.startswith((f"{{{CORE}}}", f"{{{EXTENSIONS}}}")):
                raise _Fault(f"wanted {_listed(shape)}, got <{local(tag)}>", child)
            # Others' elements, such as <bmlt:parameter>, are for others.
        for kind in shape.children:
            nodes = found.get(kind.field, [])
            if len(nodes) < kind.least:
                raise _Fault(f"wanted {_listed(shape)}, got none", element)
            if kind.many:
                values[kind.field] = tuple(nodes)
            elif len(nodes) > 1:
                raise _Fault(f"wanted one <{local(kind.classes[0].tag)}>, got {len(nodes)}", element)
            elif nodes:
                values[kind.field] = nodes[0]
        if descriptions:
            values["descriptions"] = tuple(descriptions)

    def no_text(self, element: etree._Element) -> None:
        loose = element.text
        if not loose or loose.isspace():
            loose = next((c.tail for c in element if c.tail and not c.tail.isspace()), None)
        if loose and not loose.isspace():
            hint = ", put it into <text>" if self.tag(element) == Speech.tag else ""
            raise _Fault(f"wanted elements, got the text {shown(loose.strip())}{hint}", element)

    def mixed(self, shape: Shape, element: etree._Element) -> Iterator[Any]:
        """text := (characters | sync)*, blanks kept."""
        if element.text:
            yield element.text
        for child in element:
            spec = shape.by_tag.get(self.tag(child))
            if spec is None:
                raise _Fault(f"wanted text and {_listed(shape)}, got <{local(str(child.tag))}>", child)
            yield self.node(spec[1], child)
            if child.tail:
                yield child.tail

    def text(self, element: etree._Element) -> str:
        if len(element):
            raise _Fault(f"wanted text, got <{local(str(element[0].tag))}>", element[0])
        return element.text or ""

    # description := any XML

    def description(self, element: etree._Element) -> Description:
        values, faults = self.attributes(Description, shape_of(Description), element, False)
        if faults:
            raise _Fault("; ".join(faults), element)
        if values["type"] == _SSML:
            speak = [c for c in element if local(str(c.tag)) == "speak"]
            if len(speak) != 1:
                raise _Fault(f"wanted one <speak> for {_SSML}, got {len(speak) or 'none'}", element)
            return Description(**values, content=_canonical(speak[0]))
        inside = escape(element.text or "")
        for child in element:
            inside += _canonical(child) + escape(child.tail or "")
        return Description(**values, content=inside)

    # constraint := (synchronize | before | after)+

    def constraint(self, entry: _Entry) -> Constraint | None:
        """The node of an entry; None, and a Problem, if it is dropped."""
        element = entry.element
        assert self.names is not None
        place = Place(self.line(element), entry.path)
        try:
            values, faults = self.attributes(Constraint, shape_of(Constraint), element, False)
            if faults:
                raise _Fault("; ".join(faults), element)
            self.no_text(element)
            parts = tuple(self.constraint_part(child) for child in element)
            if not parts:
                raise _Fault("wanted <synchronize>, <before> or <after>, got none", element)
        except _Fault as fault:
            id = element.get("id", "").strip() or self.names.block
            self.problem(id, fault, entry.path, entry.required, element)
            return None
        return Constraint(**values, parts=parts, required=entry.required, place=place)

    def constraint_part(self, element: etree._Element) -> Synchronize | Before | After:
        tag = self.tag(element)
        if tag not in (Synchronize.tag, Before.tag, After.tag):
            got = local(tag)
            raise _Fault(f"wanted <synchronize>, <before> or <after>, got <{got}>", element)
        self.no_text(element)
        refs = tuple(self.sync(child) for child in element)
        if not refs:
            raise _Fault("wanted at least one <sync>, got none", element)
        if tag == Synchronize.tag:
            # Drafts name one of the points in an attribute.
            first = (self.ref(element),) if "ref" in element.attrib else ()
            return Synchronize(refs=first + refs)
        return (Before if tag == Before.tag else After)(ref=self.ref(element), refs=refs)

    def sync(self, element: etree._Element) -> SyncRef:
        if self.tag(element) != _SYNC:
            raise _Fault(f"wanted <sync>, got <{local(str(element.tag))}>", element)
        return self.ref(element)

    def ref(self, element: etree._Element) -> SyncRef:
        text = element.get("ref")
        if text is None:
            raise _Fault("ref: wanted a sync reference, got none", element)
        try:
            return self.reference(text)
        except _Unresolved as wrong:
            raise _Fault(f"ref: {wrong}", element) from None

    # What went, and what went with it

    def prune(self, nodes: dict[int, Behaviour | Constraint]) -> None:
        """Take references to dropped behaviours out of what is left, and tell of them in the Problems."""
        assert self.names is not None
        gone = self.names.points.keys() - self.places.keys()
        if not gone:
            return
        losses = Losses(gone)
        for n, node in list(nodes.items()):
            left = losses.without(node)
            if left is None:
                del nodes[n]
            else:
                nodes[n] = left
        for n, problem in enumerate(self.problems):
            id = problem.id.removeprefix(f"{self.names.block}:")
            lost = tuple(losses.lost.pop(id, ()))
            if lost:
                more = len(lost) - _MOST_LISTED
                named = ", ".join(lost[:_MOST_LISTED]) + (f" and {more} more" if more > 0 else "")
                self.problems[n] = replace(
                    problem,
                    text=f"{problem.text}; with it went {named}",
                    lost=lost,
                    fatal=problem.fatal or id in losses.fatal,
                )

    def problem(
        self,
        id: str,
        fault: _Fault,
        path: str,
        required: bool = False,
        element: etree._Element | None = None,
    ) -> None:
        where = path if element is None else _path_below(fault.element, element, path)
        line = self.line(fault.element)
        text = at(line, where, fault.text)
        self.problems.append(
            Problem(id=id, type=fault.type, text=text, line=line, path=where, fatal=required)
        )

    def line(self, element: etree._Element) -> int:
        return int(element.sourceline or 1) + self.lines_before

    def tag(self, element: etree._Element) -> str:
        """Clark tag; elements of drafts and without namespace count as core, faceFacs as extension."""
        raw = str(element.tag)
        known = self._tags.get(raw)
        if known is None:
            space, name = raw[1:].split("}") if raw.startswith("{") else ("", raw)
            known = core(name) if not space or space in _DRAFTS else raw
            if known == core(name) and known not in self.vocabulary and extension(name) in self.vocabulary:
                known = extension(name)
            self._tags[raw] = known
        return known


class _Unresolved(Exception):
    """A reference that is none or leads nowhere; its text is the whole sentence."""


def _grouped(
    tree: list[_Entry | list[_Entry]], nodes: Mapping[int, Behaviour | Constraint]
) -> tuple[Behaviour | Required | Constraint, ...]:
    """The nodes that are left, in the tree of their entries."""
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


def _listed(shape: Shape) -> str:
    """The children an element may have, in words."""
    tags = [f"<{local(c.tag)}>" for kind in shape.children for c in kind.classes] or ["<description>"]
    return ", ".join(tags[:-1]) + f" or {tags[-1]}" if len(tags) > 1 else tags[0]


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


def _canonical(element: etree._Element) -> str:
    """An element as text that does not depend on what stands around it."""
    return etree.tostring(element, method="c14n", exclusive=True, with_tail=False).decode()
