"""Tests of `realizer.emotion`."""

import numpy as np
import pytest

import realizer
from realizer.emotions.wheel import affect, wheel
from realizer.emotions.words import emotion as of_word


def test_emotion_takes_a_word_or_a_place() -> None:
    assert realizer.emotion("joy") == of_word("joy")
    assert realizer.emotion(angle=20, activation=5) == wheel(20, 5)
    assert realizer.emotion(valence=-0.6, arousal=0.4) == affect(-0.6, 0.4)
    assert realizer.emotion("joy", profiles="raw").source == "raw"


def test_emotion_has_a_frame_of_68_faps() -> None:
    frame = realizer.emotion(angle=np.float64(45)).frame()
    assert frame.shape == (68,)
    assert frame.any()


@pytest.mark.parametrize(
    "place", [{}, {"word": "joy", "angle": 3}, {"valence": 0.5}, {"activation": 2}, {"word": "glumm"}]
)
def test_emotion_refuses_none_or_several_places(place: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="wanted"):
        realizer.emotion(**place)  # type: ignore[arg-type]


@pytest.mark.parametrize("place", [{"word": 3}, {"angle": "45"}, {"valence": True, "arousal": 1}])
def test_emotion_refuses_other_types(place: dict[str, object]) -> None:
    with pytest.raises(TypeError, match="wanted"):
        realizer.emotion(**place)  # type: ignore[arg-type]
