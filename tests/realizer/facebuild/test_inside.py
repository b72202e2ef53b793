"""Tests of how deep places lie inside a surface."""

import numpy as np
import pytest

from realizer.face.mesh_geometry import grid
from realizer.facebuild.inside import depths, without_rim

RADIUS = 0.01
NEAR = 0.008


def ball(rows: int = 24, columns: int = 48) -> tuple[np.ndarray, np.ndarray]:
    """A ball without its poles."""
    turn, rise = np.meshgrid(
        np.arange(columns) * 2 * np.pi / columns, np.linspace(-1.4, 1.4, rows), indexing="xy"
    )
    at = RADIUS * np.stack([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)], -1)
    triangles = grid(rows, columns, closed=True)
    a, b, c = at.reshape(-1, 3)[triangles[0]]
    outwards = np.cross(b - a, c - a) @ a > 0
    return at.reshape(-1, 3), triangles if outwards else triangles[:, ::-1]


def test_depths_of_a_ball_are_below_its_surface() -> None:
    at, triangles = ball()
    ways = np.random.default_rng(1).normal(size=(60, 3))
    ways[:, 2] *= 0.3
    ways = ways[np.abs(ways[:, 2]) < np.hypot(*ways.T[:2])]
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    for deep in (-0.004, -0.0003, 0.0003, 0.004):
        depth, out = depths(ways * (RADIUS - deep), at, triangles, NEAR)
        assert depth == pytest.approx(deep, abs=1.5e-4)
        assert (out * ways).sum(axis=1) == pytest.approx(deep, abs=1.5e-4)


def test_depths_know_the_side_of_a_sharp_edge() -> None:
    # A roof: most of its area is on one side of the ridge.
    at = np.array([[-1, 0, 0], [1, 0, 0], [-1, 9, -1], [1, 9, -1], [-1, -0.1, -1], [1, -0.1, -1.0]]) / 1000
    triangles = np.array([[0, 1, 3], [0, 3, 2], [1, 0, 4], [1, 4, 5]], np.int32)
    places = np.array([[0.3, -0.5, 0.1], [0.3, 0.0, 0.2], [0.3, 0.2, -0.3]]) / 1000
    depth, _ = depths(places, at, triangles, NEAR)
    assert (depth > 0).tolist() == [False, False, True]


def test_depths_are_not_known_far_away() -> None:
    at, triangles = ball()
    depth, out = depths(np.array([[0.05, 0, 0]]), at, triangles, 0.002)
    assert depth.tolist() == [-np.inf]
    assert not out.any()


def test_without_rim_leaves_the_triangles_inside_a_surface() -> None:
    assert len(without_rim(grid(5, 5))) == 2 * 2 * 2
