"""head, headDirectionShift: nods, shakes and tilts as strokes, and a new base direction."""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from bml_schema import Head, HeadDirectionShift
from realizer import tables
from realizer.animation.axis import au
from realizer.animation.channel import Channel, Layer
from realizer.behaviours.gaze_targets import angles, check_target, limited, limits, turn
from realizer.behaviours.kind import BehaviourKind, Fault, PlanningContext, claiming, from_gaps, table_timing
from realizer.behaviours.pose_channels import unknown_word
from realizer.core.array_types import Float64
from realizer.scheduling.timing import Timing
from realizer.tables.lexemes import head_lexemes
from realizer.tables.timing import Gap, gaps

# The plain `stroke` of several is the last one: the gap between the two never stretches.
SAME = Gap("same", 0.0, 0.0, 1e4, "BML 1.0 gives the plain stroke of a repeated movement no meaning; ours")


# The AU of the eyes that compensates a turn of the head: left by right, up by down.
BACK = {51: 62, 52: 61, 53: 64, 54: 63}


def timing(node: Head, context: PlanningContext) -> Timing:
    """Return the sync points of a lexeme.

    With repetition n > 1 these are start ready strokeStart stroke:1 .. stroke:n stroke strokeEnd relax end,
    and `stroke` is at the last numbered stroke.
    """
    return _timing(node.lexeme, node.repetition)


@lru_cache(maxsize=100)
def _timing(lexeme: str, repetition: int) -> Timing:
    row = gaps("head", lexeme)
    if repetition <= 1 or row.strokes is None:
        return from_gaps(row.points, row.gaps)
    at = row.points.index("stroke")
    numbered = tuple(f"stroke:{i}" for i in range(1, repetition + 1))
    between = (row.strokes,) * (repetition - 1)
    return from_gaps(
        (*row.points[:at], *numbered, *row.points[at:]), (*row.gaps[:at], *between, SAME, *row.gaps[at:])
    )


def expand(node: Head, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return the lexeme's poses at its sync points; half way between two strokes the head is back.

    The eyes turn against the head as far as the lexeme says, to stay on their target.
    """
    lexeme = head_lexemes()[node.lexeme.upper()]
    start, ready, stroke_start, *strokes, stroke_end, relax, end = times.tolist()
    if len(strokes) > 1:
        strokes = strokes[:-1]  # the last two are the same stroke
    keys = [start, ready, stroke_start]
    poses: list[tuple[Mapping[int, float], float]] = [({}, 1.0), (lexeme.ready, 1.0), (lexeme.ready, 1.0)]
    for i, stroke in enumerate(strokes):
        if i:
            keys.append((strokes[i - 1] + stroke) / 2)
            poses.append((lexeme.back, lexeme.decay ** (i - 1)))
        keys.append(stroke)
        poses.append((lexeme.stroke, lexeme.decay**i))
    last = lexeme.decay ** (len(strokes) - 1)
    keys += [stroke_end, relax, end]
    poses += [(lexeme.back, last), (lexeme.back, last), ({}, 1.0)]
    channels = []
    at = np.array(keys)
    for number in sorted(set().union(lexeme.ready, lexeme.stroke, lexeme.back)):
        turned = node.amount * np.array([pose.get(number, 0.0) * size for pose, size in poses])
        channels.append(_turned(number, at, turned, node.id))
        if lexeme.eyes and number in BACK:
            channels.append(_turned(BACK[number], at, turned * lexeme.eyes, node.id))
    return tuple(channels)


def _turned(number: int, keys: Float64, turned: Float64, source: str) -> Channel:
    values = turned / tables.by_number()[number].degrees
    return Channel(au(number)[0], keys, values, layer=Layer.HEAD, source=source)


def check(node: Head, context: PlanningContext) -> tuple[Fault, ...]:
    known = head_lexemes()
    return () if node.lexeme.upper() in known else (unknown_word("lexeme", node.lexeme, known),)


def expand_shift(node: HeadDirectionShift, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return channels that turn the head to the target up to its limit, and stay."""
    yaw, pitch, _ = angles(node.target, context)
    turns = [(0.0, 0.0), limited((yaw, pitch), limits("head"))]
    return turn("head", times, turns, layer=Layer.BASE, holds=True, source=node.id)


KINDS = (
    BehaviourKind(Head, timing, expand, check, parameters={"amount": "amount"}),
    BehaviourKind(
        HeadDirectionShift,
        table_timing("headDirectionShift"),
        expand_shift,
        check_target,
        claims=claiming("base head"),
        region="head",
    ),
)
