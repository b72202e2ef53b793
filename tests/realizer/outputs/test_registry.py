"""Tests of the registry of outputs."""

from __future__ import annotations

import re

import pytest

from realizer.outputs.registry import OUTPUTS, output_for


@pytest.mark.parametrize("suffix", OUTPUTS)
def test_every_output_says_what_it_is(suffix):
    output = OUTPUTS[suffix]
    assert output.suffix == suffix
    assert re.fullmatch(r"\w+/[\w.+-]+", output.media_type)
    assert output.description
    assert "\n" not in output.description


def test_the_suffix_picks_the_encoder_in_either_case():
    assert output_for("x/Clip.FAP") is OUTPUTS[".fap"]


@pytest.mark.parametrize("path", ["clip.avi", "clip", ".fap"])
def test_an_unknown_suffix_lists_the_known_ones(path):
    with pytest.raises(ValueError, match=re.escape("wanted a suffix of " + " ".join(OUTPUTS))):
        output_for(path)


def test_the_longest_suffix_that_fits_is_taken() -> None:
    assert output_for("clip.arkit.csv") is OUTPUTS[".arkit.csv"]
    assert output_for("clip.v2.csv") is OUTPUTS[".csv"]


def test_outputs_of_texts_and_sound_hold_what_all_characters_do() -> None:
    whole = {suffix for suffix, output in OUTPUTS.items() if output.all_characters}
    assert whole == {".json", ".wav", ".vtt", ".textgrid"}
