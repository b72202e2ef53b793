"""Tests of the chart data of blocks that play."""

import json
import math

import pytest

from bml_schema import parse
from realizer.behaviours.registry import VOCABULARY
from realizer.charts.chart_data import charts_of
from realizer.core.options import PlayOptions
from realizer.playback.player import Player

TALK = """<bml id="b">
  <speech id="s"><text>Hello <sync id="t"/> there</text></speech>
  <head id="n" lexeme="NOD" start="s:t" end="s:t+2"/>
  <required><faceLexeme id="f" lexeme="SMILE" attackPeak="1"/></required>
</bml>"""


def test_chart_points_have_times_on_both_clocks(lines) -> None:
    first, second = lines(
        '<bml id="a"><wait id="w" duration="2"/></bml>',
        '<bml id="b" composition="APPEND"><head id="n" lexeme="NOD" start="0.5"/></bml>',
    )
    assert (first.start, first.end) == (0.0, 2.0)
    assert second.start == 2.0
    assert second.rows[0].points[0] == ("start", 0.5, 2.5)


def test_chart_gaps_have_actual_and_preferred_lengths(lines) -> None:
    (block,) = lines(TALK)
    nod = block.rows[1]
    assert [(g.begin, g.end) for g in nod.gaps] == [
        (a.name, b.name) for a, b in zip(nod.points[:-1], nod.points[1:], strict=True)
    ]
    assert math.isclose(sum(g.actual for g in nod.gaps), 2.0)
    moved = [g for g in nod.gaps if g.preferred]
    assert all(g.stretch == pytest.approx(g.actual / g.preferred) and g.stretch > 1 for g in moved)
    assert all(g.cost == pytest.approx(g.stiffness * (g.actual - g.preferred) ** 2) for g in moved)
    free = block.rows[2]
    assert [g.stretch for g in free.gaps] == pytest.approx([1.0] * 3)
    assert (free.required, nod.required) == (True, False)


def test_chart_costs_add_up_to_the_scheduler_s() -> None:
    player = Player(PlayOptions(idle=False))
    block = parse('<bml id="b"><head id="n" lexeme="NOD" start="0" end="4"/></bml>', VOCABULARY)
    schedule = player.submit(block, 0.0)
    assert schedule.cost > 0
    assert charts_of(player.blocks, [schedule])[0].cost == pytest.approx(schedule.cost)


def test_chart_of_speech_is_rigid_and_has_words(lines) -> None:
    speech = lines(TALK.replace("<text>", "<text>Well, "))[0].rows[0]
    assert [w.text for w in speech.words] == ["Well", "Hello", "there"]
    assert all(g.rigid and g.actual == pytest.approx(g.preferred) and g.cost == 0 for g in speech.gaps)
    assert speech.points[1].time == pytest.approx(speech.words[2].start)


def test_chart_of_dropped_behaviours_has_element_and_line(lines) -> None:
    (block,) = lines(
        """<bml id="b">
        <faceLexeme id="f" lexeme="NOPE"/>
        <head id="n" lexeme="NOD" amount="much"/>
        <head id="early" lexeme="NOD" end="0.01"/>
        <head id="ok" lexeme="NOD"/>
        </bml>"""
    )
    assert [line.id for line in block.rows] == ["ok"]
    found = {d.id: d for d in block.dropped}
    assert {id: (d.element, d.line) for id, d in found.items()} == {
        "f": ("faceLexeme", 2),
        "n": ("head", 3),
        "early": ("head", 4),
    }
    assert found["f"].type == "CANNOT_CREATE_BEHAVIOR"
    assert found["n"].type == "PARSING_FAILURE"
    assert "at least" in found["early"].text


def test_chart_lists_a_constraint_that_does_not_hold(lines) -> None:
    (block,) = lines(
        """<bml id="b"><wait id="w" start="0" duration="1"/><wait id="v" start="2" duration="1"/>
        <constraint id="c"><before ref="w:start"><sync ref="v:start"/></before></constraint></bml>"""
    )
    assert [d.id for d in block.dropped] == ["c"]
    assert [line.id for line in block.rows] == ["w", "v"]


def test_chart_of_a_refused_block_has_only_its_reason(lines) -> None:
    (block,) = lines('<bml id="b"><required><head id="n" lexeme="NOD" end="0.01"/></required></bml>')
    assert (block.state, block.rows) == ("FAILED", ())
    assert [d.type for d in block.dropped] == ["IMPOSSIBLE_TO_SCHEDULE"]


def test_chart_of_a_preplanned_block_has_no_start(lines) -> None:
    (block,) = lines(
        '<bml id="b" xmlns:bmla="http://www.asap-project.org/bmla" bmla:preplan="true">'
        '<head id="n" lexeme="NOD"/></bml>'
    )
    assert (block.state, block.start, block.end) == ("PENDING", None, None)
    assert block.rows[0].points[0] == ("start", 0.0, None)
    json.dumps(block.to_json(), allow_nan=False)
    json.dumps(block.detail(), allow_nan=False)


def test_chart_lists_behaviours_that_ended_before_they_began(lines) -> None:
    ended, new = lines(
        '<bml id="a"><head id="n" lexeme="NOD" start="1"/></bml>',
        '<bml id="b" composition="REPLACE"><wait id="w" duration="1"/></bml>',
    )
    assert ended.rows == ()
    assert [(d.id, d.element, d.type) for d in ended.dropped] == [("n", "head", "REVOKED")]
    assert new.state == "LURKING"


def test_chart_of_a_revoked_block_lists_its_behaviours_as_cut_off() -> None:
    player = Player(PlayOptions(idle=False))
    preplan = 'xmlns:bmla="http://www.asap-project.org/bmla" bmla:preplan="true"'
    block = parse(f'<bml id="a" {preplan}><head id="n" lexeme="NOD"/></bml>', VOCABULARY)
    schedule = player.submit(block, 0.0)
    player.stop(0.5)
    (line,) = charts_of(player.blocks, [schedule])
    assert line.state == "REVOKED"
    assert [(d.id, d.element, d.type) for d in line.dropped] == [("n", "head", "REVOKED")]


def test_chart_of_a_behaviour_cut_off_keeps_what_has_passed() -> None:
    player = Player(PlayOptions(idle=False))
    block = parse('<bml id="b"><gaze id="g" target="x" start="0" end="4"/></bml>', VOCABULARY)
    schedule = player.submit(block, 0.0)
    player.due(2.0)
    player.stop(2.0)
    (line,) = charts_of(player.blocks, [schedule])
    assert (line.state, line.end) == ("INTERRUPTED", 2.0)
    gaze = line.rows[0]
    assert (gaze.points[-1].name, gaze.points[-1].time) == ("end", 2.0)
    assert all(g.preferred is None and g.cost == 0 for g in gaze.gaps)
