"""timeline: a timeline file of the media folder as channels of action units and mixing orders."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from bml_schema import Timeline as Node
from realizer.animation.axis import Target, fap, mask_channel, mixing_order
from realizer.animation.channel import Channel, Layer
from realizer.behaviours import media, pose_channels
from realizer.behaviours.kind import BehaviourKind, Fault, PlanningContext
from realizer.core.array_types import Float64
from realizer.expressions.timeline import Span, Timeline, Track, duration_of, faults_of, remarks, spans
from realizer.expressions.timeline_file import read_timeline
from realizer.scheduling.timing import Timing

# 1/s^2; as stiff as an expression.
STIFFNESS = 4.0
# s; duration of a change of the mixer, so that the face does not jump.
CHANGE = 0.2


def timing(node: Node, context: PlanningContext) -> Timing:
    """Return the duration of its longest channel; it can stretch as a whole."""
    length = duration_of(_timeline(node, context), context.library)
    return Timing(("start", "end"), np.array([length]), np.array([0.04]), np.array([STIFFNESS]))


def expand(node: Node, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels of all tracks.

    Of several values for one action unit the highest is visible; keyframes override all of them.
    """
    timeline = _timeline(node, context)
    start, end = float(times[0]), float(times[-1])
    scale = (end - start) / duration_of(timeline, context.library)
    channels = (
        channel for track in timeline.tracks for channel in _channels(track, start, scale, node, context)
    )
    return (*channels, *_mixing(timeline, start, end, node.id))


def check(node: Node, context: PlanningContext) -> tuple[Fault, ...]:
    """Return faults: an unreadable file and unknown expressions are fatal, all in one.

    Mixing that the face cannot do is not fatal.
    """
    if faults := media.faults(node.file_name, context, read_timeline):
        return tuple(replace(fault, text=fault.text.replace("\n", "; ")) for fault in faults)
    timeline = _timeline(node, context)
    if unknown := faults_of(timeline, context.library):
        return (Fault("CANNOT_CREATE_BEHAVIOR", f"fileName: {node.file_name!r}: {'; '.join(unknown)}"),)
    takes = context.face_inputs() if timeline.mixer == "successive" else None
    return tuple(
        Fault("CUSTOM_ATTRIBUTE_NOT_SUPPORTED", f"fileName: {node.file_name!r}: {remark}", fatal=False)
        for remark in remarks(timeline, takes)
    )


def _timeline(node: Node, context: PlanningContext) -> Timeline:
    return media.load(node.file_name, context, read_timeline)


def _channels(
    track: Track, start: float, scale: float, node: Node, context: PlanningContext
) -> list[Channel]:
    shown = spans(track, context.library)
    poses = [_pose(span.entry.expression, span.entry.intensity, context) for span in shown]
    keys = [start + shown[0].start * scale]
    for span in shown:
        keys += [start + span.reached * scale, start + span.left * scale]
    times = np.array([*keys, start + shown[-1].end * scale])
    # Two keys at one time become one: an apex without duration, or a missing onset.
    keep = np.append(np.diff(times) > 1e-9, True)
    channels = []
    for target in sorted({target for pose in poses for target in pose}, key=lambda target: target.column):
        values = [0.0]
        for pose in poses:
            values += [pose.get(target, 0.0)] * 2
        channels.append(
            Channel(target, times[keep], np.array([*values, 0.0])[keep], curve=track.curve, source=node.id)
        )
    for span in shown:
        channels += _keyframes(span, start, scale, node.id)
    return channels


def _keyframes(span: Span, start: float, scale: float, source: str) -> Iterator[Channel]:
    """Yield a channel for each FAP of keyframes, from the start of the entry to its end, and not eased."""
    if not span.entry.is_keyframes:
        return
    keys = np.array(span.entry.keys)
    times = start + (span.start + keys[:, 0] * ((span.end - span.start) / keys[-1, 0])) * scale
    weight = np.ones(len(keys))
    for number, values in zip(span.entry.faps, keys[:, 1:].T * span.entry.intensity, strict=True):
        yield Channel(
            fap(number), times, values, curve="linear", layer=Layer.FAPS, weight=weight, source=source
        )


def _mixing(timeline: Timeline, start: float, end: float, source: str) -> list[Channel]:
    """Return channels of the weight of the successive mixer, and of the rank of each unit in its order."""
    if timeline.mixer == "additive":
        return []
    change = min(CHANGE, (end - start) / 4)
    times = np.array([start, start + change, end - change, end])
    # Ranks are at most 0.5, so that those of two timelines at once add up to at most 1.
    ranks = np.linspace(0.5, 0.0, len(timeline.order), endpoint=False)
    targets = [(mask_channel("successive"), 1.0), *zip(map(mixing_order, timeline.order), ranks, strict=True)]
    return [
        Channel(target, times, np.array([0.0, value, value, 0.0]), source=source) for target, value in targets
    ]


def _pose(name: str, intensity: float, context: PlanningContext) -> dict[Target, float]:
    expression = context.library.get(name)
    return {} if expression is None else pose_channels.columns(expression.aus, intensity)


KINDS = (BehaviourKind(Node, timing, expand, check, parameters={"amount": 1.0}),)
