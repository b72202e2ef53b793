"""Tests of measuring action units by the shapes of the data that a face was built from."""

import os
from pathlib import Path

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer.face.load import list_faces, load_face
from realizer_studio.faces.au.measure import read_shapes
from realizer_studio.faces.au.shapes import measure_shapes

SHAPED = [info.path for info in list_faces() if (info.path / "au_shapes.npz").is_file()]
FOLDER = next(info.path for info in list_faces() if info.name == load_face().name)


def test_measure_shapes_refuses_a_folder_without_the_data(tmp_path: Path) -> None:
    with pytest.raises(FaceError, match="wanted the unpacked wheel"):
        measure_shapes(load_face(), FOLDER, tmp_path)


@pytest.mark.skipif("REALIZER_HEAD_DATA" not in os.environ, reason="wants the unpacked CC0 head data")
def test_measure_shapes_gives_the_stored_shapes() -> None:
    made = measure_shapes(load_face(), FOLDER, Path(os.environ["REALIZER_HEAD_DATA"]))
    for au, stored in read_shapes(FOLDER / "au_shapes.npz").items():
        assert stored.moves == pytest.approx(made[au].moves, abs=1e-5)
        assert np.mean(stored.visible == made[au].visible) > 0.99


@pytest.mark.parametrize("folder", SHAPED, ids=lambda folder: folder.name)
def test_stored_shapes_move_as_their_units_are_named(folder: Path) -> None:
    """Brows up for 1 and 2, down for 4; corners up for 12, down for 15; lids down for 43; jaw down for 27."""
    measured = read_shapes(folder / "au_shapes.npz")
    ways = {1: 1, 2: 1, 4: -1, 5: 1, 6: 1, 10: 1, 12: 1, 15: -1, 16: -1, 27: -1, 43: -1}
    for au, sign in ways.items():
        one = measured[au]
        long = np.where(one.visible, np.linalg.norm(one.moves, axis=1), 0)
        assert sign * one.moves[np.argmax(long), 1] > 0.001, f"AU{au}"


@pytest.mark.parametrize("folder", SHAPED, ids=lambda folder: folder.name)
def test_stored_shapes_are_of_the_present_mesh(folder: Path) -> None:
    """Every vertex of the left half of the skin, lips and their corners too, was measured."""
    face = load_face(folder.name)
    skin = face.vertices[slice(*face.parts["skin"])].astype(float)
    half = skin[(skin[:, 0] > -1e-6) & (skin[:, 1] > -0.16)]
    at = read_shapes(folder / "au_shapes.npz")[1].at
    assert len(at) == len(half)
    assert at == pytest.approx(half, abs=1e-6)


@pytest.mark.parametrize("folder", SHAPED, ids=lambda folder: folder.name)
def test_stored_shapes_move_a_lip_with_its_neighbours(folder: Path) -> None:
    """A vertex that the builder added between two moves as they do: the jaw takes the whole lower lip."""
    face = load_face(folder.name)
    one = read_shapes(folder / "au_shapes.npz")[27]
    place = {tuple(at): k for k, at in enumerate(np.float32(one.at).tolist())}
    vertices = face.vertices.tolist()
    points = ("2.3", "2.8", "8.2", "8.7", "2.4", "8.3")
    for point in points:
        vertex = face.feature_points[point]
        mine = one.moves[place[tuple(vertices[vertex])]]
        around = np.unique(face.triangles[(face.triangles == vertex).any(axis=1)])
        for other in around:
            if tuple(vertices[other]) in place:
                move = one.moves[place[tuple(vertices[other])]]
                apart = np.linalg.norm(face.vertices[other] - face.vertices[vertex])
                assert np.linalg.norm(move - mine) < 0.004 + 1.5 * apart, (point, int(other))


@pytest.mark.parametrize("folder", SHAPED, ids=lambda folder: folder.name)
def test_stored_shapes_of_pressed_lips_do_not_smile(folder: Path) -> None:
    face = load_face(folder.name)
    one = read_shapes(folder / "au_shapes.npz")[24]
    corner = np.linalg.norm(one.at - face.points["8.3"], axis=1).argmin()
    long = np.linalg.norm(one.moves, axis=1)
    assert long[corner] < 0.15 * long[one.visible].max()


@pytest.mark.skipif("REALIZER_HEAD_DATA" not in os.environ, reason="wants the unpacked CC0 head data")
def test_measure_shapes_refuses_the_mesh_of_another_builder() -> None:
    import dataclasses

    face = load_face(deformer="mpeg4")
    moved = face.vertices.copy()
    moved[face.feature_points["9.3"], 2] += 0.0025
    with pytest.raises(FaceError, match=r"1 of \d+ vertices lie off that, up to 2\.\d mm.*build it again"):
        measure_shapes(
            dataclasses.replace(face, vertices=moved), FOLDER, Path(os.environ["REALIZER_HEAD_DATA"])
        )
