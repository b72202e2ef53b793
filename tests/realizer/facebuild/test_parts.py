"""Tests of the parts of a face that is being built."""

import numpy as np

from realizer.facebuild.parts import Part, smooth


def test_part_subset_takes_its_fields_and_places_along() -> None:
    four, uv = np.arange(12.0).reshape(4, 3), np.arange(8.0).reshape(4, 2)
    part = Part("left_eye", None, four, np.zeros((0, 3), np.int32), four, four[:, 0], None, {30: -four}, uv)
    few = part.subset(np.array([3, 1]), np.zeros((0, 3), np.int32))
    assert np.array_equal(few.vertices, four[[3, 1]])
    assert np.array_equal(few.fields[30], -four[[3, 1]])
    assert few.uv is not None
    assert np.array_equal(few.uv, uv[[3, 1]])


def test_smooth_rises_and_falls_between_its_ends() -> None:
    assert smooth([0.0, 1.5, 3.0], 1, 2).tolist() == [0, 0.5, 1]
    assert smooth([0.0, 1.5, 3.0], 2, 1).tolist() == [1, 0.5, 0]
