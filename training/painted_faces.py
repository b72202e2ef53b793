"""Pictures of our own heads in random expressions, poses and lights, whose truth is known."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import radians

import numpy as np

from realizer.animation.axis import au, axis, fap
from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames
from realizer.animation.pose import poses
from realizer.core.units import ANGLE_UNIT
from realizer.face.deform import rotations
from realizer.face.fap_mapping import mapping_of
from realizer.face.load import MODEL, folder_of, load_face
from realizer.face.model import Face
from realizer.render.cameras import Camera, Framing, camera_for
from realizer.render.light import Light, presets
from realizer.render.raster import SoftwareCanvas
from realizer.render.worker import shapes
from realizer.tables.cooccurrence import rules
from realizer_studio.tracking.network import Region
from realizer_studio.tracking.regressor import UNITS

# Units that are often seen together (of emotions and of speech), beside random ones.
TOGETHER = (
    (6, 12), (6, 12, 25), (6, 12, 25, 26), (1, 4, 15), (1, 4), (1, 2), (1, 2, 5), (1, 2, 5, 26), (4, 5, 7),
    (4, 5, 7, 23), (4, 7, 24), (9, 10), (9, 17), (4, 9, 10), (1, 2, 4, 5, 20), (20, 25), (12, 14), (15, 17),
    (10, 25), (10, 16, 25), (18, 22), (22, 25), (25, 26), (17, 24), (4, 43), (6, 43), (7, 43), (10, 12),
    (12, 25), (16, 25), (4, 7), (6, 7, 12), (18, 25), (20, 25, 26), (5, 26), (5, 27), (43,), (2,), (26,),
    (28,), (4, 15, 17), (1, 15, 17), (9, 10, 25), (4, 6, 7, 9, 10), (23, 24), (5, 7, 23, 24), (12,), (17,),
    (5,), (7,),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Painted:
    """A picture with what it shows.

    Attributes:
        picture: (n, n, 3).
        aus: as the face shows them; columns as `AU_NAMES`.
        faps: (68,), with the rotations of the head.
        neutral: whether nothing but the pose of the head and the gaze moves.
        region: where the face is.
    """

    picture: np.ndarray
    aus: np.ndarray
    faps: np.ndarray
    neutral: bool
    region: Region


def warped(face: Face, random: np.random.Generator) -> np.ndarray:
    """Return offsets (n, 3) in metres that make the head another person's."""
    at = face.vertices.astype(np.float64)
    moved = at * random.normal(0, (0.03, 0.03, 0.03))
    for _ in range(5):
        wave = random.normal(0, 1, 3)
        wave *= random.uniform(25, 60) / np.linalg.norm(wave)
        wave[0] = 0.0 if random.random() < 0.3 else wave[0]
        push = random.normal(0, 0.0011, 3)
        phase = at @ wave + random.uniform(0, 6.28)
        mirror = (at * (-1, 1, 1)) @ wave + (phase - at @ wave)
        moved += 0.5 * (np.sin(phase)[:, None] * push + np.sin(mirror)[:, None] * push * (-1, 1, 1))
    return moved.astype(np.float32)


def expression(random: np.random.Generator) -> dict[tuple[int, str], float]:
    """Return random units with their sides."""
    draw = random.random()
    if draw < 0.25:
        chosen = [int(random.choice(UNITS))]
    elif draw < 0.8:
        chosen = list(TOGETHER[random.integers(len(TOGETHER))])
        if random.random() < 0.3:
            chosen.append(int(random.choice(UNITS)))
    else:
        chosen = [int(n) for n in random.choice(UNITS, random.integers(2, 5), replace=False)]
    found = {}
    for number in chosen:
        strength = random.uniform(0.2, 1.0)
        way = random.random()
        for side in ("LEFT", "RIGHT"):
            lone = number != 43 and ((way < 0.1 and side == "LEFT") or (0.1 <= way < 0.2 and side == "RIGHT"))
            value = strength * (1.0 if way > 0.5 else random.uniform(0.8, 1.0))
            if not lone:
                found[number, side] = value
    if found.get((12, "LEFT"), 0.0) > 0.5 and random.random() < 0.85:  # a broad smile raises the cheeks
        found |= {(6, side): found[12, "LEFT"] * random.uniform(0.6, 1.0) for side in ("LEFT", "RIGHT")}
    return found


