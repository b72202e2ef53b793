"""Helpers that read an element as a behaviour, and give its timing, faults and channels."""

from collections.abc import Sequence

import numpy as np

from bml_schema import Behaviour, parse
from realizer import tables
from realizer.animation.axis import axis
from realizer.animation.blend import blend
from realizer.animation.channel import Channel
from realizer.behaviours.kind import Fault, PlanningContext
from realizer.behaviours.registry import KINDS, VOCABULARY
from realizer.core.array_types import Float64
from realizer.scheduling.timing import Timing

EXT = 'xmlns:ext="http://www.bml-initiative.org/bml/coreextensions-1.0"'


NOWHERE = PlanningContext()


def node(element: str) -> Behaviour:
    return parse(f'<bml id="b" {EXT}>{element}</bml>', VOCABULARY).behaviours[0]


def timing(element: str, world: PlanningContext = NOWHERE) -> Timing:
    one = node(element)
    return KINDS[one.tag].timing(one, world)


def check(element: str, world: PlanningContext = NOWHERE) -> tuple[Fault, ...]:
    one = node(element)
    return KINDS[one.tag].check(one, world)


def keys(wanted: Timing) -> Float64:
    return np.concatenate([[0.0], np.cumsum(wanted.preferred)])


def expand(
    element: str, times: Sequence[float] | None = None, world: PlanningContext = NOWHERE
) -> tuple[Channel, ...]:
    one = node(element)
    kind = KINDS[one.tag]
    at = keys(kind.timing(one, world)) if times is None else np.array(times, np.float64)
    return kind.expand(one, at, world)


def at(channels: Sequence[Channel], name: str, *times: float) -> list[float]:
    frames = blend(channels, np.array(times))
    return [round(float(v), 5) for v in frames.values[:, axis()[name].column]]


def degrees(channels: Sequence[Channel], part: str, *times: float) -> list[tuple[float, float]]:
    """Return (yaw to the left, pitch up) of eyes or head."""
    left, right, up, down = {"eyes": ("61", "62", "63", "64"), "head": ("51", "52", "53", "54")}[part]
    most = [tables.by_number()[int(name)].degrees for name in (left, right, up, down)]
    values = {name: at(channels, name, *times) for name in (left, right, up, down)}
    return [
        (
            most[0] * values[left][k] - most[1] * values[right][k],
            most[2] * values[up][k] - most[3] * values[down][k],
        )
        for k in range(len(times))
    ]


LOOK = (0.0, 0.5, 1.5, 2.0)


SCENE = PlanningContext(scene={"cup": (0.5, 0.0, 1.0), "Door": (-2.0, 0.0, 1.0)})


def gaze(target: str, attributes: str = "", world: PlanningContext = NOWHERE) -> tuple[Channel, ...]:
    return expand(f'<gaze id="x" target="{target}" {attributes}/>', LOOK, world)


def total(channels: Sequence[Channel], *times: float) -> list[tuple[float, float]]:
    eyes, head = degrees(channels, "eyes", *times), degrees(channels, "head", *times)
    return [(a + c, b + d) for (a, b), (c, d) in zip(eyes, head, strict=True)]


ELEMENTS = [
    '<faceLexeme id="x" lexeme="SMILE"/>',
    '<ext:faceFacs id="x" au="4"/>',
    '<face id="x"><faceLexeme lexeme="RAISE_BROWS"/><ext:faceFacs au="26"/></face>',
    '<faceShift id="x"><faceLexeme lexeme="SMILE"/></faceShift>',
    '<gaze id="x" target="0.5,0.1,1"/>',
    '<gazeShift id="x" target="0.5,0.1,1" influence="HEAD"/>',
    '<head id="x" lexeme="NOD"/>',
    '<head id="x" lexeme="SHAKE" repetition="3"/>',
    '<headDirectionShift id="x" target="-1,0,1"/>',
    '<wait id="x" duration="2"/>',
    '<gesture id="x" lexeme="BEAT"/>',
    '<pointing id="x" target="cup"/>',
    '<posture id="x"><stance type="SITTING"/></posture>',
    '<postureShift id="x"><stance type="SITTING"/></postureShift>',
    '<locomotion id="x" target="door"/>',
]
