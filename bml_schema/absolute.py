"""Conversion of a block to absolute times."""

from collections.abc import Mapping
from dataclasses import replace

from bml_schema.behaviours import Speech, Wait
from bml_schema.nodes import After, Before, Behaviour, Block, Constraint, Synchronize
from bml_schema.reading.dropped_references import without
from bml_schema.sync_refs import SyncRef
from bml_schema.values import MAX_SECONDS

_SAME = 1e-6  # s; rounding of solvers between times that should be equal


def with_absolute_times(block: Block, times: Mapping[str, Mapping[str, float]]) -> Block:
    """Return a copy of a block in which every sync point has its scheduled time.

    Scheduling the result again gives the same times. Sync points are written as attributes, and those of
    speech as the `ref` of their <sync>. Sync points without an attribute form ("stroke:n", the marks of a
    description) go into one <constraint> at the end. References to other blocks stay, and so do the
    constraints that the times satisfy; the others were dropped by the scheduler.

    Args:
        block: the block that was scheduled.
        times: behaviour id -> sync point -> seconds from block start. Behaviours that are missing were
            dropped, and are removed with all references to them.

    Raises:
        ValueError: a time is NaN or more than a day.
    """
    left = without(block, [b.id for b in block.behaviours if b.id not in times]).block
    fixed: list[Synchronize] = []

    def with_times(node: Behaviour | Constraint, required: bool) -> Behaviour | Constraint | None:
        if isinstance(node, Constraint):
            return node if all(_holds(part, times) for part in node.parts) else None
        return _timed(node, times[node.id], fixed)

    timed = left.with_children(with_times)
    # A block with absolute times already has them.
    known = {part for c in left.constraints for part in c.parts}
    if new := tuple(part for part in fixed if part not in known):
        timed = replace(timed, children=(*timed.children, Constraint(parts=new)))
    return replace(timed, problems=(), places={})


def _timed(node: Behaviour, times: Mapping[str, float], fixed: list[Synchronize]) -> Behaviour:
    """Return the behaviour with its times; add those that have no attribute to `fixed`."""
    at = {point: _number(f"{node.id}:{point}", time) for point, time in times.items()}
    syncs = {p: at.pop(p) for p in node.sync_points if p in at}
    if isinstance(node, Wait) and node.duration:
        node = replace(node, duration=max(times["end"] - times["start"], 0.0))
    if isinstance(node, Speech):
        node = node.with_references(lambda sync: at.pop(sync.id, None))
    for point, ref in at.items():
        sync, _, index = point.partition(":")
        named = SyncRef(behaviour=node.id, sync=sync, index=int(index) if index else None)
        fixed.append(Synchronize(refs=(named, ref)))
    return replace(node, syncs=syncs)


def _holds(part: Synchronize | Before | After, times: Mapping[str, Mapping[str, float]]) -> bool:
    """Return whether the times satisfy a constraint; unknown times satisfy any."""
    known = [time for ref in part.refs if (time := _time(ref, times)) is not None]
    if isinstance(part, Synchronize):
        return not known or max(known) - min(known) <= _SAME
    when = _time(part.ref, times)
    if when is None:
        return True
    return all(t <= when + _SAME if isinstance(part, Before) else t >= when - _SAME for t in known)


def _time(ref: SyncRef, times: Mapping[str, Mapping[str, float]]) -> float | None:
    """Return the seconds from block start of a reference, or None if the times do not have it."""
    if ref.block is not None:
        return None
    if ref.behaviour is None or ref.behaviour == "bml":
        return ref.offset
    time = times.get(ref.behaviour, {}).get(ref.point)
    return None if time is None else time + ref.offset


def _number(point: str, time: float) -> SyncRef:
    if not abs(time) <= MAX_SECONDS:
        raise ValueError(f"{point}: wanted at most {MAX_SECONDS:g} seconds, got {time}")
    return SyncRef(offset=float(time))
