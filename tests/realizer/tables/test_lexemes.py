"""Tests of `realizer.tables.lexemes`."""

import re

import pytest

from realizer.core.errors import TableError
from realizer.tables import au_to_fap, by_number
from realizer.tables.lexemes import HeadLexeme, face_lexemes, head_lexemes, read_aus
from tests.rows import each_row

BROWS = tuple(f"{way}_{brow}" for way in ("RAISE", "LOWER") for brow in ("BROWS", "LEFT_BROW", "RIGHT_BROW"))
CORNERS = tuple(
    f"{way}_{corner}"
    for way in ("RAISE", "LOWER")
    for corner in ("MOUTH_CORNERS", "LEFT_MOUTH_CORNER", "RIGHT_MOUTH_CORNER")
)
STANDARD = (*BROWS, *CORNERS, "OBLIQUE_BROWS", "OPEN_MOUTH", "OPEN_LIPS", "WIDEN_EYES", "CLOSE_EYES")

EMOTIONS = ("ANGER", "DISGUST", "FEAR", "HAPPINESS", "JOY", "SADNESS", "SURPRISE")


def test_face_lexemes_have_those_of_the_standard_and_the_emotions() -> None:
    assert len(STANDARD) == 17
    assert {*STANDARD, *EMOTIONS, "SMILE", "BLINK"} <= set(face_lexemes())
    assert {"NOD", "SHAKE", "TILT"} <= set(head_lexemes())


def test_face_lexemes_have_joy_as_happiness() -> None:
    known = face_lexemes()
    assert known["JOY"].aus == known["HAPPINESS"].aus


@each_row("name", sorted(name for name in face_lexemes() if re.search("LEFT|RIGHT", name)))
def test_face_lexemes_of_one_side_mirror_those_of_the_other(name: str) -> None:
    swapped = {"LEFT": "RIGHT", "RIGHT": "LEFT", "BOTH": "BOTH"}
    swap = name.replace("LEFT", "?").replace("RIGHT", "LEFT").replace("?", "RIGHT")
    known = face_lexemes()
    assert known[swap].aus == {(au, swapped[side]): amount for (au, side), amount in known[name].aus.items()}


@each_row("name", sorted(face_lexemes()))
def test_face_lexemes_use_action_units_that_move_faps(name: str) -> None:
    moved = {row.au for row in au_to_fap()}
    assert {au for au, _ in face_lexemes()[name].aus} <= moved


@pytest.mark.parametrize("lexeme", head_lexemes().values(), ids=lambda lexeme: lexeme.name)
def test_head_lexemes_turn_within_the_degrees_of_action_units(lexeme: HeadLexeme) -> None:
    for pose in (lexeme.ready, lexeme.stroke, lexeme.back):
        assert all(0 < degrees <= by_number()[au].degrees for au, degrees in pose.items())


def test_read_aus_parses_sides() -> None:
    assert read_aus({"1": 0.5, "12L": 1.0, "12R": 0.25}, "x") == {
        (1, "BOTH"): 0.5,
        (12, "LEFT"): 1.0,
        (12, "RIGHT"): 0.25,
    }


@pytest.mark.parametrize(
    ("cells", "words"),
    [
        ({"999": 1.0}, "wanted an action unit such as 12 or 12L, got '999'"),
        ({"26L": 1.0}, "got '26L'"),
        ({"12": 0.0}, "x, 12: wanted an intensity above 0 and to 1, got 0.0"),
        ({"12": 1.5}, "got 1.5"),
    ],
)
def test_read_aus_refuses_invalid_units_and_intensities(cells: dict[str, float], words: str) -> None:
    with pytest.raises(TableError, match=words):
        read_aus(cells, "x")


@pytest.mark.parametrize("unit", ["9" * 5000, "9" * 5000 + "L", "0", "999"])
def test_read_aus_refuses_numbers_that_are_no_action_unit(unit: str) -> None:
    with pytest.raises(TableError, match="wanted an action unit such as 12 or 12L"):
        read_aus({unit: 1.0}, "x")
