"""Tests of the registry of outputs."""

from __future__ import annotations

import re

import pytest

from realizer.outputs.registry import OUTPUTS, output_for


@pytest.mark.parametrize("suffix", OUTPUTS)
def test_outputs_have_descriptions(suffix):
    output = OUTPUTS[suffix]
    assert output.suffix == suffix
    assert re.fullmatch(r"\w+/[\w.+-]+", output.media_type)
    assert output.description
    assert "\n" not in output.description


def test_output_for_ignores_the_case_of_suffixes():
    assert output_for("x/Clip.FAP") is OUTPUTS[".fap"]


@pytest.mark.parametrize("path", ["clip.avi", "clip", ".fap"])
def test_output_for_lists_known_suffixes(path):
    with pytest.raises(ValueError, match=re.escape("wanted a suffix of " + " ".join(OUTPUTS))):
        output_for(path)


def test_output_for_uses_the_longest_suffix() -> None:
    assert output_for("clip.arkit.csv") is OUTPUTS[".arkit.csv"]
    assert output_for("clip.v2.csv") is OUTPUTS[".csv"]


def test_outputs_of_texts_and_sound_have_all_characters() -> None:
    whole = {suffix for suffix, output in OUTPUTS.items() if output.all_characters}
    assert whole == {".json", ".wav", ".vtt", ".textgrid"}
