"""Tests of `realizer_studio.tracking.markers.layout`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer_studio.tracking.markers.layout import broken, constraints, numbered, read_layout, wojdel
from realizer_studio.tracking.network import TrackingError
from tests.painted import acted, layout_in_pixels, truth


def test_wojdel_has_31_points_in_her_unit() -> None:
    layout = wojdel()
    at = dict(zip(layout.names, layout.positions, strict=True))
    assert (len(layout), layout.colours.sum()) == (31, 2)
    assert at["20"] == pytest.approx([0, 0])
    assert at["3"][0] - at["2"][0] == pytest.approx(1)
    # Markers 11 and 13 lie on the left of the line from the nose to the forehead, and above the nose (7.1.3).
    assert min(at["11"][0], at["13"][0]) > at["1"][0]
    assert min(at["10"][1], at["12"][1]) > at["20"][1]


def test_constraints_hold_in_expressions_and_break_in_a_wrong_order() -> None:
    layout = layout_in_pixels("ada")
    rules = constraints(layout)
    assert len(rules) >= 38 + 24  # as many as hers
    shown = truth("ada", acted()) * (1, -1)
    assert not any(broken(places, rules).any() for places in shown)
    assert {*rules.ravel().tolist()} == {*range(31)}
    exchanged = layout.positions.copy()
    exchanged[[10, 19]] = exchanged[[19, 10]]
    counts = broken(exchanged, rules)
    assert min(counts[10], counts[19]) >= 2
    exchanged[[10, 19]] = np.nan  # without them, no other rule is broken
    assert not broken(exchanged, rules).any()


def test_constraints_of_points_on_a_line_are_none() -> None:
    layout = numbered(np.array([[0.0, 0, 0], [10, 0, 0], [20, 0, 0]]))
    assert len(constraints(layout)) == 0


def test_numbered_goes_from_the_upper_left_to_the_lower_right() -> None:
    layout = numbered(np.array([[50.0, 100, 1], [90, 11, 0], [10, 10, 0], [50, 12, 0]]))
    assert layout.positions.tolist() == [[10, -10], [50, -12], [90, -11], [50, -100]]
    assert (layout.names, layout.colours.tolist()) == (("1", "2", "3", "4"), [0, 0, 0, 1])


def test_read_layout_takes_names_of_feature_points(tmp_path: Path) -> None:
    path = tmp_path / "own.csv"
    path.write_text("point,feature_point,x,y,colour\n4.1,,1,5,1\nscar,8.3,2,1,1\nmole,,0,0,2\n")
    layout = read_layout(path)
    assert layout.feature_points == ("4.1", "8.3", "")
    assert layout.with_colours(1).colours.tolist() == [0, 0, 0]


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("a,,1,1,1\na,,2,2,1\nb,,3,3,1\n", "wanted each point once, got 'a' twice"),
        ("a,9.99,1,1,1\nb,,2,2,1\nc,,3,3,1\n", "got '9.99'"),
        ("a,,1,1,1\nb,,2,2,1\n", "wanted 3 points or more"),
        ("a,,1,1,0\nb,,2,2,1\nc,,3,3,1\n", "colours from 1"),
        ("a,,1,1\n", "wanted 5 cells, got 4"),
        ("a,,nan,1,1\nb,,2,2,1\nc,,3,3,1\n", "own.csv"),
    ],
)
def test_read_layout_says_what_is_wrong(tmp_path: Path, rows: str, said: str) -> None:
    path = tmp_path / "own.csv"
    path.write_text("point,feature_point,x,y,colour\n" + rows)
    with pytest.raises(TrackingError, match=said):
        read_layout(path)
