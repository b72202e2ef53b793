"""Attributes of SSML's <prosody>."""

import pytest

from realizer.speech.ssml_prosody import PLAIN, Prosody


@pytest.mark.parametrize(
    ("attributes", "wanted"),
    [
        ({"rate": "fast"}, Prosody(rate=1.4)),
        ({"rate": "80%"}, Prosody(rate=0.8)),
        ({"rate": "+10%"}, Prosody(rate=1.1)),
        ({"rate": "1.5"}, Prosody(rate=1.5)),
        ({"rate": "9000%"}, Prosody(rate=4.0)),
        ({"pitch": "+12st"}, Prosody(pitch=2.0)),
        ({"pitch": "-20%"}, Prosody(pitch=0.8)),
        ({"pitch": "x-high"}, Prosody(pitch=1.33)),
        ({"pitch": "200Hz"}, PLAIN),
        ({"volume": "silent"}, Prosody(volume=0.0)),
        ({"volume": "50"}, Prosody(volume=0.5)),
        ({"volume": "+20dB"}, Prosody(volume=4.0)),
        ({"volume": "-20dB"}, Prosody(volume=0.1)),
        ({"rate": "banana", "contour": "(0%,+20Hz)"}, PLAIN),
        ({}, PLAIN),
    ],
)
def test_prosody_values_are_factors(attributes: dict[str, str], wanted: Prosody) -> None:
    found = PLAIN.within(attributes)
    assert (found.rate, found.pitch, found.volume) == pytest.approx(
        (wanted.rate, wanted.pitch, wanted.volume)
    )


def test_prosody_inside_prosody_is_multiplied() -> None:
    inner = PLAIN.within({"rate": "50%", "volume": "soft"}).within({"rate": "50%", "pitch": "+6st"})
    assert (inner.rate, inner.volume) == (0.25, 0.5)
    assert inner.pitch == pytest.approx(2**0.5)
