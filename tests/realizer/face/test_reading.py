"""Tests of the readers of files in face folders."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from realizer.core.errors import FaceError, TableError
from realizer.face.reading import face_errors, read_arrays


@pytest.fixture
def path(tmp_path: Path) -> Path:
    np.savez(tmp_path / "x.npz", flat=np.arange(3), words=np.array(["a"]))
    return tmp_path / "x.npz"


def test_arrays_are_read_as_they_are_stored(path: Path) -> None:
    assert read_arrays(path, {"flat": 1})["flat"].tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    ("wanted", "words"),
    [
        ({"more": 1}, "wanted an array 'more', found flat, words"),
        ({"flat": 2}, r"flat: wanted 2 dimensions, got \(3,\)"),
        ({"words": 1}, "words: wanted numbers, got <U1"),
    ],
)
def test_arrays_are_checked(path: Path, wanted: dict[str, int], words: str) -> None:
    with pytest.raises(FaceError, match=rf"x\.npz: {words}"):
        read_arrays(path, wanted)


def test_arrays_of_a_damaged_file_are_refused(path: Path) -> None:
    whole = path.read_bytes()
    path.write_bytes(whole[:-40])
    with pytest.raises(FaceError, match="cut short or no archive"):
        read_arrays(path, {})
    middle = whole.index(np.arange(3).tobytes())
    path.write_bytes(whole[:middle] + b"\xff" + whole[middle + 1 :])
    with pytest.raises(FaceError, match=r"flat\.npy is damaged"):
        read_arrays(path, {})
    path.unlink()
    with pytest.raises(FaceError, match="wanted this file, found none"):
        read_arrays(path, {})


def test_arrays_of_objects_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "x.npz", a=np.array([{}], object))
    with pytest.raises(FaceError, match="wanted arrays of numbers, got something else"):
        read_arrays(tmp_path / "x.npz", {})


@pytest.mark.parametrize(
    ("raised", "words"),
    [
        (FileNotFoundError(), "x: wanted a list, found none"),
        (PermissionError(13, "Permission denied"), "x: wanted a list, got Permission denied"),
        (UnicodeDecodeError("utf-8", b"\xff", 0, 1, "bad"), "x: wanted a list, got bytes that are no UTF-8"),
        (tomllib.TOMLDecodeError("at line 1"), "x: wanted a list, got: at line 1"),
        (TableError("x, line 2: wanted 7 cells"), "x, line 2: wanted 7 cells"),
    ],
)
def test_face_errors_name_the_file_and_what_it_should_be(raised: Exception, words: str) -> None:
    with pytest.raises(FaceError) as caught, face_errors(Path("x"), "a list"):
        raise raised
    assert str(caught.value) == words
