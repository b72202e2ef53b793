"""Tests of reading the head in a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer.facebuild.arkit.head import read_head

pytestmark = pytest.mark.xdist_group("fits")


def test_read_head_sorts_vertices_part_after_part(ada_glb: Path) -> None:
    head = read_head(ada_glb)
    ends = list(head.ranges.values())
    assert [first for first, _ in ends] == [0, *(last for _, last in ends[:-1])]
    assert ends[-1][1] == len(head.surface.vertices)
    eyes = [head.surface.vertices[slice(*head.ranges[name])] for name in ("left_eye", "right_eye")]
    assert np.mean([eye.mean(axis=0)[:2] for eye in eyes], axis=0) == pytest.approx([0, 0], abs=0.001)
    assert not head.painted
