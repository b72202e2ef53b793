"""Viseme names of other systems."""

from __future__ import annotations

import pytest

from realizer.animation.lips.visemes import sounds
from realizer.speech.recorded.viseme_names import sound_of


def test_viseme_sets_have_silence_and_closed_lips() -> None:
    closed = {"mpeg4": "1", "oculus": "PP", "sapi": "21", "polly": "p"}
    silence = {"mpeg4": "0", "oculus": "sil", "sapi": "0", "polly": "sil"}
    for name in closed:
        assert sound_of(name, closed[name]) == "p"
        assert sound_of(name, silence[name]) == ""


@pytest.mark.parametrize("viseme", range(1, 15))
def test_sound_of_an_mpeg4_viseme_has_that_viseme(viseme: int) -> None:
    parts = sounds(sound_of("mpeg4", str(viseme)))[0].mix
    assert max(parts, key=lambda part: part[1])[0] == viseme


def test_sound_of_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(KeyError, match="polly"):
        sound_of("azure", "1")
    with pytest.raises(KeyError, match="PP"):
        sound_of("oculus", "22")
