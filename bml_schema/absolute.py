"""Rewriting of a block so that its sync points are absolute times."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from bml_schema.behaviours import Speech, SpeechText, Sync
from bml_schema.dropped_references import without
from bml_schema.nodes import After, Before, Behaviour, Block, Constraint, Required, Synchronize
from bml_schema.sync_refs import SyncRef
from bml_schema.values import MAX_SECONDS

__all__ = ["with_absolute_times"]

_SAME = 1e-6  # s; solvers leave this much between times that should be one


def with_absolute_times(block: Block, times: Mapping[str, Mapping[str, float]]) -> Block:
    """The block with every sync point at the time it has, such that scheduling it again gives the same times.

    Sync points become attributes, those of speech the `ref` of their <sync>. What has no attribute
    ("stroke:n", the marks of a description) stands in one <constraint> at the end. What the block says of
    other blocks stays, and so do the constraints that its times fulfil: the others were dropped.

    Args:
        block: as it was scheduled.
        times: behaviour id -> sync point -> seconds from block start; a behaviour that is not in it was
            dropped, and goes with all that named it.

    Raises:
        ValueError: a time no document can say: more than a day, or NaN.
    """
    left = without(block, [b.id for b in block.behaviours if b.id not in times]).block
    fixed: list[Synchronize] = []

    def kept(node: Behaviour | Constraint) -> Behaviour | Constraint | None:
        if isinstance(node, Constraint):
            return node if all(_holds(part, times) for part in node.parts) else None
        return _timed(node, times[node.id], fixed)

    children: list[Behaviour | Required | Constraint] = []
    for node in left.children:
        if isinstance(node, Required):
            inside = map(kept, node.children)
            children.append(replace(node, children=tuple(n for n in inside if n is not None)))
        elif (one := kept(node)) is not None:
            children.append(one)
    # A block that was timed before says them already.
    known = {part for c in left.constraints for part in c.parts}
    if new := tuple(part for part in fixed if part not in known):
        children.append(Constraint(parts=new))
    return replace(left, children=tuple(children), problems=(), places={})


def _timed(node: Behaviour, times: Mapping[str, float], fixed: list[Synchronize]) -> Behaviour:
    """The behaviour with its times; what has no attribute goes into `fixed`."""
    at = {point: _number(f"{node.id}:{point}", time) for point, time in times.items()}
    syncs = {p: at.pop(p) for p in node.sync_points if p in at}
    if isinstance(node, Speech) and node.text is not None:
        parts = tuple(
            replace(p, ref=at.pop(p.id, None)) if isinstance(p, Sync) else p for p in node.text.parts
        )
        node = replace(node, text=SpeechText(parts=parts))
    for point, ref in at.items():
        sync, _, index = point.partition(":")
        named = SyncRef(behaviour=node.id, sync=sync, index=int(index) if index else None)
        fixed.append(Synchronize(refs=(named, ref)))
    return replace(node, syncs=syncs)


def _holds(part: Synchronize | Before | After, times: Mapping[str, Mapping[str, float]]) -> bool:
    """Whether the times fulfil a constraint, as far as they tell."""
    told = [time for ref in part.refs if (time := _time(ref, times)) is not None]
    if isinstance(part, Synchronize):
        return not told or max(told) - min(told) <= _SAME
    when = _time(part.ref, times)
    if when is None:
        return True
    return all(t <= when + _SAME if isinstance(part, Before) else t >= when - _SAME for t in told)


def _time(ref: SyncRef, times: Mapping[str, Mapping[str, float]]) -> float | None:
    """Seconds from block start of a reference; None where the times do not tell."""
    if ref.block is not None:
        return None
    if ref.behaviour is None or ref.behaviour == "bml":
        return ref.offset
    point = ref.sync if ref.index is None else f"{ref.sync}:{ref.index}"
    time = times.get(ref.behaviour, {}).get(point or "")
    return None if time is None else time + ref.offset


def _number(point: str, time: float) -> SyncRef:
    if not abs(time) <= MAX_SECONDS:
        raise ValueError(f"{point}: wanted at most {MAX_SECONDS:g} seconds, got {time}")
    return SyncRef(offset=float(time))
