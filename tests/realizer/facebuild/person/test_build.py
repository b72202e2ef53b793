"""The builder: from data that are missing it builds nothing, and says so."""

from pathlib import Path

import pytest

from realizer.core.errors import FaceError
from realizer.facebuild.person.build import build_face
from realizer.facebuild.person.makehuman import OBJ, Edges, walk


def ring_of_quads(n: int) -> Edges:
    """Two rings of n vertices, 0.. and n.., joined by quads; a third below: 2n..."""
    edges = Edges()
    for low, high in ((0, n), (n, 2 * n)):
        for k in range(n):
            quad = [low + k, low + (k + 1) % n, high + (k + 1) % n, high + k]
            for a, b in zip(quad, quad[1:] + quad[:1], strict=True):
                edges.add(a, b, quad)
    return edges


def test_the_builder_says_what_it_misses(tmp_path: Path) -> None:
    with pytest.raises(FaceError, match="wanted the unpacked wheel"):
        build_face("x", tmp_path, tmp_path / "x")
    (tmp_path / OBJ).parent.mkdir(parents=True)
    (tmp_path / OBJ).touch()
    with pytest.raises(FaceError, match=r"recipe\.toml: wanted a recipe"):
        build_face("x", tmp_path, tmp_path / "x")


def test_a_walk_along_edges_goes_round_a_ring_once() -> None:
    assert walk(ring_of_quads(8), 8, 9) == [8, 9, 10, 11, 12, 13, 14, 15]


def test_a_walk_begins_on_an_edge() -> None:
    with pytest.raises(ValueError, match="share no edge"):
        walk(ring_of_quads(8), 0, 4)
