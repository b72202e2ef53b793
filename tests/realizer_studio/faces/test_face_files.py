"""Tests of writing the files of a face folder."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from realizer.face.basis import ARRAYS, unpack
from realizer.face.load import MESH
from realizer.face.reading import read_arrays
from realizer_studio.faces.face_files import to_bytes, write_fields, write_head, write_mesh


def test_write_head_keeps_quotes_and_order(tmp_path: Path) -> None:
    head = {"name": "x", "source": 'a "scan"', "licence": "CC0-1.0", "says": "Ölgemälde \\ Büste"}
    write_head(tmp_path / "face.toml", head, {"skin": (0, 5), "hair": [5, 9]})
    read = tomllib.loads((tmp_path / "face.toml").read_text("utf-8"))
    assert read == {**head, "parts": {"skin": [0, 5], "hair": [5, 9]}}
    assert list(read) == [*head, "parts"]


def test_write_mesh_stores_bytes(tmp_path: Path) -> None:
    at, colours = np.eye(3), np.array([[0, 127.6, 300], [1, 2, 3], [-4, 5, 6.0]])
    write_mesh(tmp_path / "mesh.npz", at, np.array([[0, 1, 2]]), colours, np.array([0, 0.5, 1]), np.zeros(3))
    stored = read_arrays(tmp_path / "mesh.npz", MESH)
    assert stored["colours"].tolist() == [[0, 128, 255], [1, 2, 3], [0, 5, 6]]
    assert stored["occlusion"].tolist() == [0, 128, 255]
    assert stored["vertices"].dtype == np.float32


def test_write_fields_stores_what_unpack_reads(tmp_path: Path) -> None:
    rows = {31: np.array([[0, 1, 0], [0, 0, 0], [0, 0.5, 0.0]]), 5: np.zeros((3, 3))}
    lids = np.array([2]), np.array([0]), np.array([0.012])
    pivots = np.zeros(3), np.ones(3)
    write_fields(
        tmp_path / "fields.npz", rows, np.zeros(3, np.uint8), *pivots, [np.eye(3)[0], -np.eye(3)[0]], lids
    )
    stored = read_arrays(tmp_path / "fields.npz", ARRAYS)
    again = unpack(stored, 3)
    assert again.keys() == rows.keys()
    assert again[31] == pytest.approx(rows[31])
    assert stored["head_pivot"].tolist() == [1, 1, 1]
    assert stored["lid_radius"] == pytest.approx([0.012])


def test_to_bytes_rounds_and_limits() -> None:
    assert to_bytes(np.array([-1, 0.4, 0.6, 254.6, 999])).tolist() == [0, 0, 1, 255, 255]
