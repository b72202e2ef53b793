"""Tests of contact sheets."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.render.contact_sheet import PAPER, Cell, Group, album, sheet


def plain(value, size=(60, 80)):
    return np.full((*size, 3), value, np.uint8)


@pytest.mark.parametrize("count", [1, 2, 5, 24])
def test_sheet_shows_every_picture_once(count):
    colours = [40 + 9 * k for k in range(count)]
    pixels = sheet([plain(c) for c in colours], [f"{k}" for k in range(count)])
    for colour in colours:
        assert (pixels == colour).all(2).sum() >= 60 * 80
        assert (pixels == colour).all(2).sum() < 60 * 80 + 200


def test_sheet_is_about_as_wide_as_a_screen():
    height, width = sheet([plain(99, (256, 256))] * 24, ["0.00 s"] * 24).shape[:2]
    assert 1 < width / height < 2


def test_sheet_writes_titles_and_notes_below_pictures():
    bare = sheet([plain(99)], [""])
    written = sheet([plain(99)], ["0.50 s"], [["nod:stroke"]])
    assert (bare[68:] == PAPER).all()
    assert (written[68:] != PAPER).any(2).sum() > 50


def test_sheet_keeps_a_long_note_in_its_column():
    pixels = sheet([plain(99)] * 2, ["a", "b"], [["w" * 200], []], columns=2)
    assert (pixels[68:, 86:92] == PAPER).all()


def test_sheet_ends_too_many_notes_in_a_count():
    few = sheet([plain(99)], ["a"], [[f"n{k}" for k in range(4)]])
    many = sheet([plain(99)], ["a"], [[f"n{k}" for k in range(40)]])
    assert few.shape == many.shape
    assert not np.array_equal(few, many)


def test_sheet_refuses_no_pictures():
    with pytest.raises(ValueError, match="at least one"):
        sheet([], [])


def test_album_cuts_a_long_caption_before_the_legend():
    legend = np.full((12, 90, 3), 7, np.uint8)
    pixels = album([Group("", [Cell((plain(99),) * 4, "a", ())], 1)], legend, "w" * 500)
    rows = pixels[(pixels == 7).all(2).any(1)]
    first = np.flatnonzero((rows == 7).all(2).any(0))[0]
    assert (rows == 7).all(2).sum() == 12 * 90
    assert (rows[:, first - 8 : first] == PAPER).all()
    assert (rows[:, : first - 8] != PAPER).any()


def test_album_has_a_margin_beside_its_headings():
    pixels = album([Group("brows", [Cell((plain(99),) * 4, "a", ())], 1)])
    for margin in (pixels[:, :6], pixels[:, -5:]):
        assert (margin == PAPER).all()
