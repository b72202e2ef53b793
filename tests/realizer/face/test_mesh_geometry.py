"""Tests of the geometry of triangle meshes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.face.mesh_geometry import (
    components,
    corner_shares,
    edge_graph,
    edges_of,
    fit_ball,
    flat_cross,
    half_edges,
    mirror_twins,
    nearest_points,
    neighbour_mean,
    part_triangles,
    triangle_normals,
    vertex_normals,
)

# A square of two triangles, and one triangle more beside it.
AT = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0.0]])
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 2]], np.int32)
coordinates = st.floats(-1, 1)


def test_part_triangles_count_vertices_from_the_first_of_the_part() -> None:
    assert part_triangles(TRIANGLES, (0, 4)).tolist() == [[0, 1, 2], [0, 2, 3]]
    assert part_triangles(TRIANGLES, (1, 5)).tolist() == [[0, 3, 1]]
    assert part_triangles(TRIANGLES, (3, 5)).shape == (0, 3)


def test_half_edges_keep_the_direction_of_each_triangle() -> None:
    assert sorted(map(tuple, half_edges(TRIANGLES[:1]).tolist())) == [(0, 1), (1, 2), (2, 0)]
    assert len(half_edges(TRIANGLES)) == 9


def test_edges_of_counts_the_triangles_at_each_edge() -> None:
    pairs, counts = edges_of(TRIANGLES)
    shared = {tuple(pair) for pair, count in zip(pairs.tolist(), counts, strict=True) if count == 2}
    assert len(pairs) == 7
    assert shared == {(0, 2), (1, 2)}


def test_edge_graph_has_each_length_once_however_often_it_is_named() -> None:
    graph = edge_graph(AT, np.concatenate([half_edges(TRIANGLES)] * 2))
    assert graph.nnz == 7
    assert graph[0, 1] == 1
    assert graph[0, 2] == pytest.approx(2**0.5)


@pytest.mark.parametrize("own", [True, False])
def test_neighbour_mean_keeps_equal_values(own: bool) -> None:
    mean = neighbour_mean(5, half_edges(TRIANGLES), own)
    assert mean @ np.full(5, 3.0) == pytest.approx(np.full(5, 3.0))
    assert (mean @ [0, 0, 0, 0, 6.0])[1] == pytest.approx(1.5 if own else 2)  # 1 has the neighbours 0, 2, 4


def test_triangle_normals_are_twice_the_area_long() -> None:
    assert triangle_normals(2 * AT, TRIANGLES).tolist() == [[0, 0, 4]] * 3


def test_vertex_normals_have_length_one_or_zero() -> None:
    lonely = np.vstack([AT, [9, 9, 9]])
    ups = vertex_normals(lonely, TRIANGLES)
    assert ups[:5].tolist() == [[0, 0, 1]] * 5
    assert not ups[5].any()


@given(st.lists(st.tuples(st.floats(0.1, 1), coordinates, coordinates), min_size=1, max_size=9, unique=True))
def test_mirror_twins_of_twins_are_the_vertices_themselves(places: list[tuple[float, float, float]]) -> None:
    right = np.array(places)
    at = np.concatenate([right, right * [-1, 1, 1]])
    twin = mirror_twins(at, 1e-3)
    assert at[twin] == pytest.approx(at * [-1, 1, 1], abs=1e-3)


def test_mirror_twins_are_missing_where_nothing_is_near() -> None:
    assert mirror_twins(np.array([[1, 0, 0], [-1, 0, 0.1], [0, 5, 0]]), 0.2).tolist() == [1, 0, 2]
    assert mirror_twins(np.array([[1, 0, 0], [-1, 0, 0.5]]), 0.2).tolist() == [-1, -1]


@given(st.tuples(coordinates, coordinates, coordinates), st.floats(0.01, 2))
def test_fit_ball_finds_centre_and_radius(centre: tuple[float, float, float], radius: float) -> None:
    ways = np.random.default_rng(1).normal(size=(40, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    found, size = fit_ball(centre + radius * ways)
    assert found == pytest.approx(centre, abs=1e-6)
    assert size == pytest.approx(radius, abs=1e-6)


def test_components_are_numbered() -> None:
    edges = np.array([[0, 1], [1, 2], [3, 4], [5, 3], [2, 6]])
    assert components(edges, 7).tolist() == [0, 0, 0, 1, 1, 1, 0]


def test_flat_cross_is_the_area_between_two_vectors() -> None:
    assert flat_cross(np.array([[2.0, 0]]), np.array([1.0, 3])).tolist() == [6]


def test_nearest_points_of_triangles_lie_on_them() -> None:
    corners = np.array(
        [[[0, 0, 0], [0.002, 0, 0], [0, 0.002, 0]], [[0, 0, 0.01], [1, 0, 0.01], [0, 1, 0.01]]]
    )
    at = np.array([[0.0005, 0.0005, 0.001], [-0.001, 0.001, 0.0]])
    found = nearest_points(np.stack([corners] * 2), at)
    assert found[:, 0] == pytest.approx(np.array([[0.0005, 0.0005, 0], [0, 0.001, 0]]), abs=1e-9)
    assert found[0, 1] == pytest.approx([0.0005, 0.0005, 0.01], abs=1e-9)


def test_nearest_points_are_right_for_small_triangles_in_metres() -> None:
    """No other point of a triangle is nearer; those of lids are a fraction of a millimetre wide."""
    random = np.random.default_rng(0)
    corners, at = random.uniform(-2e-4, 2e-4, (300, 1, 3, 3)), random.uniform(-2e-4, 2e-4, (300, 3))
    off = np.linalg.norm(nearest_points(corners, at)[:, 0] - at, axis=1)
    shares = random.dirichlet((0.5, 0.5, 0.5), 2000)
    sampled = np.linalg.norm(np.einsum("kc,ncx->nkx", shares, corners[:, 0]) - at[:, None], axis=2)
    assert (off <= sampled.min(axis=1) + 1e-9).all()


def test_corner_shares_give_the_place_back() -> None:
    corners = np.array([[[0, 0, 0], [2, 0, 0], [0, 4, 0]]], float)
    shares = corner_shares(corners, np.array([[0.5, 1.0, 0]]))
    assert shares == pytest.approx(np.array([[0.5, 0.25, 0.25]]))
