"""Poses of a face in which parts of it could go through each other, and how deep parts of its mouth do."""

from __future__ import annotations

import numpy as np

from realizer import realize
from realizer.animation.axis import axis
from realizer.animation.frames import AUFrames
from realizer.animation.lips.visemes import mouth_faps, shape_table
from realizer.animation.pose import poses
from realizer.core.array_types import Float32, Float64, Int32
from realizer.face.drawn_mesh import drawn_mesh
from realizer.face.model import Face
from realizer.speech.silent import SilentVoice
from realizer.tables import action_units, faps
from realizer_studio.faces.hair.face_cards import depths, without_rim
from realizer_studio.faces.mpeg4.fap_limits import accompanying_faps, usual_range

__all__ = [
    "DEEPEST",
    "TEETH",
    "MouthParts",
    "action_unit_poses",
    "emotion_poses",
    "fap_poses",
    "part_of",
    "viseme_poses",
]

DEEPEST = 0.0003  # m
TEETH = "upper_teeth", "lower_teeth"
JAWS = (), ("25L", "25R", "25", "26"), ("25L", "25R", "25", "27")
EMOTIONS = "ANGER", "DISGUST", "FEAR", "HAPPINESS", "SADNESS", "SURPRISE"
SENTENCE = """<bml id="e"><faceLexeme id="f" lexeme="{}" start="0" attackPeak="0.3" end="s:end+0.5"/>
<speech id="s" start="0.2"><text>Five big fish swim above the shore, who knew that you would join.</text>
</speech></bml>"""
STEP = 4  # frames of a film from one that is looked at to the next
MOUTH = 0.050, 0.055  # m around the lips' middle that their skin is looked at, and behind it
NEAR = 0.003  # m; what goes deeper than that passes it on its way
ENAMEL = 0.62  # least share of blue to red in the colour of crowns, which are no gums


def action_unit_poses(face: Face, jaws: int = 2) -> tuple[list[str], Float32]:
    """Every action unit alone, with a dropped jaw, and (if `jaws` is 3) with a wide mouth."""
    columns = {name: target.column for name, target in axis().items()}
    names, rows = [], []
    for unit in action_units():
        for jaw in JAWS[:jaws]:
            row = np.zeros(len(axis()), np.float32)
            for name in (*(f"{unit.au}{side}" for side in ("", "L", "R")), *jaw):
                if name in columns:
                    row[columns[name]] = 1
            names.append("+".join([f"AU{unit.au}", *jaw[-1:]]))
            rows.append(row)
    return names, poses(AUFrames(np.arange(len(rows), dtype=np.float64), np.array(rows)), face.inputs)


def viseme_poses() -> tuple[list[str], Float32]:
    """Every viseme, and the sounds that have a shape of their own."""
    target = shape_table()[0]
    out = np.zeros((len(target), 68), np.float32)
    for fap, values in mouth_faps(target).items():
        out[:, fap - 1] = values
    return [f"viseme {k}" for k in range(len(out))], out


def fap_poses() -> tuple[list[str], Float32]:
    """Every FAP in its usual range, both ways: a jaw with the lips, which FAP 3 alone leaves closed, and the
    tongue in an open mouth."""
    names, rows = [], []
    for fap in faps()[2:]:
        for sign in (1, -1) if fap.least < 0 else (1,):
            row = np.zeros(68, np.float32)
            for number, value in ({} if fap.group != 6 and fap.fap != 3 else accompanying_faps(3, 1)).items():
                row[number - 1] = value if fap.fap == 3 else value / 2
            row[fap.fap - 1] = sign * usual_range(fap.fap, sign)
            names.append(f"FAP {fap.fap} {row[fap.fap - 1]:+.0f}")
            rows.append(row)
    return names, np.array(rows)


def emotion_poses(face: Face) -> tuple[list[str], Float32]:
    """Frames of the six emotions with speech."""
    names, rows = [], []
    for lexeme in EMOTIONS:
        played = realize(SENTENCE.format(lexeme), voice=SilentVoice(), face=face.name)
        rows.append(played.faps.values[::STEP])
        names += [f"{lexeme} frame {k * STEP}" for k in range(len(rows[-1]))]
    return names, np.concatenate(rows)


def part_of(face: Face, name: str) -> Int32:
    """The drawn triangles of a part, welded where its maps have seams, without those at its rim."""
    mesh = drawn_mesh(face)
    first, last = mesh.parts[name]
    mine = mesh.triangles[((mesh.triangles >= first) & (mesh.triangles < last)).all(axis=1)]
    rest = np.round(mesh.places @ face.vertices, 7)[first:last]
    _, known, inverse = np.unique(rest, axis=0, return_index=True, return_inverse=True)
    welded = first + known[inverse.ravel()][mine - first]
    whole = (welded != np.roll(welded, 1, axis=1)).all(axis=1)
    return without_rim(np.asarray(welded[whole], np.int32))


class MouthParts:
    """The surfaces of a mouth that is drawn."""

    def __init__(self, face: Face) -> None:
        self._mesh = drawn_mesh(face)
        self._walls = [part_of(face, name) for name in TEETH]
        skin, rest = part_of(face, "skin"), self._drawn(face.vertices)
        away = rest[skin].mean(axis=1) - face.points["2.2"]
        self._lips = skin[(np.linalg.norm(away, axis=1) < MOUTH[0]) & (away[:, 2] > -MOUTH[1])]
        self._crowns = np.concatenate([self._enamel(name) for name in TEETH])
        self._tongue = np.arange(*self._mesh.parts["tongue"])

    def teeth_in_lips(self, vertices: Float32) -> float:
        """Return how deep a crown is in lips or cheeks, metres, for the vertices of a face."""
        at = self._drawn(vertices)
        return float(depths(at[self._crowns], at, self._lips, NEAR)[0].max())

    def tongue_in_walls(self, vertices: Float32) -> float:
        """Return how deep the tongue is in teeth, gums, palate or lips, metres."""
        at = self._drawn(vertices)
        walls = (*self._walls, self._lips)
        return max(float(depths(at[self._tongue], at, wall, NEAR)[0].max()) for wall in walls)

    def _drawn(self, vertices: Float32) -> Float64:
        return np.asarray(self._mesh.places @ vertices, np.float64)

    def _enamel(self, name: str) -> Int32:
        mine = np.arange(*self._mesh.parts[name])
        red, _, blue = self._mesh.colours[mine].T.astype(float)
        return np.asarray(mine[blue > ENAMEL * red], np.int32)
