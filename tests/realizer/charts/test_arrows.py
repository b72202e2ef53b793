"""Tests of the arrows of a chart."""

import pytest

from realizer.charts.diverging_scale import HELD, LINK, ROOM, TIGHT
from realizer.charts.picture import timeline
from realizer.charts.scale import scale_of
from realizer.charts.shapes import Box, Path, Text

TIED = """<bml id="b"><wait id="w" start="1" duration="1"/><head id="n" lexeme="NOD" {}/>{}</bml>"""


def drawn(lines, document: str):
    blocks = lines(document)
    return timeline(blocks), scale_of(blocks), {line.id: line for line in blocks[0].rows}


def paths(picture, colour: str) -> list[Path]:
    """Lines that are not in the legend."""
    return [s for s in picture.shapes if isinstance(s, Path) and s.colour == colour and s.tip]


def dots(picture) -> list[Box]:
    return [s for s in picture.shapes if isinstance(s, Box) and s.fill == LINK and s.tip]


@pytest.mark.parametrize("offset", ["", "+0.5", "-0.25"])
def test_arrows_curves_to_the_point_that_follows(lines, offset: str) -> None:
    picture, scale, by_id = drawn(lines, TIED.format(f'stroke="w:end{offset}"', ""))
    (curve,) = paths(picture, LINK)
    stroke = next(p.time for p in by_id["n"].points if p.name == "stroke")
    assert curve.points[0][0] == pytest.approx(scale.x(2.0))
    assert curve.points[-1][0] == pytest.approx(scale.x(stroke))
    texts = [s.text for s in picture.shapes if isinstance(s, Text)]
    assert (offset in texts) or not offset


FIRST = """<bml id="b"><wait id="w" start="n:end" duration="1"/><head id="n" lexeme="NOD"/></bml>"""


@pytest.mark.parametrize("document", [TIED.format('stroke="w:end"', ""), FIRST], ids=["down", "up"])
def test_arrows_ends_a_reference_in_an_arrow_of_its_curve(lines, document: str) -> None:
    picture, _, _ = drawn(lines, document)
    (curve,) = paths(picture, LINK)
    begin, end = curve.points[0], curve.points[-1]
    (arrow,) = [s for s in picture.shapes if isinstance(s, Path) and s.fill == LINK and s.points[0] == end]
    back = {y for _, y in arrow.points[1:]}
    assert all(abs(y - begin[1]) < abs(end[1] - begin[1]) for y in back)
    assert [s.x + s.width / 2 for s in dots(picture)] == pytest.approx([begin[0]])


def test_arrows_ends_a_synchronize_in_dots(lines) -> None:
    said = '<constraint><synchronize ref="w:end"><sync ref="n:stroke"/></synchronize></constraint>'
    picture, _, _ = drawn(lines, TIED.format("", said))
    (curve,) = paths(picture, LINK)
    ends = sorted([curve.points[0], curve.points[-1]])
    assert sorted((s.x + s.width / 2, s.y + s.height / 2) for s in dots(picture)) == [
        pytest.approx(end) for end in ends
    ]
    assert not [s for s in picture.shapes if isinstance(s, Path) and s.fill == LINK and s.points[0] in ends]


def test_arrows_writes_an_offset_beside_the_bar_it_belongs_to(lines) -> None:
    for sync in ("start", "end"):
        picture, _, _ = drawn(lines, TIED.format(f'{sync}="w:end+0.5"', ""))
        (curve,) = paths(picture, LINK)
        (offset,) = [s for s in picture.shapes if isinstance(s, Text) and s.text == "+0.5"]
        assert (offset.x < curve.points[-1][0]) == (offset.anchor == "end") == (sync == "end"), sync


def test_arrows_draws_no_arrow_to_itself(lines) -> None:
    picture, _, _ = drawn(lines, '<bml id="b"><head id="n" lexeme="NOD" end="n:start+2"/></bml>')
    assert not paths(picture, LINK)
    assert not dots(picture)


def test_arrows_pins_a_point_at_a_time(lines) -> None:
    picture, scale, _ = drawn(lines, TIED.format('start="0.5"', ""))
    tips = [s.points[0][0] for s in picture.shapes if isinstance(s, Path) and s.fill == HELD and s.tip]
    assert sorted(tips) == pytest.approx([scale.x(0.5), scale.x(1.0)])


@pytest.mark.parametrize(
    ("said", "bound"),
    [
        ('<before ref="w:end"><sync ref="n:start"/></before>', 2.0),
        ('<after ref="w:start"><sync ref="n:start"/></after>', 1.0),
    ],
)
def test_arrows_hatches_the_slack(lines, said: str, bound: float) -> None:
    document = TIED.format('start="1.6"', f"<constraint>{said}</constraint>")
    picture, scale, _ = drawn(lines, document)
    (strip,) = [s for s in picture.shapes if isinstance(s, Box) and s.tip.endswith("s left")]
    ends = sorted((scale.x(1.6), scale.x(bound)))
    assert [strip.x, strip.x + strip.width] == pytest.approx(ends)
    assert f"{abs(bound - 1.6):.3f} s left" in strip.tip
    assert paths(picture, ROOM)


def test_arrows_colours_an_order_that_binds(lines) -> None:
    said = '<constraint><after ref="w:end"><sync ref="n:start"/></after></constraint>'
    picture, _, _ = drawn(lines, TIED.format("", said))
    assert all(line.tip.endswith("binds") for line in paths(picture, TIGHT))
    assert paths(picture, TIGHT)
    assert not paths(picture, ROOM)


def test_arrows_names_a_block_outside_the_picture(lines) -> None:
    blocks = lines(
        '<bml id="a"><wait id="x" duration="1"/></bml>',
        '<bml id="b"><wait id="w" start="a:x:end" duration="1"/></bml>',
    )
    alone, both = timeline(blocks[1:]), timeline(blocks)
    assert "a:x:end" in [s.text for s in alone.shapes if isinstance(s, Text)]
    assert "a:x:end" not in [s.text for s in both.shapes if isinstance(s, Text)]
    assert paths(both, LINK)
