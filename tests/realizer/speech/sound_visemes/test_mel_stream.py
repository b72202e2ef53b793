"""Mel frames of sound in pieces."""

import numpy as np
import pytest

from realizer.speech.sound_visemes.mel_stream import BANDS, HOP, RATE, MelStream
from tests.rows import each_row

RATES = (8000, 16_000, 22_050, 44_100, 48_000)


def tone(hertz: float, rate: int = RATE, level: float = 0.5) -> np.ndarray:
    return np.rint(32767 * level * np.sin(2 * np.pi * hertz * np.arange(rate) / rate)).astype(np.int16)


@each_row("rate", RATES)
def test_feed_gives_the_same_frames_for_any_pieces(rate: int) -> None:
    random = np.random.default_rng(rate)
    pcm = tone(500, rate) + random.integers(-300, 300, rate).astype(np.int16)
    whole, stream = MelStream(rate).feed(pcm), MelStream(rate)
    cuts = np.sort(random.integers(0, len(pcm), 40))
    pieces = [stream.feed(piece) for piece in np.split(pcm, cuts)]
    for k, values in enumerate(whole):
        assert np.array_equal(np.concatenate([piece[k] for piece in pieces]), values)


@each_row("rate", RATES)
def test_feed_finds_the_band_of_a_tone_at_any_rate(rate: int) -> None:
    log = MelStream(rate).feed(tone(1000, rate)).log
    assert len(log) == pytest.approx(RATE / HOP, abs=4)
    assert set(log[5:-5].argmax(axis=1)) == {round(np.interp(1000, *band_middles()))}
    assert log[5:-5].max() == pytest.approx(np.log(0.25), abs=0.7)  # of half the full scale


def band_middles() -> tuple[np.ndarray, np.ndarray]:
    """Return the hertz and the numbers of the bands."""
    low, high = (1127 * np.log1p(edge / 700) for edge in (80, 7600))
    return 700 * np.expm1(np.linspace(low, high, BANDS + 2)[1:-1] / 1127), np.arange(BANDS)


def test_feed_follows_the_loud_level() -> None:
    loud, soft = (MelStream(RATE).feed(tone(700, level=level)) for level in (0.8, 0.2))
    assert loud.level[-1] - soft.level[-1] == pytest.approx(np.log(16), abs=0.01)
    assert np.allclose(loud.mean[:, 10], soft.mean[:, 10], atol=0.05)
