"""Tests of links between sync points."""

import pytest

BLOCK = """<bml id="b"><wait id="w" start="1" duration="1"/><wait id="v" {} duration="1"/>{}</bml>"""


def of(block, behaviour):
    return next(line for line in block.rows if line.id == behaviour).links


def test_links_of_an_attribute_name_its_point(lines) -> None:
    (block,) = lines(BLOCK.format('start="w:end+0.5"', ""))
    (link,) = of(block, "v")
    assert (link.sync, link.kind, link.target, link.offset) == ("start", "attribute", "w:end", 0.5)
    assert (link.slack, link.binds, link.line) == (None, False, 1)


def test_links_of_a_number_name_the_block_s_start(lines) -> None:
    (block,) = lines(BLOCK.format("", ""))
    (link,) = of(block, "w")
    assert (link.sync, link.target, link.offset) == ("start", None, 1.0)


def test_links_of_a_timed_sync_in_speech(lines) -> None:
    (block,) = lines(
        '<bml id="b"><wait id="w" start="3" duration="1"/>'
        '<speech id="s"><text>now <sync id="t" ref="w:start"/> then</text></speech></bml>'
    )
    (link,) = of(block, "s")
    assert (link.sync, link.kind, link.target) == ("t", "text", "w:start")


def test_links_of_synchronize_tie_all_points_to_the_first(lines) -> None:
    said = (
        '<constraint id="c"><synchronize>'
        '<sync ref="w:end+0.2"/><sync ref="v:start+0.5"/></synchronize></constraint>'
    )
    (block,) = lines(BLOCK.format("", said))
    (link,) = of(block, "v")
    assert (link.kind, link.target, link.constraint) == ("synchronize", "w:end", "c")
    assert link.offset == pytest.approx(-0.3)
    start = next(p.time for line in block.rows for p in line.points if line.id == "v")
    assert start == pytest.approx(2.0 + link.offset)


def test_links_of_synchronize_with_a_number_are_the_point_s(lines) -> None:
    said = '<constraint><synchronize><sync ref="3"/><sync ref="v:start"/></synchronize></constraint>'
    (block,) = lines(BLOCK.format("", said))
    (link,) = of(block, "v")
    assert (link.sync, link.target, link.offset) == ("start", None, 3.0)


@pytest.mark.parametrize(
    ("said", "slack"),
    [
        ('<before ref="w:end"><sync ref="v:start"/></before>', 2.0),
        ('<before ref="w:end-1.5"><sync ref="v:start"/></before>', 0.5),
        ('<before ref="w:end"><sync ref="v:start+0.25"/></before>', 1.75),
        ('<after ref="w:end"><sync ref="v:start"/></after>', 0.0),
        ('<before ref="7"><sync ref="v:end"/></before>', 6.0),
    ],
)
def test_links_of_before_and_after_have_slack(lines, said: str, slack: float) -> None:
    (block,) = lines(BLOCK.format("", f"<constraint>{said}</constraint>"))
    (link,) = of(block, "v")
    assert link.slack == pytest.approx(slack, abs=1e-9)
    assert link.binds == (slack == 0.0)


def test_links_to_another_block_are_the_own_point_s(lines) -> None:
    _, block = lines(
        '<bml id="a"><wait id="x" duration="3"/></bml>',
        '<bml id="b"><wait id="w" start="1" duration="1"/>'
        '<constraint><after ref="w:end"><sync ref="a:x:end"/></after></constraint></bml>',
    )
    link = of(block, "w")[1]
    assert (link.sync, link.kind, link.target) == ("end", "before", "a:x:end")
    assert link.slack == pytest.approx(1.0)
    assert link.to_json() == {
        "sync": "end",
        "kind": "before",
        "to": "a:x:end",
        "offset": 0.0,
        "slack": 1.0,
        "line": 1,
        "required": False,
    }
