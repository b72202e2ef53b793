"""Tests of `realizer.analysis.points_file`."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.analysis.points_file import bridge, read_points

TABLE = """\
# tracked by hand
frame,point,x,y,z
0,4.1,0.015,0.017,0.028
0,2.1,0,-0.1,0.012

1,4.1,0.015,0.018,0.028
3,4.1,0.015,0.020,0.028
1,2.1,0,-0.11,0.012
2,2.1,0,-0.12,0.012
3,2.1,0,-0.13,0.012
"""


def test_read_points_has_nan_for_lost_points() -> None:
    points, rest = read_points(TABLE)
    assert points["4.1"].shape == points["2.1"].shape == (4, 3)
    assert np.isnan(points["4.1"][2]).all()
    assert list(points["2.1"][3]) == [0, -0.13, 0.012]
    assert list(rest["4.1"]) == [0.015, 0.017, 0.028]


def test_bridge_interpolates_linearly() -> None:
    points, _ = read_points(TABLE)
    whole = bridge(points)
    assert whole["4.1"][2] == pytest.approx([0.015, 0.019, 0.028])
    assert np.array_equal(whole["2.1"], points["2.1"])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "t: wanted a first line frame,point,x,y,z, got ''"),
        ("time,x\n1,2", "t: wanted a first line frame,point,x,y,z, got 'time,x'"),
        (TABLE + "4,2.1,0,up,0\n", "t, line 11: wanted frame,point,x,y,z, got '4,2.1,0,up,0'"),
        (TABLE + "4,2.1,0,0\n", "t, line 11: wanted frame"),
        (TABLE + "3,2.1,0,0,0\n", "t, line 11: point 2.1 is there twice in frame 3"),
        (TABLE + "-1,2.1,0,0,0\n", r"t, line 11: wanted a frame 0\.\."),
        (TABLE + "4,2.1,0,nan,0\n", "finite places"),
        (TABLE + "0,99.9,0,0,0\n", "t, line 11: wanted a point of MPEG-4, 2.1 to 11.6, got '99.9'"),
        (TABLE + "3,4.2,0,0,0\n", "t: wanted every point at rest in frame 0, got none of 4.2"),
    ],
)
def test_read_points_refuses_an_invalid_line(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        read_points(text, "t")
