"""Tests of measurements of action units."""

from __future__ import annotations

from pathlib import Path

import pytest

from realizer.core.errors import FaceError
from realizer.face.au.units import units
from realizer.face.load import list_faces, load_face
from realizer_studio.faces.au.measure import read_measurements, read_shapes, write_shapes

HEAD = "# source: made for tests\n# units: metres\n# licence: MIT\nau,x,y,z,dx,dy,dz\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEAD + "12,0,0,0,0,0,nan\n" * 9, "AU12: wanted finite numbers"),
        (HEAD + "12,0,0,0,0,0,0.1\n" * 3, "AU12: wanted 8 landmarks"),
        (HEAD + "12,0,0,0,0,0,0\n" * 9, "AU12: wanted 8 landmarks or more of which one moves"),
        (HEAD + "51,0,0,0,0,0,0.1\n" * 9, "wanted action units of 1, 2, 4"),
        (HEAD + "12,0,0,0,0,0\n", "wanted 7 cells"),
        (HEAD.replace("dz", "d") + "12,0,0,0,0,0,1\n", "wanted columns au,x,y,z,dx,dy,dz"),
        ("au,x,y,z,dx,dy,dz\n", "source"),
    ],
)
def test_read_measurements_names_the_place_of_a_fault(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "landmarks.csv"
    path.write_text(text)
    with pytest.raises(FaceError, match=words) as caught:
        read_measurements(path)
    assert "landmarks.csv" in str(caught.value)


def test_read_shapes_returns_what_write_shapes_wrote(tmp_path: Path) -> None:
    folder = next(info.path for info in list_faces() if info.name == load_face().name)
    measured = read_shapes(folder / "au_shapes.npz")
    write_shapes(tmp_path / "again.npz", measured)
    again = read_shapes(tmp_path / "again.npz")
    assert set(again) == {unit.au for unit in units().values() if unit.kind == "displacement"}
    for au, one in measured.items():
        assert again[au].moves == pytest.approx(one.moves, abs=1e-9)
        assert (again[au].visible == one.visible).all()
    with pytest.raises(FaceError, match=r"none\.npz"):
        read_shapes(tmp_path / "none.npz")


def test_read_measurements_gathers_landmarks_by_unit(tmp_path: Path) -> None:
    path = tmp_path / "landmarks.csv"
    path.write_text(HEAD + "".join(f"{au},0.1,0.2,{k},0,{au},0\n" for k in range(8) for au in (12, 4)))
    found = read_measurements(path)
    assert list(found) == [4, 12]
    assert found[12].at.tolist() == [[0.1, 0.2, k] for k in range(8)]
    assert found[4].moves.tolist() == [[0, 4, 0]] * 8
    assert found[4].visible.all()
    with pytest.raises(ValueError, match="wanted shapes whose halves are known"):
        write_shapes(tmp_path / "x.npz", found)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_read_measurements_takes_landmarks_that_move_along_one_axis(axis: int, tmp_path: Path) -> None:
    path, move = tmp_path / "landmarks.csv", ["0"] * 3
    move[axis] = "0.1"
    path.write_text(HEAD + f"12,0,0,0,{','.join(move)}\n" * 8)
    assert read_measurements(path)[12].moves[:, axis].tolist() == [0.1] * 8
