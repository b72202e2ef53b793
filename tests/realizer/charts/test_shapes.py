"""Text is measured and cut to its room; hatching stays inside."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.charts.shapes import cut, cut_inside, fold, hatch, width_of

LINES = st.text(st.characters(codec="ascii", categories=("L", "N", "P", "Zs")), max_size=60)


@given(LINES, st.floats(1, 300))
def test_what_is_cut_fits(text: str, room: float) -> None:
    shown = cut(text, 10.5, room)
    assert width_of(shown, 10.5) <= room
    assert shown == text or shown == "" or shown.endswith("...")


def test_what_fits_is_not_cut() -> None:
    assert cut("nod", 12, 100) == "nod"
    assert cut_inside("nod", 12, 100) == "nod"


def test_a_long_name_keeps_its_end() -> None:
    shown = cut_inside("an_identifier_of_many_words_17", 12, 100)
    assert (shown[:3], shown[-8:]) == ("an_", "...ds_17")
    assert width_of(shown, 12) <= 100


def test_wide_letters_are_given_more_room() -> None:
    assert width_of("頷く", 10) > width_of("ab", 10) > 0


def test_a_text_is_folded_at_blanks_and_its_last_line_cut() -> None:
    text = "a sentence with so many words that it does not fit into two lines of this length"
    lines = fold(text, 10, 150, 2)
    assert len(lines) == 2
    assert all(width_of(line, 10) <= 150 for line in lines)
    assert text.startswith(lines[0] + " ")
    assert lines[1].endswith("...")
    assert " ".join(fold(text, 10, 150, 9)) == text
    assert fold("", 10, 150, 2) == []


@pytest.mark.parametrize("box", [(0.0, 0.0, 40.0, 8.0), (7.5, 3.0, 3.0, 20.0), (1.0, 1.0, 0.5, 0.5)])
def test_hatching_stays_inside_its_rectangle(box: tuple[float, float, float, float]) -> None:
    x, y, width, height = box
    for line in hatch(*box, "#000000"):
        for at, down in line.points:
            assert x - 1e-9 <= at <= x + width + 1e-9
            assert y - 1e-9 <= down <= y + height + 1e-9
