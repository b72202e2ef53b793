"""faceLexeme, faceFacs, face, faceShift, expression, blink: AU channels that rise, hold and relax."""

from collections.abc import Mapping
from typing import TypeAlias

import numpy as np

from bml_schema import Blink, BlinkEmitter, Expression, Face, FaceFacs, FaceLexeme, FaceShift
from bml_schema.behaviours import PEAK
from realizer import tables
from realizer.animation.axis import Target, au
from realizer.animation.channel import Channel
from realizer.behaviours import pose_channels
from realizer.behaviours.kind import BehaviourKind, Fault, PlanningContext, claiming, from_gaps, table_timing
from realizer.behaviours.pose_channels import express
from realizer.core.array_types import Float64
from realizer.scheduling.timing import Timing
from realizer.tables.lexemes import face_lexemes
from realizer.tables.timing import gaps

Part: TypeAlias = FaceLexeme | FaceFacs

# s; duration from an overshoot to the sustained value, at most half of the hold.
SETTLE = 0.25


def timing(node: FaceLexeme | Expression, context: PlanningContext) -> Timing:
    """Return the onset, apex and offset of the library; those of templates were measured."""
    name = node.lexeme if isinstance(node, FaceLexeme) else node.name
    return from_gaps(PEAK, context.library[name].gaps)


