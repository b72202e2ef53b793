"""Gaze shifts of documents."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bml_schema import parse
from realizer.animation.axis import au
from realizer.animation.idle.gaze_shifts import gaze_shifts
from realizer.behaviours.registry import VOCABULARY
from realizer.core.options import PlayOptions
from realizer.playback.player import Player

PLACES = {"left": (1.0, 0.0, 1.0), "right": (-0.5, 0.0, 1.0)}


def shifts_of(document: str, start: float = 0.0, end: float = 20.0) -> list[tuple[float, int]]:
    player = Player(PlayOptions(scene=PLACES, idle=False))
    player.submit(parse(f'<bml id="b">{document}</bml>', VOCABULARY), 0.0)
    channels, _ = player.motion(np.array([start, end]))
    return [(shift.at, round(shift.degrees)) for shift in gaze_shifts(channels, start, end)]


def test_gaze_shifts_are_the_turns_to_a_target_and_back() -> None:
    gaze = '<gaze id="a" target="left" start="1" ready="2" relax="5" end="6"/>'
    assert shifts_of(gaze) == [(1.0, 45), (5.0, 45)]
    assert shifts_of(gaze, 4.0) == [(5.0, 45)]
    assert shifts_of(gaze, 5.5) == [(5.0, 45)]
    assert shifts_of(gaze, 0.0, 0.9) == shifts_of(gaze, 7.5) == []


def test_gaze_shifts_include_lasting_ones_in_order_of_time() -> None:
    found = shifts_of(
        '<gaze id="a" target="right" start="3" relax="6" end="7"/>'
        '<gazeShift id="b" target="left" start="1" end="2"/>'
    )
    assert found == [(1.0, 45), (3.0, round(math.degrees(math.atan(0.5)))), (6.0, 27)]


def test_gaze_shifts_ignore_heads_that_nod_and_faces() -> None:
    assert shifts_of('<head id="h" lexeme="NOD"/><faceLexeme id="f" lexeme="SMILE"/>') == []


@pytest.mark.parametrize(("liveliness", "blinks"), [(0.0, False), (1.0, True)])
def test_gaze_shifts_of_over_33_degrees_come_with_a_blink(liveliness: float, blinks: bool) -> None:
    player = Player(PlayOptions(scene=PLACES, liveliness=liveliness))
    gaze = '<gaze id="a" target="left" start="1" ready="1.6" relax="5" end="6"/>'
    player.submit(parse(f'<bml id="b">{gaze}</bml>', VOCABULARY), 0.0)
    lids = player.frames(1.0 + np.arange(0.0, 0.3, 0.01)).values[:, au(45)[0].column]
    assert (lids.max() > 0.4) == blinks
