"""Tests of the GLB writer."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.glb_file import GlbFile, half_turns, quaternions, read_glb
from realizer_studio.faces.arkit.gltf import Gltf

ARRAYS = {
    "bytes": np.arange(8, dtype=np.uint8).reshape(2, 4),
    "shorts": np.array([1, 2, 65535], np.uint16),
    "words": np.array([0, 70000], np.uint32),
    "floats": np.array([[1, -2, 3.5]], np.float32),
    "matrices": np.arange(32, dtype=np.float32).reshape(2, 16),
}


def read(tmp_path, file: GlbFile) -> Gltf:
    path = tmp_path / "x.glb"
    path.write_bytes(file.bytes_of({"asset": {"version": "2.0"}}))
    return Gltf(path)


def test_glb_file_stores_every_kind_of_array(tmp_path):
    file = GlbFile()
    numbers = {name: file.add(array) for name, array in ARRAYS.items()}
    found = read(tmp_path, file)
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(found.accessor(numbers[name]).squeeze(), array.squeeze())
    assert all(view["byteOffset"] % 4 == 0 for view in found.json["bufferViews"])


@pytest.mark.parametrize("rows", [[], [3], [0, 99], [65535, 69999]])
def test_glb_file_stores_only_the_rows_of_a_sparse_array(tmp_path, rows):
    array = np.zeros((70000, 3), np.float32)
    array[rows] = (1, 0, -2)
    file = GlbFile()
    file.add_sparse(array, bounds=True)
    found = read(tmp_path, file)
    np.testing.assert_array_equal(found.accessor(0), array)
    assert found.json["buffers"][0]["byteLength"] == len(rows) * (4 + 12)
    assert found.json["accessors"][0]["min"] == ([0, 0, -2] if rows else [0, 0, 0])


def test_glb_file_adds_to_a_file_that_was_read(tmp_path):
    first = GlbFile()
    first.add(ARRAYS["shorts"])
    document, data = read_glb(first.bytes_of({"asset": {"version": "2.0"}, "extras": 7}))
    file = GlbFile(document, data)
    assert file.add(ARRAYS["floats"]) == 1
    (tmp_path / "x.glb").write_bytes(file.bytes_of(document))
    found = Gltf(tmp_path / "x.glb")
    assert found.json["extras"] == 7
    np.testing.assert_array_equal(found.accessor(0).squeeze(), ARRAYS["shorts"])
    np.testing.assert_array_equal(found.accessor(1), ARRAYS["floats"])


TURNS = np.array([[0.3, -0.5, 0.1], [0, 1.2, 0], [0, 0, 0]], np.float32)


def test_quaternions_turn_up_by_positive_pitch_about_x():
    np.testing.assert_allclose(
        quaternions(np.float32([[np.pi / 2, 0, 0]])), [[0.5**0.5, 0, 0, 0.5**0.5]], atol=1e-6
    )


def test_half_turns_make_whole_turns_twice():
    half = half_turns(quaternions(TURNS)).astype(float)
    twice = np.concatenate([2 * half[:, 3:] * half[:, :3], 2 * half[:, 3:] ** 2 - 1], axis=1)
    np.testing.assert_allclose(twice, quaternions(TURNS), atol=1e-6)
