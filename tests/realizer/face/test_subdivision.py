"""`subdivided`: a face with round parts, whose vertices stay where they are."""

from dataclasses import replace

import numpy as np
import pytest

from realizer.face.load import load_face
from realizer.face.mesh_geometry import grid, triangle_normals
from realizer.face.subdivision import MOST, subdivided
from realizer.face.surface import normals
from realizer.render.worker import triangle


def face_of(vertices, triangles, parts):
    count = len(vertices)
    return replace(
        triangle(),
        vertices=np.asarray(vertices, np.float32),
        triangles=np.asarray(triangles, np.int32),
        colours=np.tile(np.arange(count, dtype=np.uint8)[:, None], 3),
        occlusion=np.ones(count, np.float32),
        gloss=np.zeros(count, np.float32),
        parts=parts,
        feature_points={"2.1": count - 1},
    )


def ball(rows=8, columns=12):
    """Return vertices and triangles of a closed ball of radius 1."""
    up = np.linspace(0.2, np.pi - 0.2, rows)[:, None]
    turn = np.arange(columns) * 2 * np.pi / columns
    sides = np.stack(
        [np.sin(up) * np.cos(turn), np.cos(up) + 0 * turn, np.sin(up) * np.sin(turn)], axis=2
    ).reshape(-1, 3)
    caps = []
    for pole, row, way in ((rows * columns, 0, 1), (rows * columns + 1, (rows - 1) * columns, -1)):
        for k in range(columns):
            caps.append((pole, *(row + np.array([k, (k + 1) % columns])[::way])))
    return np.vstack([sides, [[0, 1, 0], [0, -1, 0]]]), np.vstack([grid(rows, columns, closed=True), caps])[
        :, ::-1
    ]


def test_subdivided_leaves_vertices_in_place():
    face = load_face("ada")
    drawn = subdivided(face)
    assert np.array_equal(drawn.face.vertices[drawn.vertex], face.vertices)
    for name, vertex in face.feature_points.items():
        assert np.array_equal(drawn.face.vertices[drawn.face.feature_points[name]], face.vertices[vertex])
    moved = face.vertices + np.sin(40 * face.vertices[:, ::-1]) * 0.01
    vertices, ups = drawn(moved, normals(face, moved[None])[0])
    assert np.array_equal(vertices[drawn.vertex], moved)
    assert np.abs(np.linalg.norm(ups, axis=1) - 1).max() < 1e-4


def test_subdivided_has_four_triangles_for_one():
    face = load_face("ada")
    drawn = subdivided(face).face
    for name, (first, last) in drawn.parts.items():
        (a, b), own = face.parts[name], drawn.triangles
        before = ((face.triangles >= a) & (face.triangles < b)).all(axis=1).sum()
        after = ((own >= first) & (own < last)).all(axis=1).sum()
        assert after == (4 if name in ("skin", "tongue", "tears", "hair", "shirt") else 1) * before, name


def test_subdivided_makes_a_ball_rounder():
    vertices, triangles = ball()
    drawn = subdivided(face_of(vertices, triangles, {"skin": (0, len(vertices))}))
    flat = drawn.mean @ vertices
    radii, before = (np.linalg.norm(at, axis=1) for at in (drawn.face.vertices[drawn.middle], flat))
    assert np.abs(radii - 1).max() < 0.5 * np.abs(before - 1).max()
    assert np.abs(radii - 1).mean() < 0.2 * np.abs(before - 1).mean()
    ups = triangle_normals(drawn.face.vertices, drawn.face.triangles)
    outwards = drawn.face.vertices[drawn.face.triangles].mean(axis=1)
    assert ((ups * outwards).sum(axis=1) > 0).all()


def test_subdivided_keeps_planes_rims_and_moves_with_the_head():
    sheet = np.stack([*np.meshgrid(np.arange(5.0), np.arange(4.0)), np.zeros((4, 5))], axis=2).reshape(-1, 3)
    drawn = subdivided(face_of(sheet, grid(4, 5), {"hair": (0, 20)}))
    places = drawn.face.vertices
    assert np.abs(places[:, 2]).max() < 1e-6
    middle = np.abs(places[:, 0] - 2) < 0.8  # a rim is straight but for its corners
    assert np.allclose(np.ptp(places[middle], axis=0)[1:], [3, 0], atol=1e-6)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turned, _ = drawn((sheet @ turn + [1, 2, 3]).astype(np.float32), np.ones_like(sheet))
    assert np.abs(turned - (places @ turn + [1, 2, 3])).max() < 1e-5


def test_subdivided_mixes_colours_and_leaves_other_parts():
    vertices, triangles = ball(3, 4)
    count = len(vertices)
    both = np.vstack([triangles, triangles + count])
    face = face_of(
        np.vstack([vertices, vertices]), both, {"left_eye": (0, count), "skin": (count, 2 * count)}
    )
    drawn = subdivided(face)
    assert drawn.face.parts["left_eye"] == (0, count)
    assert drawn.face.parts["skin"] == (count, count + len(drawn.face.vertices) - count)
    ends = drawn.mean @ face.colours.astype(float)
    assert np.array_equal(drawn.face.colours[drawn.middle], np.rint(ends))


@pytest.mark.parametrize("rows", [2, MOST])
def test_subdivided_returns_faces_without_coarse_parts_whole(rows):
    parts = {"skin": (0, 2 * rows)} if rows == MOST else {"brows": (0, 2 * rows)}
    vertices = np.random.default_rng(0).normal(size=(2 * rows, 3))
    face = face_of(vertices, grid(rows, 2), parts)
    drawn = subdivided(face)
    assert np.array_equal(drawn.face.triangles, face.triangles)
    assert np.array_equal(drawn.face.vertices, face.vertices)
