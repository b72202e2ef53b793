"""Tests of charts as SVG."""

from xml.etree import ElementTree

import pytest

from realizer.charts.shapes import Box, Path, Picture, Text
from realizer.charts.svg import svg

SVG = "{http://www.w3.org/2000/svg}"


def tree(*shapes, title: str = "t") -> ElementTree.Element:
    return ElementTree.fromstring(svg(Picture(100, 50, title, shapes=list(shapes))).encode())


def test_svg_keeps_the_order_of_shapes_and_puts_text_last() -> None:
    root = tree(Text(1, 2, "x", 10, "#000"), Box(0, 0, 5, 5, "#111"), Path(((0, 0), (1, 1)), "#222"))
    assert [child.tag.removeprefix(SVG) for child in root] == ["title", "rect", "rect", "polyline", "text"]
    assert (root.get("viewBox"), root.get("width")) == ("0 0 100 50", "100")


@pytest.mark.parametrize("text", ["<b> & \"q\" 'r'", "a\x00b\x1f", "頷く", "\ud800", "]]>"])
def test_svg_of_any_text_is_well_formed(text: str) -> None:
    root = tree(Text(1, 2, text, 10, "#000"), Box(0, 0, 5, 5, tip=text), title=text)
    shown = root.find(f"{SVG}text")
    assert shown is not None
    assert len(shown.text or "") == len(text)


def test_svg_text_has_its_measured_length() -> None:
    root = tree(Text(1, 2, "attackPeak", 10, "#000"), Text(1, 2, "頷く", 10, "#000"))
    measured, guessed = root.findall(f"{SVG}text")
    assert float(measured.get("textLength", 0)) > 30
    assert guessed.get("textLength") is None


def test_svg_of_a_filled_path_is_a_polygon_with_a_tip() -> None:
    root = tree(Path(((0, 0), (4, 0), (2, 3)), fill="#333", tip="held"))
    polygon = root.find(f"{SVG}polygon")
    assert polygon is not None
    assert (polygon.get("points"), polygon.findtext(f"{SVG}title")) == ("0,0 4,0 2,3", "held")
