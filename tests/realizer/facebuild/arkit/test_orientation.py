"""Tests of finding how an imported head stands."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from realizer.facebuild.arkit.importer import inspect_head

pytestmark = pytest.mark.xdist_group("fits")

WAYS = {
    "as glTF asks": np.eye(3),
    "+z up, facing +x": np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0.0]]),
    "facing -z": np.diag([-1.0, 1, -1]),
}


@pytest.mark.parametrize(
    ("way", "scale", "unit"),
    [
        pytest.param(way, *scale, marks=() if k == n else pytest.mark.slow)
        for k, way in enumerate(WAYS)
        for n, scale in enumerate([(1.0, "metres"), (10.0, "decimetres"), (100.0, "centimetres")])
    ],
)
def test_pose_of_finds_unit_and_direction_by_the_shapes(
    write_head: Callable[..., Path], way: str, scale: float, unit: str
) -> None:
    found = inspect_head(write_head(scale=scale, turn=WAYS[way], sparse=scale > 1)).found
    assert any(f"in {unit}: its eyes stand" in line for line in found)
    assert not any("exchanged" in line for line in found)


def test_pose_of_exchanges_the_viewer_s_left_and_right(write_head: Callable[..., Path]) -> None:
    other = {"Left": "Right", "Right": "Left"}
    path = write_head(spell=lambda n: next((n[: -len(k)] + other[k] for k in other if n.endswith(k)), n))
    assert any("exchanged" in line for line in inspect_head(path).found)
