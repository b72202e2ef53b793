"""Tests of the legend."""

from __future__ import annotations

import pytest

from realizer.charts.legend import draw
from realizer.charts.scale import scale_of
from realizer.charts.shapes import Picture, Text


@pytest.mark.parametrize(
    ("body", "marks"),
    [
        ('<wait id="w" duration="1"/>', set()),
        ('<wait id="w" start="1" duration="1"/>', {"held at a time"}),
        ('<speech id="s"><text>Hi</text></speech>', {"cannot give way"}),
        (
            '<wait id="w" duration="1"/><head id="n" lexeme="NOD" start="w:end"/>',
            {"follows another point"},
        ),
        ('<head id="n" lexeme="NONE"/>', {"dropped, and why"}),
        (
            '<wait id="w" duration="1"/><wait id="v" duration="1"/><constraint>'
            '<after ref="w:end"><sync ref="v:start"/></after>'
            '<before ref="9"><sync ref="v:end"/></before></constraint>',
            {"binds", "room before it binds"},
        ),
    ],
)
def test_legend_explains_only_marks_that_the_picture_has(lines, body: str, marks: set[str]) -> None:
    blocks = lines(f'<bml id="b">{body}</bml>')
    picture = Picture(1200)
    end = draw(picture, scale_of(blocks), 0.0, blocks)
    shown = {shape.text for shape in picture.shapes if isinstance(shape, Text)}
    assert shown - {"length of gaps", "33%", "as preferred", "300%"} == marks
    assert all(shape.y < end for shape in picture.shapes if isinstance(shape, Text))
