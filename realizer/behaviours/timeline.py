"""timeline: a designer's file of the media folder -> a channel for each action unit of each of its tracks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bml_schema import Timeline as Node
from realizer.animation.channel import Channel
from realizer.animation.targets import Target
from realizer.arrays import Float64
from realizer.behaviours import media, poses
from realizer.behaviours.kind import Fault, Kind, World
from realizer.expressions import Timeline, faults_of, lasts, read_timeline, spans
from realizer.expressions.timeline import Track
from realizer.scheduling.timing import Timing

__all__ = ["KINDS"]

# 1/s^2; it bends like an expression, as far as what it is tied to asks.
STIFFNESS = 4.0


def timing(node: Node, world: World) -> Timing:
    """As long as its longest channel; it stretches as a whole."""
    length = lasts(_timeline(node, world), world.library)
    return Timing(("start", "end"), np.array([length]), np.array([0.04]), np.array([STIFFNESS]))


def expand(node: Node, times: Float64, world: World) -> tuple[Channel, ...]:
    """Its tracks side by side; where two show one action unit the stronger one shows."""
    timeline = _timeline(node, world)
    start, end = float(times[0]), float(times[-1])
    scale = (end - start) / lasts(timeline, world.library)
    return tuple(
        channel for track in timeline.tracks for channel in _channels(track, start, scale, node, world)
    )


def check(node: Node, world: World) -> tuple[Fault, ...]:
    """A file that cannot be read, and expressions that are not in the library, are fatal: all in one."""
    if faults := media.faults(node.file_name, world, read_timeline):
        return tuple(replace(fault, text=fault.text.replace("\n", "; ")) for fault in faults)
    if wrong := faults_of(_timeline(node, world), world.library):
        return (Fault("CANNOT_CREATE_BEHAVIOR", f"fileName: {node.file_name}: {'; '.join(wrong)}"),)
    return ()


def _timeline(node: Node, world: World) -> Timeline:
    return media.load(node.file_name, world, read_timeline)


def _channels(track: Track, start: float, scale: float, node: Node, world: World) -> list[Channel]:
    shown = spans(track, world.library)
    whole = [_pose(span.entry.expression, span.entry.intensity, world) for span in shown]
    keys = [start + shown[0].start * scale]
    for span in shown:
        keys += [start + span.reached * scale, start + span.left * scale]
    times = np.array([*keys, start + shown[-1].end * scale])
    # Two keys at one time are one: what is whole for an instant, or begins without an onset.
    kept = np.append(np.diff(times) > 1e-9, True)
    channels = []
    for target in sorted({target for pose in whole for target in pose}, key=lambda target: target.column):
        values = [0.0]
        for pose in whole:
            values += [pose.get(target, 0.0)] * 2
        channels.append(
            Channel(target, times[kept], np.array([*values, 0.0])[kept], curve=track.curve, source=node.id)
        )
    return channels


def _pose(name: str, intensity: float, world: World) -> dict[Target, float]:
    found = world.library.get(name)
    return {} if found is None else poses.columns(found.aus, intensity)


KINDS = (Kind(Node, timing, expand, check, parameters={"amount": 1.0}),)
