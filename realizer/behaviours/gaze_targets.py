"""Gaze targets: scenes, the angles to a target, and the AU channels of eyes and head."""

import math
import re
from collections.abc import Sequence
from functools import partial

import numpy as np

from bml_schema import Gaze, GazeShift, HeadDirectionShift
from realizer import tables
from realizer.animation.axis import au
from realizer.animation.channel import Channel, Layer
from realizer.behaviours.kind import Fault, PlanningContext, Position
from realizer.core.array_types import Float64
from realizer.core.json_reader import parse_json
from realizer.core.similar import similar

NUMBER = r"\s*([+-]?(?:\d+\.?\d*|\.\d+))\s*"
POINT = re.compile(",".join([NUMBER] * 3))
_SEPARATORS = re.compile(r"[\s_-]")
# Degrees of yaw, positive to the left, and of pitch, positive up.
Turn = tuple[float, float]
# Part -> the AUs for (yaw to the left, to the right), (pitch up, down).
TURNS = {"eyes": ((61, 62), (63, 64)), "head": ((51, 52), (53, 54))}


facts = partial(tables.toml_table, "gaze.toml")


def limits(part: str) -> Turn:
    return facts()[part]["yaw"], facts()[part]["pitch"]


def limited(turn: Turn, maximum: Turn) -> Turn:
    (yaw, pitch), (max_yaw, max_pitch) = turn, maximum
    return max(-max_yaw, min(max_yaw, yaw)), max(-max_pitch, min(max_pitch, pitch))


def known_direction(target: str) -> Turn | None:
    """Return yaw and pitch of a target that needs no scene: LEFT, UPLEFT, CAMERA ..., or None."""
    found: Sequence[float] | None = facts()["targets"].get(_SEPARATORS.sub("", target).upper())
    return None if found is None else (found[0], found[1])


def position(target: str, context: PlanningContext) -> Position | None:
    """Return the position of a target, "x,y,z" or a name of the scene in any case, in metres; or None."""
    if match := POINT.fullmatch(target):
        x, y, z = (float(number) for number in match.groups())
        return x, y, z
    if context.scene is None:
        return None
    if target in context.scene:
        return context.scene[target]
    return next((place for name, place in context.scene.items() if name.lower() == target.lower()), None)


def angles(target: str, context: PlanningContext) -> tuple[float, float, float]:
    """Return yaw (positive to the left), pitch (positive up) and inward turn of each eye, degrees.

    Unknown targets, and targets between the eyes, are straight ahead. Directions are infinitely far away.
    """
    place = position(target, context)
    if place is None and (direction := known_direction(target)) is not None:
        return *direction, 0.0
    x, y, z = place or (0.0, 0.0, 0.0)
    distance = math.sqrt(x * x + y * y + z * z)
    if distance < 1e-6:
        return 0.0, 0.0, 0.0
    yaw = math.degrees(math.atan2(x, z)) if x or z else 0.0
    pitch = math.degrees(math.asin(max(-1.0, min(1.0, y / distance))))
    inward = math.degrees(math.atan2(facts()["eyes"]["apart"] / 2, distance))
    return yaw, pitch, inward


def is_known(target: str, context: PlanningContext) -> bool:
    return position(target, context) is not None or known_direction(target) is not None


def check_target(node: Gaze | GazeShift | HeadDirectionShift, context: PlanningContext) -> tuple[Fault, ...]:
    """Return a NO_SUCH_TARGET fault, which is not fatal, for a name that a declared scene does not have."""
    if context.scene is None or is_known(node.target, context):
        return ()
    target = node.target
    near = similar(target, context.scene) or sorted(context.scene)[:5]
    wanted = f"one of {', '.join(near)}" if near else 'a point such as "0,0,1", as the scene is empty'
    return (
        Fault(
            "NO_SUCH_TARGET", f"target: wanted {wanted}, got {target!r}; looks straight ahead", fatal=False
        ),
    )


def turn(
    part: str, times: Float64, turns: Sequence[Turn], *, layer: Layer, source: str, holds: bool = False
) -> tuple[Channel, ...]:
    """Return channels that turn "eyes" or "head" by k turns at times (k,).

    Each angle is the difference of two AUs, whose curves form one smooth curve between keys.
    """
    channels = []
    for degrees, sides in zip(zip(*turns, strict=True), TURNS[part], strict=True):
        for number, sign, largest in zip(sides, (1.0, -1.0), (max(degrees), -min(degrees)), strict=True):
            if largest > 0.0:
                full_angle = tables.by_number()[number].degrees
                values = np.array([max(0.0, sign * angle) / full_angle for angle in degrees])
                target = au(number)[0]
                channels.append(Channel(target, times, values, layer=layer, keeps_last=holds, source=source))
    return tuple(channels)


def parse_scene(text: str) -> dict[str, Position]:
    """Parse a scene: JSON `{"cup": [x, y, z], ...}` or lines `cup x y z`; metres, origin between the eyes.

    Raises:
        ValueError: with the entry and the expected value.
    """
    if text.lstrip().startswith("{"):
        try:
            entries = parse_json(text)
        except ValueError as error:
            raise ValueError(f"wanted JSON, got: {error}") from None
        items = [(str(k), [*v.values()] if isinstance(v, dict) else v) for k, v in entries.items()]
    else:
        lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
        items = [(parts[0], parts[1:]) for parts in (re.split(r"[\s,]+", line.strip()) for line in lines)]
    scene: dict[str, Position] = {}
    for name, numbers in items:
        try:
            x, y, z = (float(v) for v in numbers)
        except (TypeError, ValueError, OverflowError):
            raise ValueError(f"{name}: wanted three numbers x y z in metres, got {numbers!r:.80}") from None
        if not all(abs(v) <= 1e4 for v in (x, y, z)):
            raise ValueError(f"{name}: wanted metres within 10 km, got {x:g} {y:g} {z:g}")
        scene[name] = (x, y, z)
    return scene
