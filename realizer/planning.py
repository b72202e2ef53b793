"""Steps 2 to 4 for one block: its timings, the solved schedule, and the channels it expands to."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from bml_schema import Block, Place, Problem, SyncRef
from realizer.animation.channel import Channel
from realizer.behaviours.kind import Kind, World
from realizer.scheduling import schedule_block
from realizer.scheduling.timing import Schedule, Timing, Warning

__all__ = ["Plan", "plan"]


@dataclass(frozen=True)
class Plan:
    """A block's schedule, and behaviour id -> channels in seconds from block start."""

    schedule: Schedule
    channels: Mapping[str, tuple[Channel, ...]]


def plan(
    block: Block,
    kinds: Mapping[str, Kind],
    world: World,
    *,
    outside: Callable[[SyncRef], float | None] = lambda ref: None,
) -> Plan:
    """Schedule a block and expand it; what cannot be played is dropped with one warning each.

    Args:
        world: with the utterances of the block's speech behaviours.
        outside: sync points of other blocks -> seconds from this block's start, None where unknown.

    Returns:
        The plan; `schedule.failed` when something required cannot be played.
    """
    warnings = [_of_problem(p) for p in block.problems]
    fatal = [w for p, w in zip(block.problems, warnings, strict=True) if p.fatal]
    if fatal:
        return _failed(block, fatal[0])
    timings: dict[str, Timing] = {}
    for node in block.behaviours:
        name = f"{block.id}:{node.id}"
        kind = kinds.get(node.tag)
        if kind is None:
            warning = Warning(name, "BEHAVIOR_TYPE_NOT_SUPPORTED", f"<{node.tag}> is not known here")
            faults, dropped = [warning], True
        else:
            found = kind.check(node, world)
            where = block.places.get(node.id)
            faults = [Warning(name, fault.type, _at(where, fault.text)) for fault in found]
            dropped = any(fault.fatal for fault in found)
            if not dropped and kind.say is not None and node.id not in world.utterances:
                words = _at(where, "speech: no voice could say it")
                faults, dropped = [Warning(name, "CANNOT_CREATE_BEHAVIOR", words)], True
        if dropped and node.id in block.required:
            return _failed(block, Warning(block.id, faults[0].type, f"{faults[0].text} (required {node.id})"))
        warnings += faults[:1] if dropped else faults
        if not dropped and kind is not None:
            timings[node.id] = kind.timing(node, world)
    schedule = schedule_block(block, timings, outside=outside)
    warnings += [_placed(block, warning) for warning in schedule.warnings]
    schedule = replace(schedule, warnings=tuple(warnings))
    if schedule.failed:
        return Plan(schedule, {})
    channels = {
        node.id: kinds[node.tag].expand(node, schedule.times[node.id], world)
        for node in block.behaviours
        if node.id in schedule.times
    }
    return Plan(schedule, channels)


def _placed(block: Block, warning: Warning) -> Warning:
    """A warning of the scheduler with the place of the behaviour that it dropped."""
    place = block.places.get(warning.id.removeprefix(f"{block.id}:"))
    return replace(warning, text=_at(place, warning.text))


def _of_problem(problem: Problem) -> Warning:
    place = Place(problem.line, problem.path) if problem.line else None
    return Warning(problem.id, problem.type, _at(place, problem.text))


def _at(place: Place | None, text: str) -> str:
    return text if place is None else f"line {place.line}, {place.path}: {text}"


def _failed(block: Block, warning: Warning) -> Plan:
    return Plan(Schedule(block.id, {}, {}, warnings=(replace(warning, id=block.id),), failed=True), {})
