import numpy as np

from realizer.animation.axis import au
from realizer.animation.channel import Channel, Layer
from realizer.animation.speaking_style import NEUTRAL, Style, style_of


def test_style_of_follows_the_feeling_that_is_shown() -> None:
    def shown(*aus):
        keys, values = np.array([0.0, 0.5, 5.0, 6.0]), np.array([0.0, 1.0, 1.0, 0.0])
        return [Channel(target, keys, values) for number in aus for target in au(number)]

    anger, sadness, joy = (style_of(shown(*aus), 0.5) for aus in ((4, 5, 7), (1, 4, 15), (6, 12)))
    assert style_of(shown(4, 12), 0.5) == style_of([], 0.5) == NEUTRAL == Style()
    assert anger.size > joy.size > 1 > sadness.size
    assert anger.pace > 1 > sadness.pace
    assert anger.opening > joy.opening > 1 > sadness.opening
    assert joy.pitch > 0 > anger.pitch > sadness.pitch
    assert style_of(shown(6, 12), 7.0) == NEUTRAL
    interrupted = [channel.faded(0.6, 0.8) for channel in shown(6, 12)]
    assert style_of(interrupted, 0.5) == joy  # what was planned when it began


def test_style_of_follows_the_base_states_that_began_before_the_speech() -> None:
    keys, values = np.array([1.0, 1.4]), np.array([0.0, 1.0])
    mood = [
        Channel(target, keys, values, layer=Layer.BASE, keeps_last=True)
        for number in (6, 12)
        for target in au(number)
    ]
    assert style_of(mood, 0.9) == NEUTRAL
    assert style_of(mood, 1.0).size > 1
    assert style_of(mood, 100.0) == style_of(mood, 1.0)
    replaced = [channel.faded(50.0, 50.4) for channel in mood]
    assert style_of(replaced, 49.0) == style_of(mood, 49.0)
    assert style_of(replaced, 50.0) == NEUTRAL
