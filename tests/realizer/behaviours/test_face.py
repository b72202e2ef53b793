"""Tests of faceLexeme, faceFacs, face and faceShift."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.animation.axis import AU_NAMES
from realizer.animation.blend import blend
from realizer.tables.lexemes import face_lexemes
from tests.realizer.behaviours.elements import at, check, expand
from tests.rows import each_row

FOUR = (1.0, 1.4, 2.4, 3.0)


def test_face_lexeme_holds_its_amount_from_attack_peak_to_relax() -> None:
    smile = expand('<faceLexeme id="x" lexeme="smile" amount="0.5"/>', FOUR)
    full = face_lexemes()["SMILE"].aus[12, "BOTH"]
    assert at(smile, "12L", 0.99, 1.0, 1.4, 2.0, 2.4, 3.0) == pytest.approx(
        [0, 0, full / 2, full / 2, full / 2, 0], abs=1e-5
    )
    assert at(smile, "12R", 1.4) == at(smile, "12L", 1.4)


def test_face_facs_overshoots_at_attack_peak_and_settles() -> None:
    brow = expand('<ext:faceFacs id="x" au="4" side="LEFT" amount="0.5" overshoot="0.4"/>', FOUR)
    peak, settled, relax = at(brow, "4L", 1.4, 1.65, 2.4)
    assert peak == pytest.approx(0.7)
    assert settled == relax == pytest.approx(0.5)
    assert at(brow, "4R", 1.4) == [0]


def test_face_lexeme_of_one_side_moves_one_side() -> None:
    assert at(expand('<faceLexeme id="x" lexeme="RAISE_LEFT_BROW" amount="1"/>', FOUR), "2R", 1.4) == [0]
    assert at(expand('<faceLexeme id="x" lexeme="RAISE_LEFT_BROW" amount="1"/>', FOUR), "2L", 1.4) == [1]


@each_row("lexeme", sorted(face_lexemes()))
def test_face_lexeme_shows_exactly_its_action_units(lexeme: str) -> None:
    channels = expand(f'<faceLexeme id="x" lexeme="{lexeme.lower()}" amount="1"/>', FOUR)
    values = blend(channels, np.array([1.4])).aus[0]
    shown = {AU_NAMES()[k].rstrip("LR") for k in np.flatnonzero(values)}
    assert shown == {str(au) for au, _ in face_lexemes()[lexeme].aus}


def test_face_scales_its_parts_and_shows_the_stronger() -> None:
    face = expand(
        '<face id="x" amount="0.5"><faceLexeme lexeme="RAISE_MOUTH_CORNERS" amount="1"/>'
        '<ext:faceFacs au="12" amount="0.4"/><ext:faceFacs au="26" amount="0.8"/></face>',
        FOUR,
    )
    assert at(face, "12L", 1.4) == [0.5]
    assert at(face, "26", 1.4) == pytest.approx([0.4])


def test_face_shift_stays() -> None:
    mood = expand('<faceShift id="x" amount="1"><ext:faceFacs au="12" amount="0.3"/></faceShift>', (1, 2))
    assert at(mood, "12L", 1, 2, 100) == pytest.approx([0, 0.3, 0.3])


def test_face_lexeme_suggests_known_names_for_an_unknown_one() -> None:
    (fault,) = check('<faceLexeme id="x" lexeme="SMILLE"/>')
    assert fault.type == "CANNOT_CREATE_BEHAVIOR"
    assert fault.fatal
    assert "SMILE" in fault.text
    assert "'SMILLE'" in fault.text


def test_face_facs_refuses_an_unknown_action_unit_also_inside_a_face() -> None:
    for element in (
        '<ext:faceFacs id="x" au="3"/>',
        '<face id="x"><ext:faceFacs au="3"/></face>',
        '<faceShift id="x"><ext:faceFacs au="3"/></faceShift>',
    ):
        (fault,) = check(element)
        assert fault.type == "CANNOT_CREATE_BEHAVIOR"
        assert "got 3" in fault.text
        assert "4 (Brow lowerer)" in fault.text


def test_face_facs_warns_of_a_side_of_an_action_unit_without_sides() -> None:
    (fault,) = check('<ext:faceFacs id="x" au="26" side="LEFT"/>')
    assert not fault.fatal
    assert at(expand('<ext:faceFacs id="x" au="26" side="LEFT" amount="1"/>', FOUR), "26", 1.4) == [1]


@pytest.mark.parametrize(("au", "side"), [(12, "LEFT"), (12, "BOTH"), (26, "BOTH")])
def test_face_facs_accepts_the_sides_of_an_action_unit(au: int, side: str) -> None:
    assert check(f'<ext:faceFacs id="x" au="{au}" side="{side}"/>') == ()
