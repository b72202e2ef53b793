"""Links between the sync points of a block: their targets, causes and slack."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from bml_schema import After, Before, Block, Constraint, Synchronize, SyncRef
from realizer.scheduling.timing import Schedule

# An order with less room than this binds.
BINDS = 1e-6  # s
_MIRROR = {"before": "after", "after": "before"}


@dataclass(frozen=True)
class Link:
    """A sync point is at, not after, or not before another point and `offset` seconds.

    Attributes:
        sync: the point, of the behaviour that has the link.
        kind: attribute, text (a <sync> inside speech), synchronize, before or after.
        block, behaviour, other: the other point; behaviour None is the start of the block, and the offset a
            time. A block of None is the own one.
        slack: of before and after: seconds that the point could still move before this binds; None if it
            ties, or where the other point's time is not known.
        line, constraint, required: of what states it.
    """

    sync: str
    kind: str
    block: str | None
    behaviour: str | None
    other: str | None
    offset: float
    slack: float | None = None
    line: int | None = None
    constraint: str | None = None
    required: bool = False

    @property
    def binds(self) -> bool:
        """Whether an order keeps the point from moving."""
        return self.slack is not None and self.slack < BINDS

    @property
    def target(self) -> str | None:
        """The other point as documents name it, or None for the start of the block."""
        if self.behaviour is None:
            return None
        return ":".join(filter(None, (self.block, self.behaviour, self.other)))

    def to_json(self) -> dict[str, Any]:
        out: dict[str, Any] = {"sync": self.sync, "kind": self.kind, "to": self.target}
        out["offset"] = round(self.offset, 6)
        if self.kind in _MIRROR:
            out["slack"] = None if self.slack is None else round(self.slack, 6)
        if self.constraint is not None:
            out["constraint"] = self.constraint
        return out | {"line": self.line, "required": self.required}


def links_of(
    block: Block, schedule: Schedule, outside: Callable[[SyncRef], float | None]
) -> dict[str, list[Link]]:
    """Return behaviour id -> its links.

    Args:
        outside: a reference into another block, its offset included -> seconds from this block's start.
    """
    found = _Links(block, schedule, outside)
    for node in block.behaviours:
        for sync, ref in node.references:
            found.tie(node.id, sync, "attribute" if sync in node.syncs else "text", ref)
    for constraint in block.constraints:
        found.constrain(constraint)
    return found.links


class _Links:
    """The links of a block while they are collected."""

    def __init__(self, block: Block, schedule: Schedule, outside: Callable[[SyncRef], float | None]) -> None:
        self.block, self.schedule, self.outside = block, schedule, outside
        self.links: dict[str, list[Link]] = {}

    def tie(self, behaviour: str, sync: str, kind: str, ref: SyncRef) -> None:
        place = self.block.places.get(behaviour)
        required = behaviour in self.block.required
        line = place.line if place else None
        self.add(behaviour, Link(sync, kind, *self._other(ref), ref.offset, line=line, required=required))

    def constrain(self, constraint: Constraint) -> None:
        place = self.block.places.get(constraint.id) if constraint.id else constraint.place
        for kind, here, there in _pairs(constraint):
            if not self._is_own(here):
                if not self._is_own(there):
                    continue
                # A relation to a number or another block, from this block's point of view.
                kind, here, there = _MIRROR.get(kind, kind), there, here
            slack = None
            if kind in _MIRROR:
                first, last = (here, there) if kind == "before" else (there, here)
                begin, end = self._time(first), self._time(last)
                slack = None if begin is None or end is None else end - begin
            link = Link(
                here.point,
                kind,
                *self._other(there),
                there.offset - here.offset,
                slack,
                place.line if place else None,
                constraint.id,
                constraint.required,
            )
            self.add(here.behaviour or "", link)

    def add(self, behaviour: str, link: Link) -> None:
        points = self.schedule.points
        if link.sync not in points.get(behaviour, ()):
            return
        own = link.block is None and link.behaviour is not None
        if own and link.other not in points.get(link.behaviour or "", ()):
            return
        self.links.setdefault(behaviour, []).append(link)

    def _is_own(self, ref: SyncRef) -> bool:
        return ref.block in (None, self.block.id) and ref.behaviour not in (None, "bml")

    def _other(self, ref: SyncRef) -> tuple[str | None, str | None, str | None]:
        own = ref.block in (None, self.block.id)
        if ref.behaviour is None or (own and ref.behaviour == "bml"):
            return None, None, None
        return (None if own else ref.block), ref.behaviour, ref.point

    def _time(self, ref: SyncRef) -> float | None:
        """Return the seconds from block start, the offset included."""
        if ref.behaviour in (None, "bml") and ref.block in (None, self.block.id):
            return ref.offset
        try:
            if ref.block not in (None, self.block.id):
                return self.outside(ref)
            return self.schedule.at(ref.behaviour or "", ref.point) + ref.offset
        except LookupError:
            return None


def _pairs(constraint: Constraint) -> Iterator[tuple[str, SyncRef, SyncRef]]:
    """Yield (kind, constrained point, other point) of a constraint."""
    for part in constraint.parts:
        match part:
            case Synchronize():
                yield from (("synchronize", ref, part.refs[0]) for ref in part.refs[1:])
            case Before():
                yield from (("before", ref, part.ref) for ref in part.refs)
            case After():
                yield from (("after", ref, part.ref) for ref in part.refs)