def expand_part(node: Part, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels: (1 + overshoot) amount at attackPeak, then amount to relax, or again and again."""
    known = face_lexemes().get(node.lexeme.upper()) if isinstance(node, FaceLexeme) else None
    if known is not None and known.repeats > 1:
        return _again_and_again(_targets(node, context), times, known.repeats, node.id)
    curves = {t: {node.overshoot: v} for t, v in _targets(node, context).items()}
    channels = _rise_and_fall(curves, times, node.id)
    return express(channels, context) if isinstance(node, FaceLexeme) else channels


def expand_face(node: Face, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels of all parts; of several values for one AU the highest is visible."""
    curves: dict[Target, dict[float, float]] = {}
    for part in node.parts:
        for target, value in _targets(part, context).items():
            # (1 + o)(1 + p) - 1: the overshoots of the compound and its parts multiply.
            overshoot = (1 + node.overshoot) * (1 + part.overshoot) - 1
            curve = curves.setdefault(target, {})
            curve[overshoot] = max(curve.get(overshoot, 0.0), value * node.amount)
    channels = _rise_and_fall(curves, times, node.id)
    is_expression = all(isinstance(part, FaceLexeme) for part in node.parts)
    return express(channels, context) if is_expression else channels


def expand_shift(node: FaceShift, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels that rise to the new base face and stay."""
    values: dict[Target, float] = {}
    for part in node.parts:
        for target, value in _targets(part, context).items():
            values[target] = max(values.get(target, 0.0), value * node.amount)
    return pose_channels.keep_base(values, times, node.id)


def _rise_and_fall(
    values_by_target: Mapping[Target, Mapping[float, float]], times: Float64, source: str
) -> tuple[Channel, ...]:
    """Return channels of target -> {overshoot: value}; times (4,) of start, attackPeak, relax, end."""
    start, peak, relax, end = times.tolist()
    settled = peak + min(SETTLE, (relax - peak) / 2)
    settling = np.array([start, peak, settled, relax, end])
    channels = []
    for target, values_by_overshoot in values_by_target.items():
        for overshoot, value in values_by_overshoot.items():
            highest = (1 + overshoot) * value
            if overshoot and settled > peak:
                keys, values = settling, np.array([0.0, highest, value, value, 0.0])
            else:
                keys, values = times, np.array([0.0, highest, value, 0.0])
            channels.append(Channel(target, keys, values, source=source))
    return tuple(channels)


def _again_and_again(
    values: Mapping[Target, float], times: Float64, count: int, source: str
) -> tuple[Channel, ...]:
    """Return channels that reach their values `count` times from attackPeak to relax, and are 0 between."""
    start, peak, relax, end = times.tolist()
    keys = np.array([start, *np.linspace(peak, relax, 2 * count - 1), end])
    heights = np.array([0.0, *([1.0, 0.0] * count)])
    return tuple(Channel(target, keys, value * heights, source=source) for target, value in values.items())


def _targets(node: Part, context: PlanningContext) -> dict[Target, float]:
    if isinstance(node, FaceFacs):
        return dict.fromkeys(au(node.au, node.side), node.amount)
    return pose_channels.columns(context.library[node.lexeme].aus, node.amount)


def check(node: Part | Face | FaceShift, context: PlanningContext) -> tuple[Fault, ...]:
    """Return faults: an unknown lexeme or AU is fatal; a side of an AU without sides is not."""
    faults = []
    known = tables.by_number()
    for part in node.parts if isinstance(node, Face | FaceShift) else (node,):
        if isinstance(part, FaceLexeme):
            if part.lexeme not in context.library:
                faults.append(pose_channels.unknown_word("lexeme", part.lexeme, context.library))
        elif part.au not in known:
            text = f"au: wanted a FACS action unit, got {part.au}; near: {tables.nearest(part.au)}"
            faults.append(Fault("CANNOT_CREATE_BEHAVIOR", text))
        elif part.side != "BOTH" and not known[part.au].sides:
            name = f"AU{part.au} ({known[part.au].name})"
            faults.append(
                Fault(
                    "CUSTOM_ATTRIBUTE_NOT_SUPPORTED",
                    f"side: wanted BOTH, as {name} has no sides, got {part.side}; shown on both",
                    fatal=False,
                )
            )
    return tuple(faults)


def expand_expression(node: Expression, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    values = pose_channels.columns(context.library[node.name].aus, node.intensity)
    return express(pose_channels.hold(values, times, node.id), context)


def check_expression(node: Expression, context: PlanningContext) -> tuple[Fault, ...]:
    known = context.library
    return () if node.name in known else (pose_channels.unknown_word("name", node.name, known),)


def expand_blink(node: Blink, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels of AU45, closed from attackPeak to relax."""
    return pose_channels.hold(pose_channels.columns({(45, node.side): 1.0}, node.amount), times, node.id)


def expand_emitter(node: BlinkEmitter, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return the channels of blinks from start to end; equal seeds give equal blinks."""
    begin, end = times.tolist()
    row = gaps("blink")
    shape = np.cumsum([0.0, *(gap.preferred for gap in row.gaps)])
    chance = np.random.default_rng([context.seed, *node.id.encode()])
    channels: list[Channel] = []
    at = begin
    while True:
        at += max(node.avg_waiting_time + node.range * chance.uniform(-1, 1), float(shape[-1]))
        if at + shape[-1] > end:
            return tuple(channels)
        channels += pose_channels.hold(pose_channels.columns({(45, "BOTH"): 1.0}, 1.0), at + shape, node.id)


AMOUNT = {"amount": "amount"}
KINDS = (
    BehaviourKind(FaceLexeme, timing, expand_part, check, parameters=AMOUNT),
    BehaviourKind(FaceFacs, table_timing("faceFacs"), expand_part, check, parameters=AMOUNT),
    BehaviourKind(Face, table_timing("face"), expand_face, check, parameters=AMOUNT),
    BehaviourKind(
        FaceShift, table_timing("faceShift"), expand_shift, check, claims=claiming("base face"), region="face"
    ),
    BehaviourKind(
        Expression,
        timing,
        expand_expression,
        check_expression,
        parameters={"intensity": "intensity", "amount": "intensity"},
    ),
    BehaviourKind(Blink, table_timing("blink"), expand_blink, parameters=AMOUNT),
    BehaviourKind(BlinkEmitter, table_timing("blinkemitter"), expand_emitter),
)
