"""Tests of the whole chart."""

import itertools
from pathlib import Path

import pytest

import realizer.examples
from realizer.charts.diverging_scale import RIGID, colour_of
from realizer.charts.picture import draw_legend, timeline
from realizer.charts.scale import scale_of
from realizer.charts.shapes import Box, Picture, Text, width_of
from realizer.charts.shapes import Path as Curve


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
    end = draw_legend(picture, scale_of(blocks), 0.0, blocks)
    shown = {shape.text for shape in picture.shapes if isinstance(shape, Text)}
    assert shown - {"length of gaps", "33%", "as preferred", "300%"} == marks
    assert all(shape.y < end for shape in picture.shapes if isinstance(shape, Text))


EXAMPLES = sorted(Path(realizer.examples.__path__[0]).glob("*.bml"))
CLASHES = """<bml id="b">
  <speech id="s"><text>This is <sync id="t"/> more than fits</text></speech>
  <head id="n" lexeme="NOD" stroke="s:t"/>
  <faceLexeme id="f" lexeme="GRIN"/>
  <gaze id="g" target="x" start="2" ready="1"/>
  <wait id="w" start="0.2" duration="1"/>
  <constraint id="c"><before ref="s:end"><sync ref="w:end"/></before></constraint>
</bml>"""


def texts(picture: Picture) -> list[str]:
    return [shape.text for shape in picture.shapes if isinstance(shape, Text)]


def span(text: Text) -> tuple[float, float]:
    wide = width_of(text.text, text.size)
    left = text.x - {"start": 0.0, "middle": wide / 2, "end": wide}[text.anchor]
    return left, left + wide


def check(picture: Picture) -> None:
    """Everything is inside, and names and numbers of one height do not lie on each other."""
    for shape in picture.shapes:
        match shape:
            case Box():
                assert 0 <= shape.x <= shape.x + shape.width <= picture.width
                assert 0 <= shape.y <= shape.y + shape.height <= picture.height
            case Curve():
                assert all(0 <= x <= picture.width and 0 <= y <= picture.height for x, y in shape.points)
            case Text():
                assert span(shape)[0] >= 0
                assert span(shape)[1] <= picture.width
                assert 0 < shape.y < picture.height
    rows: dict[float, list[Text]] = {}
    for shape in picture.shapes:
        if isinstance(shape, Text):
            rows.setdefault(shape.y, []).append(shape)
    for row in rows.values():
        spans = sorted(map(span, row))
        assert all(a[1] <= b[0] + 1 for a, b in itertools.pairwise(spans)), row


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_timeline_of_the_examples_is_readable(lines, path: Path) -> None:
    blocks = lines(path.read_text())
    picture = timeline(blocks)
    check(picture)
    assert {line.id for block in blocks for line in block.rows} <= set(texts(picture))


def test_timeline_groups_behaviours_by_kind(lines) -> None:
    picture = timeline(lines(CLASHES))
    check(picture)
    ids = [t.text for t in sorted((s for s in picture.shapes if isinstance(s, Text)), key=lambda t: t.y)]
    assert [id for id in ids if id in ("s", "n", "w")] == ["s", "n", "w"]
    assert {"speech", "head", "other"} <= set(ids)


def test_timeline_shows_dropped_behaviours_with_reasons(lines) -> None:
    shown = texts(timeline(lines(CLASHES)))
    assert {"f", "g", "cannot create behavior", "impossible to schedule", "dropped, and why"} <= set(shown)
    assert any(text.startswith("g cannot be placed: g:ready = 1") for text in shown)


def test_timeline_has_a_background_from_start_to_end_of_a_block(lines) -> None:
    blocks = lines('<bml id="b"><wait id="w" start="1" duration="2"/></bml>')
    picture, scale = timeline(blocks), scale_of(blocks)
    assert any(
        isinstance(shape, Box) and shape.x == scale.x(0) and shape.x + shape.width == scale.x(3)
        for shape in picture.shapes
    )


def test_timeline_colours_gaps_at_their_time(lines) -> None:
    blocks = lines(
        '<bml id="b"><head id="n" lexeme="NOD" start="0" end="3"/>'
        '<speech id="s"><text>Hello <sync id="t"/> there</text></speech></bml>'
    )
    picture, scale = timeline(blocks), scale_of(blocks)
    boxes = {(round(s.x, 3), s.fill): s.width for s in picture.shapes if isinstance(s, Box)}
    speech, nod = sorted(blocks[0].rows, key=lambda line: line.element == "head")
    for line in (speech, nod):
        for gap, point in zip(line.gaps, line.points, strict=False):
            if not gap.rigid and not gap.preferred:
                continue
            fill = RIGID if gap.rigid else colour_of(gap.stretch or 0)
            assert boxes[round(scale.x(point.time), 3), fill] == pytest.approx(gap.actual * scale.second)


def test_timeline_shows_words_at_their_time(lines) -> None:
    blocks = lines(CLASHES)
    picture, scale = timeline(blocks), scale_of(blocks)
    for word in blocks[0].rows[0].words:
        shown = next(s for s in picture.shapes if isinstance(s, Text) and s.text == word.text)
        assert shown.x == pytest.approx(scale.x((word.start + word.end) / 2))


def test_timeline_cuts_words_that_do_not_fit(lines) -> None:
    blocks = lines(
        '<bml id="b"><speech id="s"><text>One two three four five six seven <sync id="t"/> eight</text>'
        '</speech><wait id="w" duration="60"/></bml>'
    )
    picture = timeline(blocks)
    check(picture)
    assert any(text.startswith("One two") for text in texts(picture))


def test_timeline_of_a_crowd_is_readable(lines) -> None:
    rows = "".join(
        f'<faceLexeme id="a_very_long_identifier_of_a_behaviour_{i}" lexeme="SMILE" '
        f'start="{0.3 * i:.1f}" attackPeak="{0.3 * i + 0.02 * i:.2f}"/>'
        for i in range(40)
    )
    picture = timeline(lines(f'<bml id="b">{rows}</bml>'))
    check(picture)
    names = [text for text in texts(picture) if text.startswith("a_very_")]
    assert len(set(names)) == 40


def test_timeline_puts_blocks_below_each_other_on_one_clock(lines) -> None:
    blocks = lines(
        '<bml id="first"><wait id="w" duration="2"/></bml>',
        '<bml id="second" composition="APPEND"><wait id="v" start="first:w:start+2.5" duration="1"/></bml>',
        '<bml id="third" xmlns:bmla="http://www.asap-project.org/bmla" bmla:preplan="true">'
        '<wait id="x" duration="1"/></bml>',
        '<bml id="fourth"><required><head id="n" lexeme="NOD" end="0.01"/></required></bml>',
    )
    picture = timeline(blocks)
    check(picture)
    at = {s.text: s.y for s in picture.shapes if isinstance(s, Text)}
    assert at["first"] < at["second"] < at["third"] < at["fourth"]
    assert {"pending", "failed", "not started: 1.00 s long"} <= set(at)


def test_timeline_of_nothing_is_a_picture() -> None:
    picture = timeline([])
    assert picture.title == "Timeline of nothing"
    assert picture.height > 0
