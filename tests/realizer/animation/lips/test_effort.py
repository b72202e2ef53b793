import numpy as np
import pytest

from realizer.animation.axis import fap
from realizer.animation.channel import Channel
from realizer.animation.lips.effort import opened
from realizer.animation.lips.lip_sync import lip_channels
from realizer.speech.utterance import Phoneme

SOUNDS = ("", "ɑ", "p", "ɑ", "f", "u", "m", "i", "")
USUAL = lip_channels([Phoneme(0.15 * k, 0.15 * (k + 1), ipa, 1) for k, ipa in enumerate(SOUNDS)], 0.0)


def values(channels, number: int) -> np.ndarray:
    return next(channel.values for channel in channels if channel.target == fap(number))


def gap(channels) -> np.ndarray:
    return -values(channels, 4) - values(channels, 5)


@pytest.mark.parametrize("factor", [0.6, 0.8, 1.3, 1.6])
def test_opened_scales_the_mouth_and_leaves_closures(factor: float) -> None:
    usual, other = gap(USUAL), gap(opened(USUAL, factor))
    assert other.max() == pytest.approx(factor * usual.max())
    assert values(opened(USUAL, factor), 3) == pytest.approx(factor * values(USUAL, 3))
    raised = values(USUAL, 5) > 0  # the lower lip, to the upper one or to the teeth
    assert raised.sum() > 20
    assert np.array_equal(values(opened(USUAL, factor), 5)[raised], values(USUAL, 5)[raised])
    assert other[raised & (usual <= 0)].max() <= 0
    for number in (6, 16, 17, 44):
        assert np.array_equal(values(opened(USUAL, factor), number), values(USUAL, number))


def test_opened_remembers_its_result() -> None:
    assert opened(USUAL, 1.0) is USUAL
    assert opened(USUAL, 1.3) is opened(USUAL, 1.3)
    other = opened(USUAL, 0.7)
    assert isinstance(other[0], Channel)
    assert gap(other).max() < gap(opened(USUAL, 1.3)).max()
