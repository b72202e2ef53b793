"""A picture of panels."""

import numpy as np

from realizer.charts.scale import scale_of
from realizer.charts.shapes import Box, Path, Picture, Text
from realizer_studio.document_panels import MOST, Panel, panels


def drawn(*parts: Panel) -> Picture:
    return panels("Parts", parts, scale_of([]))


def texts(picture: Picture) -> list[str]:
    return [shape.text for shape in picture.shapes if isinstance(shape, Text)]


def test_panels_stand_below_each_other() -> None:
    picture = drawn(Panel("1 one", "first", ["a line"]), Panel("2 two", "second"))
    rows = {shape.text: shape.y for shape in picture.shapes if isinstance(shape, Text)}
    assert rows["1 one"] < rows["a line"] < rows["2 two"] < picture.height


def test_panels_count_the_lines_that_they_leave_out() -> None:
    found = texts(drawn(Panel("1", "", [f"line {k}" for k in range(MOST + 3)])))
    assert f"line {MOST - 1}" in found
    assert f"line {MOST}" not in found
    assert found[-1] == "and 3 more"


def test_panels_give_curves_the_colours_of_their_names() -> None:
    values = np.array([[0.0, 1.0], [2.0, -1.0]])
    picture = drawn(Panel("1", "", ["head", "up", "down"], values, np.array([0.0, 1.0])))
    colours = {shape.text: shape.colour for shape in picture.shapes if isinstance(shape, Text)}
    up, down = [shape for shape in picture.shapes if isinstance(shape, Path)][-2:]
    assert (up.colour, down.colour) == (colours["up"], colours["down"])
    assert up.points[1][1] < up.points[0][1]  # rises
    assert down.points[1][1] > down.points[0][1]


def test_panels_move_an_inset_below_the_lines() -> None:
    inset = Picture(100, 40, shapes=[Box(0, 0, 10, 10, "#ff0000"), Path(((0, 0), (5, 5)), "#00ff00")])
    picture = drawn(Panel("1", "", ["line"], inset=inset))
    line = next(shape.y for shape in picture.shapes if isinstance(shape, Text) and shape.text == "line")
    box = next(shape for shape in picture.shapes if isinstance(shape, Box) and shape.fill == "#ff0000")
    path = next(shape for shape in picture.shapes if isinstance(shape, Path) and shape.colour == "#00ff00")
    assert box.y > line
    assert path.points[0][1] == box.y
