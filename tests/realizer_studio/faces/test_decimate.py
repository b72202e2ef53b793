"""Tests of the decimation of meshes."""

import numpy as np
import pytest

from realizer_studio.faces.decimate import decimate


def sheet(bend: float) -> tuple[np.ndarray, np.ndarray]:
    """A square of 21 x 21 vertices, 20 cm wide, symmetric about x = 0, arched by `bend`."""
    line = np.linspace(-0.1, 0.1, 21)
    x, y = np.meshgrid(line, line)
    at = np.stack([x.ravel(), y.ravel(), bend * np.cos(x.ravel() * 15)], 1)
    k = np.arange(20)[:, None] * 21 + np.arange(20)
    a = k.ravel()
    return at, np.concatenate([np.stack([a, a + 1, a + 22], 1), np.stack([a, a + 22, a + 21], 1)]).astype(
        np.int32
    )


def area(at: np.ndarray, triangles: np.ndarray) -> float:
    a, b, c = (at[triangles[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def test_decimate_keeps_the_outline_of_a_flat_sheet() -> None:
    at, triangles = sheet(0)
    kept, left = decimate(at, triangles, np.full(len(at), 0.001))
    assert len(kept) < len(at) / 4
    assert area(at[kept], left) == pytest.approx(0.04)
    a, b, c = (at[kept][left[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_decimate_keeps_vertices_without_tolerance() -> None:
    at, triangles = sheet(0)
    tolerance = np.where(at[:, 1] > 0, 0.001, 0)
    kept, _ = decimate(at, triangles, tolerance)
    assert set(np.flatnonzero(tolerance == 0)) <= set(kept)
    assert len(kept) < len(at)


@pytest.mark.parametrize("tolerance", [0.0005, 0.002])
def test_decimate_changes_a_bent_sheet_by_the_tolerance(tolerance: float) -> None:
    at, triangles = sheet(0.02)
    kept, left = decimate(at, triangles, np.full(len(at), tolerance))
    assert len(kept) < len(at)
    middle = at[kept][left].mean(axis=1)
    assert np.abs(middle[:, 2] - 0.02 * np.cos(middle[:, 0] * 15)).max() < 2.5 * tolerance


def test_decimate_makes_no_holes() -> None:
    at, triangles = sheet(0.02)
    kept, left = decimate(at, triangles, np.full(len(at), 0.002))
    edges = np.sort(np.concatenate([left[:, [0, 1]], left[:, [1, 2]], left[:, [2, 0]]]), axis=1)
    pairs, count = np.unique(edges, axis=0, return_counts=True)
    assert count.max() == 2
    assert len(kept) - len(pairs) + len(left) == 1  # Euler's number of a disc
    assert sorted(set(left.ravel())) == list(range(len(kept)))
