"""Tests of the tongue's room: no pose brings it into teeth, palate or lips."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from realizer.animation.axis import axis
from realizer.animation.frames import AUFrames
from realizer.animation.lips.visemes import mouth_faps, shape_table
from realizer.animation.pose import poses
from realizer.core.array_types import Float32, Float64, Int32
from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.face.mesh_geometry import edges_of, part_triangles, triangle_normals
from realizer.face.model import Face
from realizer.face.mouth_room import rooms
from realizer.tables import action_units, faps
from tests.penetration import (
    DEEPEST,
    MouthParts,
    action_unit_poses,
    emotion_poses,
    fap_poses,
    viseme_poses,
)  # fmt: skip
from tests.shipped import FACES

USUAL = 512
OUT = 300  # of FAP 45, while another FAP moves the tongue that is out: 1.4 cm
OTHERS = {15: 200, 43: 250, 47: 60000}  # 1 cm of jaw, 12 mm of tongue to the side, 34 degrees of roll
OPEN = {3: 600, 4: -60, 5: -650, 8: -60, 9: -60, 10: -560, 11: -560, 52: -650, 57: -560, 58: -560}
LIPS = 0.022  # m around the lips' middle that the skin is looked at
NEAR = 0.002  # m; what goes deeper than that passes it on its way
SIDE = 0.7  # least cosine: a point beside an edge is not inside


def units() -> Iterator[Float32]:
    """Every action unit alone, with a dropped jaw and with a wide mouth."""
    columns = {name: target.column for name, target in axis().items()}
    for unit in action_units():
        for jaw in ((), ("25L", "25R", "25", "26"), ("25L", "25R", "25", "27")):
            row = np.zeros(len(axis()), np.float32)
            for name in (*(f"{unit.au}{side}" for side in ("", "L", "R")), *jaw):
                if name in columns:
                    row[columns[name]] = 1
            yield row


def fap_rows() -> Float32:
    """Visemes, and every FAP of jaw, lips and tongue both ways with a closed and an open mouth."""
    rows = []
    target = shape_table()[0]
    for fap, values in mouth_faps(target).items():
        rows = rows or [{} for _ in values]
        for row, value in zip(rows, values, strict=True):
            row[fap] = value
    for fap in faps()[2:]:
        if fap.group in (2, 6, 8):
            size = OTHERS.get(fap.fap, USUAL)
            for value in (np.clip(size, fap.least, fap.most), np.clip(-size, fap.least, fap.most)):
                rows += [{fap.fap: value}, OPEN | {fap.fap: value}]
                rows += [OPEN | {45: OUT, fap.fap: value}] if fap.group == 6 else []
    out = np.zeros((len(rows), 68), np.float32)
    for k, row in enumerate(rows):
        for number, value in row.items():
            out[k, number - 1] = value
    return out


def spread(at: Float64, triangles: Int32, steps: int) -> tuple[Float64, Float64]:
    """Points on triangles, and their normals."""
    i, j = np.meshgrid(np.arange(steps + 1), np.arange(steps + 1))
    u, v = i[i + j <= steps] / steps, j[i + j <= steps] / steps
    corners = at[triangles]
    share = np.stack([1 - u - v, u, v])
    normals = triangle_normals(at, triangles)
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]
    return np.einsum("tcx,cp->tpx", corners, share).reshape(-1, 3), np.repeat(normals, len(u), axis=0)


def inner(triangles: Int32) -> Int32:
    """The triangles that do not touch the rim of their surface: beyond it there is no inside."""
    pairs, count = edges_of(triangles)
    return triangles[~np.isin(triangles, pairs[count == 1]).any(axis=1)]


def surfaces(face: Face) -> tuple[Int32, list[Int32]]:
    """The triangles of the tongue, and those of teeth, palate and lips."""
    parts = {name: part_triangles(face.triangles, face.parts[name]) + face.parts[name][0]
             for name in ("tongue", "upper_teeth", "lower_teeth", "skin")}  # fmt: skip
    skin = face.vertices[parts["skin"]].mean(axis=1) - face.points["2.2"]
    parts["skin"] = parts["skin"][(np.linalg.norm(skin, axis=1) < LIPS) & (skin[:, 2] > -0.02)]
    return parts["tongue"], [inner(parts[name]) for name in ("upper_teeth", "lower_teeth", "skin")]


def deepest(shape: Float64, flesh: Int32, walls: list[Int32]) -> float:
    """The largest depth of a point of the tongue in teeth, palate or lips, metres."""
    tongue = spread(shape, flesh, 2)[0]
    low, high = tongue.min(axis=0) - 0.01, tongue.max(axis=0) + 0.01
    close = [w[((shape[w] > low) & (shape[w] < high)).all(axis=2).any(axis=1)] for w in walls]
    points, normals = (
        np.concatenate(arrays) for arrays in zip(*(spread(shape, w, 3) for w in close), strict=True)
    )
    away, nearest = cKDTree(points).query(tongue, distance_upper_bound=NEAR)
    near = np.isfinite(away)
    depth = np.einsum("pc,pc->p", points[nearest[near]] - tongue[near], normals[nearest[near]])
    return float(np.where(depth > SIDE * away[near], depth, 0).max(initial=0))


@pytest.mark.slow
@pytest.mark.parametrize("name", FACES)
def test_tongue_room_keeps_the_tongue_out_of_teeth_and_lips(name: str) -> None:
    face = load_face(name)
    rows = np.array(list(units()))
    aus = poses(AUFrames(np.arange(len(rows), dtype=np.float64), rows), face.inputs)
    shapes = deform(face, np.concatenate([aus, fap_rows()])).astype(np.float64)
    flesh, walls = surfaces(face)
    depths = np.array([deepest(shape, flesh, walls) for shape in shapes])
    assert depths.max() < DEEPEST, np.argsort(-depths)[:5]


@pytest.mark.slow
@pytest.mark.parametrize("name", FACES)
def test_tongue_room_keeps_the_drawn_tongue_out_of_walls_in_usual_poses(name: str) -> None:
    face = load_face(name)
    groups = action_unit_poses(face, 3), viseme_poses(), fap_poses(), emotion_poses(face)
    labels = [label for names, _ in groups for label in names]
    mouth = MouthParts(face)
    shapes = deform(face, np.concatenate([rows[:, :68] for _, rows in groups]))
    depth = np.array([mouth.tongue_in_walls(shape) for shape in shapes])
    assert depth.max() < DEEPEST, [(labels[k], 1000 * depth[k]) for k in np.flatnonzero(depth >= DEEPEST)]


BACK = 400.0  # FAPU that both lips go back: 7 mm
# m that a last molar is in the cheek when the jaw of a closed mouth goes aside by 7 mm.
KNOWN = {("omar", "FAP 15 +150"): 0.0018, ("omar", "FAP 15 -150"): 0.0018}


@pytest.fixture(scope="module")
def ada() -> Face:
    return load_face("ada")


def pushed_back(face: Face, jaw: float = 0) -> np.ndarray:
    row = np.zeros((1, 68), np.float32)
    row[0, [2, 15, 16]] = jaw, -BACK, -BACK
    return deform(face, row)[0]


@pytest.mark.parametrize("jaw", [0, 500])
def test_lip_room_moves_lips_out_of_the_teeth(ada: Face, jaw: float) -> None:
    mouth = MouthParts(ada)
    assert mouth.teeth_in_lips(pushed_back(ada, jaw)) < DEEPEST
    # A face that seems to have no teeth has no room.
    toothless = {name: ends for name, ends in ada.parts.items() if name != "lower_teeth"}
    assert mouth.teeth_in_lips(pushed_back(replace(ada, parts=toothless), jaw)) > 0.001


def test_rooms_keep_a_face_at_rest(ada: Face) -> None:
    out = ada.vertices[None].copy()
    for room in rooms(ada):
        room(out)
    assert np.array_equal(out[0], ada.vertices)


@pytest.mark.slow
@pytest.mark.parametrize("name", FACES)
def test_lip_room_keeps_teeth_out_of_lips_in_every_pose(name: str) -> None:
    face = load_face(name)
    names, rows = zip(
        *((names, rows[:, :68]) for names, rows in
          (action_unit_poses(face), viseme_poses(), fap_poses(), emotion_poses(face))),
        strict=True,
    )  # fmt: skip
    mouth = MouthParts(face)
    depth = np.array([mouth.teeth_in_lips(shape) for shape in deform(face, np.concatenate(rows))])
    labels = [label for group in names for label in group]
    print(name, *(f"{labels[k]} {1000 * depth[k]:.2f} mm" for k in np.argsort(-depth)[:6]), sep="; ")
    most = np.array([KNOWN.get((name, label), DEEPEST) for label in labels])
    assert (depth < most).all(), [(labels[k], 1000 * depth[k]) for k in np.flatnonzero(depth >= most)]
