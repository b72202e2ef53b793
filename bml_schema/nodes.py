"""The base nodes of documents: block, required, constraint, description, behaviour."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import ClassVar

from bml_schema.errors import Place, Problem
from bml_schema.node_schema import attribute, node, sync_ref
from bml_schema.sync_refs import SyncRef
from bml_schema.values import block_name, block_names, flag, integer, name, number, one_of, word

__all__ = [
    "BMLA",
    "BMLT",
    "CORE",
    "EXTENSIONS",
    "OWN",
    "After",
    "Before",
    "Behaviour",
    "Block",
    "Constraint",
    "Description",
    "Part",
    "Required",
    "Synchronize",
]

CORE = "http://www.bml-initiative.org/bml/bml-1.0"
EXTENSIONS = "http://www.bml-initiative.org/bml/coreextensions-1.0"
BMLA = "http://www.asap-project.org/bmla"
BMLT = "http://hmi.ewi.utwente.nl/bmlt"
OWN = "urn:bml-realizer:1"  # what we add to BML ourselves
COMPOSITIONS = ("MERGE", "APPEND", "REPLACE")


def core(name: str) -> str:
    """Clark tag of an element of the BML 1.0 core namespace."""
    return f"{{{CORE}}}{name}"


def extension(name: str) -> str:
    """Clark tag of an element of the BML 1.0 core extensions namespace."""
    return f"{{{EXTENSIONS}}}{name}"


def bmla(name: str) -> str:
    """Clark name in the namespace of BMLA, the extensions of AsapRealizer."""
    return f"{{{BMLA}}}{name}"


def bmlt(name: str) -> str:
    """Clark name in the namespace of BMLT, the extensions of Elckerlyc."""
    return f"{{{BMLT}}}{name}"


def own(name: str) -> str:
    """Clark name in our own namespace."""
    return f"{{{OWN}}}{name}"


@node
class Part:
    """Base of elements inside a behaviour that have no timing of their own."""

    tag: ClassVar[str]


@node
class Description(Part):
    """A richer form of a behaviour, for realizers that know its type.

    Attributes:
        priority: the highest one whose type is known replaces the core form (priority 0).
        type: such as "application/ssml+xml".
        content: XML text of what is inside, in canonical form with its own namespace declarations; for
            application/ssml+xml exactly the <speak> element.
    """

    tag = core("description")

    priority: int = attribute(integer(-(2**31), 2**31 - 1))
    type: str = attribute(word)
    content: str = ""


@node
class Behaviour:
    """Base of everything that has sync points.

    Attributes:
        id: unique in the block; "" only for the parts of <face> and <faceShift>.
        syncs: sync point -> where the document wants it; only those the document gives.
        priority: bmla:priority; of two that want the same thing the lower one is dropped.
        descriptions: in document order.
        unknown_attributes: attributes this class does not know, by Clark name, kept for others and for the
            round trip.
        unknown_children: child elements of others, such as <bmlt:parameter>, kept likewise: each as XML text
            in canonical form, with its own namespace declarations.
    """

    tag: ClassVar[str]
    sync_points: ClassVar[tuple[str, ...]] = ("start", "end")
    # True: each <sync id> inside is a sync point too (speech).
    marks: ClassVar[bool] = False

    id: str = attribute(name)
    priority: float = attribute(number(-1e6, 1e6), default=0.0, name=bmla("priority"))
    syncs: Mapping[str, SyncRef] = field(default_factory=dict, hash=False)
    descriptions: tuple[Description, ...] = ()
    unknown_attributes: Mapping[str, str] = field(default_factory=dict, hash=False)
    unknown_children: tuple[str, ...] = ()

    def fault(self) -> str:
        """What is wrong with the whole of it, beyond single attributes; "" if it is sound."""
        return ""


@node
class Synchronize(Part):
    """All refs are equal in time; a plain number among them is a time from block start."""

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
    """What must hold between sync points of several behaviours.

    Attributes:
        id: None if the document gives none.
        parts: in document order.
        required: it stands inside <required>. Where it stands in the tree says so too: not part of ==.
        place: where it stands in the text; not part of ==.
    """

    tag = core("constraint")
    id: str | None = attribute(name, default=None)
    parts: tuple[Synchronize | Before | After, ...] = ()
    required: bool = field(default=False, compare=False)
    place: Place | None = field(default=None, compare=False)


@node
class Required(Part):
    """Behaviours and constraints without which the whole block goes."""

    tag = core("required")
    children: tuple[Behaviour | Constraint, ...] = ()


@node
class Block:
    """One <bml> element.

    Attributes:
        id: never empty, never "bml".
        character_id: who acts; None if the document does not say.
        composition: MERGE, APPEND or REPLACE, beside, after or instead of earlier blocks.
        append_after: BMLA: starts when all these blocks are done, beside what composition says.
            "APPEND-AFTER(a,b)" as composition means the same.
        chunk_after: BMLA: starts when all these blocks are subsiding (past every relax) or done.
        prepend_before, chunk_before: BMLA: these blocks, not started yet, append or chunk after this one.
        interrupt: BMLA: these blocks are interrupted when this one is scheduled.
        on_start: BMLA: these preplanned blocks are activated when this one starts.
        preplan: BMLA: planned, but not started before somebody activates it.
        children: in document order.
        unknown_attributes: attributes this version does not know, by Clark name.
        problems: what was dropped while parsing; not part of ==.
        places: behaviour or constraint id -> line and path; not part of ==.
        behaviours: all, in document order, those inside <required> too.
        constraints: all, in document order, those inside <required> too.
        required: ids of the behaviours inside <required>.
    """

    tag: ClassVar[str] = core("bml")

    id: str = attribute(block_name)
    character_id: str | None = attribute(word, default=None)
    composition: str = attribute(one_of(*COMPOSITIONS, any_case=True), default="MERGE")
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
        # The first of two with the same id counts, as in documents.
        put(self, "_by_id", {b.id: b for b in behaviours[::-1]})

    def __getitem__(self, id: str) -> Behaviour:
        """The behaviour with this id; KeyError if there is none."""
        return self._by_id[id]
