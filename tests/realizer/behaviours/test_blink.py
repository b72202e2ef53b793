"""Tests of blink."""

from __future__ import annotations

import pytest

from realizer.tables.timing import gaps


@pytest.mark.parametrize(
    ("side", "lids", "open_"), [("BOTH", {19, 20}, set()), ("LEFT", {19}, {20}), ("RIGHT", {20}, {19})]
)
def test_blink_closes_and_opens_the_lids_of_its_side(
    play, side: str, lids: set[int], open_: set[int]
) -> None:
    played = play(f'<own:blink id="k" side="{side}" start="1"/>')
    times = played.times("k")
    for fap in lids:
        assert played.fap(fap, 0.99) == 0
        assert played.fap(fap, times["attackPeak"]) + played.fap(fap + 2, times["attackPeak"]) == 1024
        assert played.fap(fap, times["end"]) == 0
    for fap in open_:
        assert played.fap(fap, times["attackPeak"]) == 0


def test_blink_takes_the_time_of_a_blink(play) -> None:
    times = play('<own:blink id="k"/>').times("k")
    assert times["end"] == pytest.approx(sum(gap.preferred for gap in gaps("faceLexeme", "BLINK").gaps))
    assert times["end"] < 0.4


def test_blink_of_a_smaller_amount_is_partial(play) -> None:
    played = play('<own:blink id="k" amount="0.5" start="0" attackPeak="0.1" relax="0.3" end="0.5"/>')
    assert played.aus(0.2) == {"45L": 0.5, "45R": 0.5}
