"""Tests of the parts of a face that is being built."""

import numpy as np
import pytest

from realizer.face.mesh_geometry import vertex_normals
from realizer_studio.faces.parts import Part, Submesh, mix_of, smooth

GRID = np.array([[x, y, 0.0] for y in range(4) for x in range(4)])
QUADS = np.array(
    [[r * 4 + c, r * 4 + c + 1, r * 4 + c + 5, r * 4 + c + 4] for r in range(3) for c in range(3)]
)


@pytest.fixture
def sheet() -> Submesh:
    return Submesh.of_quads(QUADS, len(GRID))


def area(patch: Submesh) -> float:
    at = patch.positions(GRID)
    a, b, c = (at[patch.triangles[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def test_submesh_clipped_ends_in_a_straight_edge(sheet: Submesh) -> None:
    cut, _ = sheet.clipped(sheet.positions(GRID)[:, 0] - 1.25)
    assert cut.positions(GRID)[:, 0].min() == pytest.approx(1.25)
    assert area(cut) == pytest.approx(3 * 1.75)


def test_submesh_vertices_are_mixes_of_base_vertices(sheet: Submesh) -> None:
    cut = sheet.clipped(sheet.positions(GRID)[:, 1] - 0.4)[0]
    assert np.allclose(np.asarray(cut.mix.sum(axis=1)).ravel(), 1)
    assert np.allclose(cut.positions(GRID + np.array([0, 0, 2.0]))[:, 2], 2)


def test_mix_of_puts_shares_into_their_columns() -> None:
    mixed = mix_of([{0: 0.25, 2: 0.75}, {1: 1.0}], 3)
    assert mixed.toarray().tolist() == [[0.25, 0, 0.75], [0, 1, 0]]


def test_submesh_threaded_doubles_the_vertices_of_round_loops() -> None:
    turn = np.arange(8) * np.pi / 4
    rings = [np.stack([r * np.cos(turn), r * np.sin(turn), 0 * turn], 1) for r in (1.0, 2.0)]
    base = np.concatenate(rings)
    k = np.arange(8)
    quads = np.stack([k, 8 + k, 8 + (k + 1) % 8, (k + 1) % 8], 1)
    patch = Submesh.of_quads(quads, 16)
    fine = patch.threaded([list(range(8)), list(range(8, 16))])
    assert len(fine) == 32
    assert len(patch.threaded([list(range(8))]).triangles) == 24  # half of the 16 have an edge on the loop
    away = np.linalg.norm(fine.positions(base), axis=1)
    assert np.all((np.abs(away - 1) < 0.01) | (np.abs(away - 2) < 0.02))
    assert np.allclose(vertex_normals(fine.positions(base), fine.triangles), [0, 0, 1])


def test_part_subset_takes_its_fields_and_places_along() -> None:
    four, uv = np.arange(12.0).reshape(4, 3), np.arange(8.0).reshape(4, 2)
    part = Part("left_eye", None, four, np.zeros((0, 3), np.int32), four, four[:, 0], None, {30: -four}, uv)
    few = part.subset(np.array([3, 1]), np.zeros((0, 3), np.int32))
    assert np.array_equal(few.vertices, four[[3, 1]])
    assert np.array_equal(few.fields[30], -four[[3, 1]])
    assert few.uv is not None
    assert np.array_equal(few.uv, uv[[3, 1]])


def test_smooth_rises_and_falls_between_its_ends() -> None:
    assert smooth([0.0, 1.5, 3.0], 1, 2).tolist() == [0, 0.5, 1]
    assert smooth([0.0, 1.5, 3.0], 2, 1).tolist() == [1, 0.5, 0]
