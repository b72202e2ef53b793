"""The base nodes of documents: block, required, constraint, description, behaviour."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import ClassVar

from bml_schema.errors import Place, Problem
from bml_schema.node_schema import attribute, node, sync_ref
from bml_schema.sync_refs import SyncRef
from bml_schema.values import block_name, block_names, flag, integer, name, number, one_of, word

CORE = "http://www.bml-initiative.org/bml/bml-1.0"
# Documents from before the standard name no namespace, or the draft's.
DRAFTS = frozenset({"http://www.mindmakers.org/projects/BML"})
EXTENSIONS = "http://www.bml-initiative.org/bml/coreextensions-1.0"
BMLA = "http://www.asap-project.org/bmla"
BMLT = "http://hmi.ewi.utwente.nl/bmlt"
OWN = "urn:bml-realizer:1"  # the extensions of this project
# Usual prefix -> namespace.
NAMESPACES = {"bml": CORE, "ext": EXTENSIONS, "bmla": BMLA, "bmlt": BMLT, "realizer": OWN}
XML = "http://www.w3.org/XML/1998/namespace"
LANGUAGE = f"{{{XML}}}lang"
SSML = "application/ssml+xml"  # type of descriptions
# Type of descriptions with the times of a recorded speech: <realizer:recorded> with marks, words and visemes.
RECORDED = "application/x-recorded-speech"
COMPOSITIONS = ("MERGE", "APPEND", "REPLACE")


def _names_in(namespace: str) -> Callable[[str], str]:
    return lambda name: f"{{{namespace}}}{name}"


# Functions: local name -> Clark name.
core, extension, bmla, bmlt, own = map(_names_in, (CORE, EXTENSIONS, BMLA, BMLT, OWN))


@node
class Part:
    """The base of elements inside a behaviour without timing of their own."""

    tag: ClassVar[str]


@node
class Description(Part):
    """A richer form of a behaviour, for realizers that know its type.

    Attributes:
        priority: the highest one with a known type replaces the core form (priority 0).
        type: such as "application/ssml+xml".
        content: XML text of the content, in canonical form with its own namespace declarations; for
            application/ssml+xml exactly the <speak> element.
    """

    tag = core("description")

    priority: int = attribute(integer(-(2**31), 2**31 - 1), old="level")
    type: str = attribute(word)
    content: str = ""


@node
class Behaviour:
    """The base of all elements with sync points.

    Attributes:
        id: unique in the block; "" only for the parts of <face> and <faceShift>.
        syncs: sync point -> its reference in the document; only those that the document gives.
        priority: bmla:priority; in a conflict the behaviour of the lower priority is dropped.
        descriptions: in document order.
        unknown_attributes: attributes this class does not define, by Clark name, kept for the round trip.
        unknown_children: child elements of other namespaces, such as <bmlt:parameter>, kept as canonical XML
            with their own namespace declarations.
    """

    tag: ClassVar[str]
    sync_points: ClassVar[tuple[str, ...]] = ("start", "end")
    # Each <sync id> inside is a sync point too (speech).
    marks: ClassVar[bool] = False

    id: str = attribute(name)
    priority: float = attribute(number(-1e6, 1e6), default=0.0, name=bmla("priority"))
    syncs: Mapping[str, SyncRef] = field(default_factory=dict, hash=False)
    descriptions: tuple[Description, ...] = ()
    unknown_attributes: Mapping[str, str] = field(default_factory=dict, hash=False)
    unknown_children: tuple[str, ...] = ()

    @property
    def references(self) -> tuple[tuple[str, SyncRef], ...]:
        """(sync point, reference) of each sync point with a reference."""
        return tuple(self.syncs.items())

    def fault(self) -> str:
        """Return a fault of the behaviour as a whole, beyond single attributes, or ""."""
        return ""


@node
class Synchronize(Part):
    """All refs have the same time; a plain number among them is a time from block start."""

    tag = core("synchronize")
    refs: tuple[SyncRef, ...] = ()


@node
class Before(Part):
    """Each of refs is not later than ref."""

    tag = core("before")
    ref: SyncRef = attribute(sync_ref)
    refs: tuple[SyncRef, ...] = ()


@node
class After(Part):
    """Each of refs is not earlier than ref."""

    tag = core("after")
    ref: SyncRef = attribute(sync_ref)
    refs: tuple[SyncRef, ...] = ()


@node
class Constraint(Part):
    """Conditions on sync points of several behaviours.

    Attributes:
        id: None if the document gives none.
        parts: in document order.
        required: it is inside <required>; not part of ==, as the tree has this too.
        place: its position in the text; not part of ==.
    """

    tag = core("constraint")
    id: str | None = attribute(name, default=None)
    parts: tuple[Synchronize | Before | After, ...] = ()
    required: bool = field(default=False, compare=False)
    place: Place | None = field(default=None, compare=False)

    @property
    def references(self) -> tuple[SyncRef, ...]:
        """All references of its parts, in order."""
        return tuple(
            ref
            for part in self.parts
            for ref in (part.refs if isinstance(part, Synchronize) else (*part.refs, part.ref))
        )


@node
class Required(Part):
    """Behaviours and constraints without which the whole block is dropped."""

    tag = core("required")
    children: tuple[Behaviour | Constraint, ...] = ()


@node
class Block:
    """A block: one <bml> element, a set of behaviours that are scheduled together.

    Attributes:
        id: never empty, never "bml".
        character_id: the character, or None if the document does not name one.
        composition: MERGE, APPEND or REPLACE: beside, after or instead of earlier blocks.
        append_after: BMLA: starts when all these blocks are done, in addition to its composition.
            "APPEND-AFTER(a,b)" as composition means the same.
        chunk_after: BMLA: starts when all these blocks are subsiding (past every relax) or done.
        prepend_before, chunk_before: BMLA: these blocks, not started yet, append or chunk after this one.
        interrupt: BMLA: these blocks are interrupted when this one is scheduled.
        on_start: BMLA: these preplanned blocks are activated when this one starts.
        preplan: BMLA: it is planned, but starts only when it is activated.
        children: in document order.
        unknown_attributes: attributes this version does not define, by Clark name.
        problems: what was dropped while parsing; not part of ==.
        places: behaviour or constraint id -> line and path; not part of ==.
        behaviours: all, in document order, with those inside <required>.
        constraints: all, in document order, with those inside <required>.
        required: ids of the behaviours inside <required>.
    """

    tag: ClassVar[str] = core("bml")

    id: str = attribute(block_name)
    character_id: str | None = attribute(word, default=None)
    composition: str = attribute(one_of(*COMPOSITIONS), default="MERGE")
    append_after: tuple[str, ...] = attribute(block_names, default=(), name=bmla("appendAfter"))
    chunk_after: tuple[str, ...] = attribute(block_names, default=(), name=bmla("chunkAfter"))
    prepend_before: tuple[str, ...] = attribute(block_names, default=(), name=bmla("prependBefore"))
    chunk_before: tuple[str, ...] = attribute(block_names, default=(), name=bmla("chunkBefore"))
    interrupt: tuple[str, ...] = attribute(block_names, default=(), name=bmla("interrupt"))
    on_start: tuple[str, ...] = attribute(block_names, default=(), name=bmla("onStart"))
    preplan: bool = attribute(flag, default=False, name=bmla("preplan"))
    children: tuple[Behaviour | Required | Constraint, ...] = ()
    unknown_attributes: Mapping[str, str] = field(default_factory=dict, hash=False)
    problems: tuple[Problem, ...] = field(default=(), compare=False)
    places: Mapping[str, Place] = field(default_factory=dict, compare=False, repr=False)
    behaviours: tuple[Behaviour, ...] = field(init=False, compare=False, repr=False)
    constraints: tuple[Constraint, ...] = field(init=False, compare=False, repr=False)
    required: frozenset[str] = field(init=False, compare=False, repr=False)
    _by_id: Mapping[str, Behaviour] = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        flat: list[Behaviour | Constraint] = []
        required: list[str] = []
        for child in self.children:
            if isinstance(child, Required):
                flat += child.children
                required += [c.id for c in child.children if isinstance(c, Behaviour)]
            else:
                flat.append(child)
        behaviours = tuple([c for c in flat if isinstance(c, Behaviour)])
        put = object.__setattr__
        put(self, "behaviours", behaviours)
        put(self, "constraints", tuple([c for c in flat if isinstance(c, Constraint)]))
        put(self, "required", frozenset(required))
        # Of two behaviours with the same id the first counts, as in documents.
        put(self, "_by_id", {b.id: b for b in behaviours[::-1]})

    def __getitem__(self, id: str) -> Behaviour:
        """Return the behaviour with an id; raise KeyError if there is none."""
        return self._by_id[id]

    def with_children(
        self, change: Callable[[Behaviour | Constraint, bool], Behaviour | Constraint | None]
    ) -> Block:
        """Return the block with `change(child, is_required)` of each child; None drops it."""
        children: list[Behaviour | Required | Constraint] = []
        for child in self.children:
            if isinstance(child, Required):
                inside = (change(c, True) for c in child.children)
                children.append(replace(child, children=tuple(c for c in inside if c is not None)))
            elif (changed := change(child, False)) is not None:
                children.append(changed)
        return replace(self, children=tuple(children))
