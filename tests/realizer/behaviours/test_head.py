"""Tests of head and headDirectionShift."""

import numpy as np
import pytest

from realizer.tables.lexemes import head_lexemes
from tests.realizer.behaviours.elements import at, check, degrees, expand, keys, timing

SEVEN = (0.0, 0.2, 0.2, 0.5, 0.8, 0.8, 1.0)


def test_head_nod_is_lowest_at_its_stroke() -> None:
    nod = expand('<head id="x" lexeme="nod" amount="1"/>', SEVEN)
    times = np.linspace(0, 1, 1001)
    pitch = np.array(degrees(nod, "head", *times))[:, 1]
    assert times[pitch.argmin()] == pytest.approx(0.5, abs=0.005)
    assert pitch[500] == pytest.approx(-head_lexemes()["NOD"].stroke[54], abs=1e-3)
    assert pitch[0] == pitch[-1] == 0
    assert pitch.max() > 0  # the head comes up a little before it goes down


def test_head_nod_leaves_the_eyes_on_their_target() -> None:
    nod = expand('<head id="x" lexeme="NOD" amount="1"/>', SEVEN)
    head, eyes = degrees(nod, "head", 0.5)[0][1], degrees(nod, "eyes", 0.5)[0][1]
    assert eyes == pytest.approx(-head_lexemes()["NOD"].eyes * head, abs=1e-3)
    assert degrees(nod, "eyes", 1.0) == [(0, 0)]


def test_head_repetition_has_a_numbered_stroke_for_each_nod() -> None:
    element = '<head id="x" lexeme="NOD" repetition="3" amount="1"/>'
    wanted = timing(element)
    assert wanted.points == (
        *("start", "ready", "strokeStart", "stroke:1", "stroke:2", "stroke:3"),
        *("stroke", "strokeEnd", "relax", "end"),
    )
    times = dict(zip(wanted.points, keys(wanted), strict=True))

    def pitch(t: float) -> float:
        return degrees(expand(element), "head", t)[0][1]

    for k in (1, 2, 3):
        here = times[f"stroke:{k}"]
        assert pitch(here) < pitch(here - 0.05)
        assert pitch(here) < pitch(here + 0.05)
    assert times["stroke"] == times["stroke:3"]
    assert pitch((times["stroke:1"] + times["stroke:2"]) / 2) == pytest.approx(0, abs=1e-3)


def test_head_shake_goes_to_one_side_and_then_to_the_other() -> None:
    shake = expand('<head id="x" lexeme="SHAKE" amount="1"/>', SEVEN)
    (first, _), (second, _), (rest, _) = degrees(shake, "head", 0.5, 0.8, 1.0)
    assert first > 10
    assert second < -10
    assert rest == 0


def test_head_tilt_is_held_from_stroke_to_relax() -> None:
    tilt = expand('<head id="x" lexeme="TILT" amount="1"/>', (0, 0.1, 0.1, 0.5, 0.7, 1.5, 2))
    stroke, held, relax, end = at(tilt, "55", 0.5, 1.0, 1.5, 2.0)
    assert stroke > held == relax > 0.3
    assert end == 0


def test_head_amount_scales_a_nod() -> None:
    half = degrees(expand('<head id="x" lexeme="NOD"/>', SEVEN), "head", 0.5)[0][1]
    full = degrees(expand('<head id="x" lexeme="NOD" amount="1"/>', SEVEN), "head", 0.5)[0][1]
    assert half == pytest.approx(full / 2, abs=1e-3)


def test_head_refuses_an_unknown_lexeme() -> None:
    (fault,) = check('<head id="x" lexeme="NODD"/>')
    assert fault.fatal
    assert "NOD" in fault.text


def test_head_direction_shift_turns_to_its_target_and_stays() -> None:
    turned = expand('<headDirectionShift id="x" target="-1,0,1"/>', (0, 1))
    assert degrees(turned, "head", 5)[0] == pytest.approx((-45, 0), abs=0.01)
    behind = expand('<headDirectionShift id="x" target="0.1,0,-1"/>', (0, 1))
    assert degrees(behind, "head", 5)[0] == pytest.approx((60, 0), abs=0.01)
