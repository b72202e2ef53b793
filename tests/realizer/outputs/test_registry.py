"""Tests of the registry of outputs."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS, output_for
from realizer.realization import Realization


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


@pytest.mark.parametrize("suffix", [suffix for suffix, one in OUTPUTS.items() if one.picture_size is None])
def test_outputs_contain_a_second_character_if_they_say_so(realization: Realization, suffix: str) -> None:
    (performance,), (said,) = realization.characters.values(), realization.speeches
    two = replace(
        realization,
        characters={**realization.characters, "eve": performance},
        speeches=(said, replace(said, start=0.4, until=1.4, character=1)),
    )
    output, settings = OUTPUTS[suffix], RenderSettings()
    assert (output.encode(two, settings) != output.encode(realization, settings)) == output.all_characters