def sitting(name: str, random: np.random.Generator, count: int, size: int = 256) -> Iterator[Painted]:
    """Yield pictures of one person in one light; the first is neutral, and seen from the front."""
    has_model = (folder_of(name) / MODEL).exists()
    face = load_face(name, deformer="au" if has_model and random.random() < 0.35 else "mpeg4")
    offsets = warped(face, random)
    mapping = mapping_of(name)
    light = list(presets().values())[random.integers(len(presets()))]
    rows = np.zeros((count, len(axis())), np.float32)
    neutral = np.arange(count) % 8 == 0
    for k, row in enumerate(rows):
        loose = 0.3 if k == 0 else 1.0
        angles = random.normal(0, (6, 9, 5)) * loose * (2 if random.random() < 0.25 else 1)
        for number, degrees in zip((48, 49, 50), angles, strict=True):
            row[fap(number).column] = radians(float(np.clip(degrees, -40, 40))) / ANGLE_UNIT
        if k and random.random() < 0.6:
            turn, rise = random.normal(0, 14), random.normal(0, 7)
            for numbers, degrees in (((23, 24), turn), ((25, 26), rise)):
                for number in numbers:
                    row[fap(number).column] = radians(degrees) / ANGLE_UNIT
        if neutral[k]:
            continue
        for (number, side), value in expression(random).items():
            for target in au(number, side):
                row[target.column] = value
        if random.random() < 0.2:  # speech
            row[axis()["open_jaw"].column] += random.uniform(0, 500)
            row[fap(4).column] -= random.uniform(0, 150)
            row[fap(5).column] -= random.uniform(0, 150)
            stretch = random.uniform(-120, 100)
            row[[fap(6).column, fap(7).column]] += stretch
    frames = AUFrames(np.arange(count, dtype=float), rows, rules())
    faps = to_fap(frames, mapping).values
    inputs = poses(frames, face.inputs, mapping)
    camera = _camera(face, random)
    canvas = SoftwareCanvas(face, (size, size), camera, _tinted(light, random), None)
    try:
        turns = rotations(*(inputs[:, 47:50].T * np.float32(ANGLE_UNIT)))
        gain, noise = random.uniform(0.75, 1.25), random.uniform(0, 6)
        for k, (vertices, normals) in enumerate(shapes(face, inputs)):
            placed = vertices + offsets @ turns[k].T
            picture = canvas.draw(placed, normals).astype(np.float32) * gain
            picture += random.normal(0, noise, picture.shape)
            inner = [face.feature_points[p] for p in ("3.12", "3.11", "2.1", "9.3")]
            at, _ = camera.project(placed[inner], (size, size))
            region = Region.around(at, at[0], at[1], 1.5 * 1.25)
            pixels = np.clip(picture, 0, 255).astype(np.uint8)
            yield Painted(pixels, frames.aus[k], faps[k], bool(neutral[k]), region)
    finally:
        canvas.close()


def _camera(face: Face, random: np.random.Generator) -> Camera:
    framing = Framing(hairline=0.17, chin=0.80, distance=float(random.uniform(0.55, 1.8)))
    named = replace(
        face, cameras={"random": {k: getattr(framing, k) for k in ("yaw", "hairline", "chin", "distance")}}
    )
    camera = camera_for(named, "random")
    rise = np.array([0.0, float(random.normal(0, 0.04)) * framing.distance, 0.0])
    return replace(camera, position=camera.position + rise, target=camera.target + rise)


def _tinted(light: Light, random: np.random.Generator) -> Light:
    turn = random.uniform(-0.9, 0.9)
    x, y, z = light.key.direction
    way = (x * np.cos(turn) + z * np.sin(turn), y, z * np.cos(turn) - x * np.sin(turn))
    return replace(
        light,
        key=replace(light.key, direction=tuple(map(float, way))),
        exposure=light.exposure * float(random.uniform(0.6, 1.4)),
    )
