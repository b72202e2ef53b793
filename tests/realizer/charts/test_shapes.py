"""Tests of measuring and cutting text, and hatching."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.charts.shapes import cut, cut_inside, fold, hatch, width_of

LINES = st.text(st.characters(codec="ascii", categories=("L", "N", "P", "Zs")), max_size=60)


@given(LINES, st.floats(1, 300))
def test_cut_text_fits(text: str, room: float) -> None:
    shown = cut(text, 10.5, room)
    assert width_of(shown, 10.5) <= room
    assert shown == text or shown == "" or shown.endswith("...")


def test_cut_leaves_what_fits() -> None:
    assert cut("nod", 12, 100) == "nod"
    assert cut_inside("nod", 12, 100) == "nod"


def test_cut_inside_keeps_the_end_of_a_name() -> None:
    shown = cut_inside("an_identifier_of_many_words_17", 12, 100)
    assert (shown[:3], shown[-8:]) == ("an_", "...ds_17")
    assert width_of(shown, 12) <= 100


def test_width_of_wide_letters_is_larger() -> None:
    assert width_of("頷く", 10) > width_of("ab", 10) > 0


def test_fold_breaks_at_blanks_and_cuts_the_last_line() -> None:
    text = "a sentence with so many words that it does not fit into two lines of this length"
    lines = fold(text, 10, 150, 2)
    assert len(lines) == 2
    assert all(width_of(line, 10) <= 150 for line in lines)
    assert text.startswith(lines[0] + " ")
    assert lines[1].endswith("...")
    assert " ".join(fold(text, 10, 150, 9)) == text
    assert fold("", 10, 150, 2) == []


@pytest.mark.parametrize("box", [(0.0, 0.0, 40.0, 8.0), (7.5, 3.0, 3.0, 20.0), (1.0, 1.0, 0.5, 0.5)])
def test_hatch_stays_inside_its_rectangle(box: tuple[float, float, float, float]) -> None:
    x, y, width, height = box
    for line in hatch(*box, "#000000"):
        for at, down in line.points:
            assert x - 1e-9 <= at <= x + width + 1e-9
            assert y - 1e-9 <= down <= y + height + 1e-9
