"""The poses of a face sheet, and their pictures."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from realizer.animation.axis import au_row, axis, fap
from realizer.animation.fap.conversion import FapMapping
from realizer.animation.frames import AUFrames
from realizer.animation.pose import poses as poses_of
from realizer.core.array_types import Float32, UInt8
from realizer.core.units import ANGLE_UNIT
from realizer.emotions.wheel import wheel
from realizer.expressions.expression import Expression
from realizer.face.fap_mapping import mapping_of
from realizer.face.load import input_names
from realizer.outputs.output import RenderSettings
from realizer.render.backdrop import backdrop
from realizer.render.contact_sheet import INK, PAPER, Cell, Group, sheet
from realizer.render.light import preset
from realizer.render.renderer import Renderer
from realizer.tables import Fap, by_number, faps, regions
from realizer.tables.emotions import emotion_faces, ring
from realizer_studio.study.drawing import MAX_DIFFERENCE, difference, faint, flatten, ramp

SCALE = (260, 16)  # pixels of the scale of colours
HALF, TURN = 512, 34907  # half of the unit distance (Paul 2010, 4.4.2), and 20 degrees for rotations
# Paul 2010, 6.4: the grid of his table of emotions.
ANGLES, ACTIVATIONS = np.arange(0, 360.1, 22.5), (1, 3, 5, 7)


@dataclass(frozen=True, eq=False)
class Pose:
    """One picture: a row of the animation axis, (n_targets,) float32, with its title and notes."""

    row: Float32
    title: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Series:
    """Poses under one heading; `columns` if they form a table."""

    heading: str
    poses: Sequence[Pose]
    columns: int | None = None


def frames(series: Sequence[Series]) -> AUFrames:
    """Return all poses of these series as frames, one per second."""
    rows = np.stack([pose.row for part in series for pose in part.poses])
    return AUFrames(np.arange(len(rows), dtype=np.float64), rows)


def neutral() -> Series:
    """Return the face at rest, with which all poses are compared."""
    return Series("", [Pose(_faps({}), "neutral")])


def of_faps(value: float) -> list[Series]:
    """Return each low-level FAP at +value and -value, within its range, by the groups of the standard."""
    rows = {row.fap: row for row in faps()}
    return [
        Series(
            f"FAPs: {region.name}",
            [pose for number in region.members for pose in _both_signs(rows[number], value)],
        )
        for region in regions("fap")
    ]


def _both_signs(row: Fap, value: float) -> list[Pose]:
    size = value * TURN / HALF if row.unit == "angle_unit" else value
    found = []
    for sign in (1, -1):
        amount = round(min(max(sign * size, row.least), row.most))
        if amount:
            if row.unit == "angle_unit":
                distance = f"{np.degrees(amount * ANGLE_UNIT):+.0f} degrees"
            else:
                distance = f"{amount / 1024:+.2f} {row.unit}0"
            # The names do not give the direction: some FAPs named "lower" or "depress" go up.
            title, note = f"{row.fap} {row.name} {amount:+d}", f"{distance}; + is {row.direction}"
            found.append(Pose(_faps({row.fap: amount}), title, (note,)))
    return found


def of_aus(intensity: float) -> list[Series]:
    """Return each action unit on both sides, by place and direction."""
    return [
        Series(
            f"Action units: {region.name}",
            [
                _pose(
                    {(number, "BOTH"): intensity}, f"AU{number} {unit.name}", unit.no_fap or f"{intensity:g}"
                )
                for number in region.members
                for unit in [by_number()[number]]
            ],
        )
        for region in regions("au")
    ]


def of_emotions() -> list[Series]:
    """Return the archetypes, and the wheel at 17 angles and 4 activations (Paul 2010, 6.4)."""
    poses = [
        _pose(face.aus, face.lexeme.lower(), f"{place.angle:g} degrees, activation {place.activation:g}")
        for place in ring("plutchik").values()
        if place.activation is not None
        for face in [emotion_faces()[place.name]]
    ]
    names = {place.angle: name for name, place in ring("paul").items()}
    grid = [
        Pose(
            _faps(dict(enumerate(wheel(angle, activation).frame(), 1))),
            f"{angle:g} degrees, activation {activation}",
            (names[angle % 360],),
        )
        for angle in ANGLES
        for activation in ACTIVATIONS
    ]
    return [
        Series("Emotions: archetypes", poses),
        Series("Emotions: the wheel, weak to strong", grid, len(ACTIVATIONS)),
    ]


def _pose(aus: Mapping[tuple[int, str], float], title: str, note: str) -> Pose:
    """Return a pose of action units, (AU, side) -> intensity."""
    return Pose(au_row(aus), title, (note,))


def _faps(values: Mapping[int, float]) -> Float32:
    row = np.zeros(len(axis()), np.float32)
    for number, value in values.items():
        row[fap(number).column] = value
    return row


def draw(
    series: Sequence[Series],
    face: tuple[str, str | None, FapMapping],
    cameras: Sequence[str],
    drawing: RenderSettings,
    step: Callable[[int], object],
) -> list[Group]:
    """Return the pictures of all poses, each with its difference to the first pose, which is neutral.

    Args:
        face: its name, deformer and mapping.
        step: called with 1 for each picture of a camera.
    """
    name, deformer, mapping = face
    # A plain background, so that only the face differs.
    behind = np.rint(np.array(preset(drawing.light).backdrop_middle) * 255)
    if drawing.background:
        behind = backdrop(drawing.size, preset(drawing.light), drawing.background)[..., :3]
    rows = poses_of(frames(series), input_names(name, deformer=deformer), mapping)
    pictures: list[list[Any]] = [[] for _ in rows]
    settings: dict[str, Any] = {"light": drawing.light, "background": "transparent", "deformer": deformer}
    for camera in cameras:
        neutral = below = None
        with Renderer(name, drawing.size, camera, **settings) as renderer:
            for k, drawn in enumerate(renderer.frames(rows)):
                picture = flatten(drawn, behind)
                if neutral is None or below is None:
                    neutral, below = picture, faint(drawn)
                pictures[k] += [picture, difference(picture, neutral, below)]
                step(1)
    left = iter(pictures)
    groups = []
    for part in series:
        cells = [Cell(next(left), pose.title, pose.notes) for pose in part.poses]
        groups.append(Group(part.heading, cells, part.columns))
    return groups


def scale() -> UInt8:
    """Return the scale of difference colours, (h, w, 3), with a label."""
    width, height = SCALE
    image = Image.new("RGB", (width, height * 2 + 8), PAPER)
    bar = np.broadcast_to(ramp(np.linspace(0, 1, width, dtype=np.float32)), (height, width, 3))
    image.paste(Image.fromarray(np.rint(bar).astype(np.uint8)), (0, 0))
    text = f"differs by 0 .. {MAX_DIFFERENCE:.0%} of white or more"
    ImageDraw.Draw(image).text((0, height + 4), text, INK, ImageFont.load_default(14))
    return np.asarray(image)


def draw_expressions(expressions: Sequence[Expression], notes: Sequence[str], face: str) -> UInt8:
    """Return a contact sheet of expressions at full intensity, each with its note."""
    series = Series("", [_pose(one.aus, one.name, one.units) for one in expressions])
    rows = poses_of(frames([series]), input_names(face), mapping_of(face))
    with Renderer(face, (220, 220), "close") as renderer:
        pictures = renderer.draw(rows)
    return sheet(list(pictures), [one.name for one in expressions], [(note,) for note in notes])
