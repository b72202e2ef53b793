"""TextGrids, read by a foreign reader."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest

from realizer.offline import realize
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS
from realizer.speech.utterance import Word

textgrid = pytest.importorskip("praatio.textgrid", reason="pip install praatio")

TWO = (
    '<bml id="a" characterId="ann" xmlns="http://www.bml-initiative.org/bml/bml-1.0">'
    '<speech id="s"><text>Say cheese</text></speech></bml>',
    '<bml id="b" characterId="bob" xmlns="http://www.bml-initiative.org/bml/bml-1.0">'
    '<speech id="s"><text>No</text></speech></bml>',
)


def opened(realization, tmp_path):
    path = tmp_path / "x.TextGrid"
    OUTPUTS[".textgrid"].write(realization, path, RenderSettings())
    return textgrid.openTextgrid(str(path), includeEmptyIntervals=True, reportingMode="error")


def entries(grid, tier):
    return [tuple(entry) for entry in grid.getTier(tier).entries]


def test_textgrid_has_tiers_of_words_phonemes_and_points(realization, tmp_path):
    grid = opened(realization, tmp_path)
    assert grid.tierNames == ("words", "phonemes", "syncs")
    assert (grid.minTimestamp, grid.maxTimestamp) == (0, 1.5)
    assert entries(grid, "words") == [
        (0, 0.25, ""), (0.25, 0.65, "Hello"), (0.65, 1.15, "R&D <team>"), (1.15, 1.5, "")
    ]  # fmt: skip
    assert [entry[2] for entry in entries(grid, "phonemes")] == ["", "h", "oʊ", "", "iː", ""]
    assert entries(grid, "syncs") == [
        (0.2, "greeting:nod:start"), (0.81, "greeting:nod:stroke"), (1.4, "greeting:nod:end")
    ]  # fmt: skip


def test_textgrid_tiers_have_no_gaps_or_overlaps(turn, tmp_path):
    played = realize(turn, voice="silent", idle=False)
    grid = opened(played, tmp_path)
    for tier in ("words", "phonemes"):
        found = entries(grid, tier)
        assert found[0][0] == 0
        assert found[-1][1] == grid.maxTimestamp
        assert all(before[1] == after[0] for before, after in pairwise(found))
    points = entries(grid, "syncs")
    assert len({time for time, _ in points}) == len(points)
    named = [name for _, names in points for name in names.split()]
    (planned,) = played.schedules
    assert sorted(named) == sorted(f"a:{b}:{p}" for b, names in planned.points.items() for p in names)
    assert len(points) < len(named)  # all of them start together


def test_textgrid_has_tiers_for_each_character(tmp_path):
    grid = opened(realize(TWO, voice="silent", idle=False), tmp_path)
    assert grid.tierNames == ("words", "phonemes", "bob words", "bob phonemes", "syncs")
    assert [text for _, _, text in entries(grid, "words") if text] == ["Say", "cheese"]
    assert [text for _, _, text in entries(grid, "bob words") if text] == ["No"]


def test_textgrid_escapes_quotes_and_line_ends(realization, tmp_path):
    (speaking,) = realization.speeches
    odd = replace(speaking.utterance, words=(Word(0.0, 0.5, 'the "big\n one"'),))
    grid = opened(replace(realization, speeches=(replace(speaking, utterance=odd),)), tmp_path)
    assert entries(grid, "words")[1] == (0.25, 0.75, 'the "big one"')


def test_textgrid_of_silence_has_empty_tiers(realization, tmp_path):
    grid = opened(replace(realization, speeches=(), schedules=(), duration=0.0), tmp_path)
    assert entries(grid, "words") == [(0, 0.04, "")]
    assert entries(grid, "syncs") == []
