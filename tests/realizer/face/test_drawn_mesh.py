"""`drawn_mesh`: what is drawn follows the face, with seams of maps and hair."""

from dataclasses import replace

import numpy as np
import pytest

from realizer.face.cards import Cards
from realizer.face.drawn_mesh import EYE, HAIR, NEUTRAL, SKIN, drawn_mesh
from realizer.face.load import load_face
from realizer.face.maps import Maps
from realizer.face.subdivision import subdivided
from realizer.face.surface import normals

FACE = replace(load_face("ada"), maps=None, cards=None)


def with_maps(uv, **rest):
    count = len(FACE.triangles)
    maps = Maps(
        {}, uv, 0.0, 1.0, rest.get("see_through", np.zeros(count, bool)), np.zeros((0, 0), np.float32)
    )
    return replace(FACE, maps=maps)


def test_drawn_mesh_of_a_face_without_maps_is_its_subdivision():
    mesh, fine = drawn_mesh(FACE), subdivided(FACE).face
    assert {name: b - a for name, (a, b) in mesh.parts.items()} == {
        name: b - a for name, (a, b) in fine.parts.items()
    }
    amounts = np.linspace(0, 1, len(FACE.vertices), dtype=np.float32)
    vertices, ups = mesh(FACE.vertices, normals(FACE, FACE.vertices[None])[0], amounts)
    ups, amounts = ups[:, :3], ups[:, 3]
    assert (amounts.min(), amounts.max()) == pytest.approx((0, 1))
    ours, theirs = (
        np.sort(np.round(points[triangles].mean(axis=1), 6), axis=0)
        for points, triangles in ((vertices, mesh.triangles), (fine.vertices, fine.triangles))
    )
    assert ours == pytest.approx(theirs, abs=1e-6)
    assert np.abs(np.linalg.norm(ups, axis=1) - 1).max() < 1e-4
    assert mesh.uv == pytest.approx(NEUTRAL, abs=1e-6)
    assert not mesh.see_through.any()
    assert mesh.kind[mesh.parts["left_eye"][0]] == EYE
    assert mesh.kind[0] == SKIN


def test_drawn_mesh_has_a_vertex_for_each_side_of_a_seam():
    first = np.arange(len(FACE.triangles)) == 0
    uv = np.where(first[:, None, None], 0.75, 0.25) * np.ones((1, 3, 2), np.float32)
    mesh = drawn_mesh(with_maps(uv, see_through=first))
    # The corners of the first triangle and the middles of its sides are there twice.
    assert len(mesh.uv) == len(drawn_mesh(FACE).uv) + 6
    assert mesh.see_through.sum() == 4
    seen = mesh.uv[mesh.triangles[mesh.see_through]]
    assert seen == pytest.approx(0.75, abs=1e-5)
    assert mesh.uv[mesh.triangles[~mesh.see_through]] == pytest.approx(0.25, abs=1e-5)


def test_drawn_mesh_has_the_direction_of_hairs_where_v_grows():
    roots = np.arange(4, dtype=np.int32)
    rest = FACE.vertices[:4]
    cards = Cards(
        roots=np.tile(roots, (4, 1)),
        weights=np.eye(4, dtype=np.float32),
        ups=np.ones((4, 4), np.float32),
        triangles=np.int32([[0, 1, 2], [2, 1, 3]]),
        uv=np.float32([[0, 0], [0.1, 0], [0, 0.1], [0.1, 0.1]]),
        colours=np.zeros((4, 3), np.uint8),
        occlusion=np.ones(4, np.float32),
        gloss=np.zeros(4, np.float32),
        parts={"hair": (0, 4)},
    )
    mesh = drawn_mesh(replace(FACE, cards=cards))
    first, _ = mesh.parts["hair_cards"]
    strands = mesh.strands @ FACE.vertices
    assert not strands[:first].any()
    along = strands[first] / np.linalg.norm(strands[first])
    wanted = (rest[2] - rest[0]) / np.linalg.norm(rest[2] - rest[0])
    assert along == pytest.approx(wanted, abs=1e-3)


def test_drawn_mesh_adds_cards_that_follow_their_roots():
    cards = Cards(
        roots=np.zeros((3, 4), np.int32),
        weights=np.float32([[1, 0, 0, 0]] * 3),
        ups=np.float32([[2, 0, 0, 0]] * 3),
        triangles=np.int32([[0, 1, 2]]),
        uv=np.float32([[0.9, 0.9]] * 3),
        colours=np.full((3, 3), 7, np.uint8),
        occlusion=np.ones(3, np.float32),
        gloss=np.zeros(3, np.float32),
        parts={"brows": (0, 3)},
    )
    mesh = drawn_mesh(replace(FACE, cards=cards))
    first, last = mesh.parts["brows_cards"]
    assert (last - first, len(mesh.uv)) == (3, last)
    assert (mesh.kind[first:] == HAIR).all()
    assert mesh.two_sided[-1]
    assert mesh.see_through[-1]
    ups = normals(FACE, FACE.vertices[None])[0]
    vertices, drawn_ups = mesh(FACE.vertices + 1, ups, np.zeros(len(ups), np.float32))
    assert vertices[first:] == pytest.approx(np.tile(FACE.vertices[0] + 1, (3, 1)), abs=1e-6)
    assert drawn_ups[first:, :3] == pytest.approx(np.tile(ups[0], (3, 1)), abs=1e-6)
