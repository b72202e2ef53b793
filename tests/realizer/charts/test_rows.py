"""Tests of the rows of a chart."""

from realizer.charts.rows import draw_dropped, draw_row, height_of
from realizer.charts.scale import Scale
from realizer.charts.shapes import Box, Picture, Text
from realizer.charts.timeline import BehaviourRow, Dropped, Gap, Point

SCALE = Scale(0.0, 4.0, 1200.0)


def texts(picture: Picture) -> list[str]:
    return [shape.text for shape in picture.shapes if isinstance(shape, Text)]


def row(*gaps: Gap, tied: frozenset[str] = frozenset()) -> list[str]:
    points = [Point(gaps[0].begin, 0.0, 0.0)]
    for gap in gaps:
        time = points[-1].time + gap.actual
        points.append(Point(gap.end, time, time))
    picture = Picture(1200)
    draw_row(picture, SCALE, BehaviourRow("n", "head", 3, True, tuple(points), gaps), 0.0, 0.0, tied)
    return texts(picture)


def test_draw_row_writes_length_and_ratio_of_a_gap() -> None:
    assert "1.50 s, 150%" in row(Gap("start", "end", 1.5, 1.0, 0.0, 1.0))
    assert "1.00 s" in row(Gap("start", "end", 1.0, 1.0, 0.0, 1.0))
    assert "1.50 s" in row(Gap("start", "end", 1.5))


def test_draw_row_frames_the_behaviour_from_its_first_point_to_its_last() -> None:
    gaps = Gap("start", "stroke", 1.0), Gap("stroke", "end", 0.5)
    points = tuple(Point(name, time, time) for name, time in (("start", 0.5), ("stroke", 1.5), ("end", 2.0)))
    picture = Picture(1200)
    draw_row(picture, SCALE, BehaviourRow("n", "head", 3, True, points, gaps), 0.0, 0.0, frozenset())
    boxes = [(shape.x, shape.x + shape.width) for shape in picture.shapes if isinstance(shape, Box)]
    at = {time: SCALE.x(time) for time in (0.5, 1.5, 2.0)}
    assert boxes == [(at[0.5], at[1.5]), (at[1.5], at[2.0]), (at[0.5], at[2.0])]


def test_draw_row_writes_less_in_short_gaps() -> None:
    assert "150%" in row(Gap("start", "end", 0.15, 0.1, 0.0, 1.0))
    assert not any("%" in text for text in row(Gap("start", "end", 0.03, 0.02, 0.0, 1.0)))


def test_draw_row_writes_name_and_element() -> None:
    assert {"n", "head, line 3, required"} <= set(row(Gap("start", "end", 1.0, 1.0, 0.0, 1.0)))


def test_draw_row_keeps_the_linked_name_if_names_collide() -> None:
    gaps = [Gap("strokeStart", "stroke", 0.02), Gap("stroke", "strokeEnd", 0.02)]
    shown = row(*gaps, tied=frozenset({"stroke"}))
    assert "stroke" in shown
    assert "strokeEnd" in row(Gap("start", "strokeEnd", 2.0), Gap("strokeEnd", "end", 2.0))


def test_draw_dropped_folds_the_reason_without_its_place() -> None:
    gone = Dropped("f", "faceLexeme", 7, "CANNOT_CREATE_BEHAVIOR", "line 7, /bml/x[1]: " + "why not? " * 100)
    picture = Picture(1200)
    height = height_of(gone, SCALE)
    draw_dropped(picture, SCALE, gone, 0.0, height)
    shown = texts(picture)
    assert {"f", "faceLexeme, line 7", "cannot create behavior"} <= set(shown)
    assert not any("line 7, /bml" in text for text in shown)
    assert sum(text.startswith("why not?") for text in shown) == 4
    assert all(0 < s.y < height for s in picture.shapes if isinstance(s, Text))
