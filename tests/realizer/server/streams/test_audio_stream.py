"""Sound mixed in blocks equals sound mixed as a whole."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.playback.audio_mix import render_utterance
from realizer.server.streams.audio_stream import AudioStream
from realizer.speech.utterance import Utterance
from tests.realizer.server.conftest import RATE, Driver


@pytest.mark.parametrize("rate", [8000, 16000, 22050, 48000])
@pytest.mark.parametrize("stopped", [None, 3.99, 4.5, 9.02])
def test_packet_equals_a_slice_of_the_whole_sound(rate: int, stopped: float | None) -> None:
    driver = Driver(mute=True)
    driver.send('<bml id="b"><speech id="s"><text>Hello</text></speech></bml>')
    driver.run(0.013)
    noise = np.random.default_rng(3).integers(-9000, 9000, round(9.7 * RATE)).astype(np.int16)
    driver.say(1, Utterance(len(noise) / RATE, (), (), {}, RATE, noise))
    if stopped is not None:
        driver.run(stopped)
        driver.send({"type": "stop"})
    (speaking,) = driver.session.player.speech()
    whole, offset = render_utterance(speaking, rate), round(speaking.start * rate)
    sound = AudioStream(driver.session.player, rate, None)
    packets = [sound.packet(n) for n in range(501)]
    made = np.concatenate([np.frombuffer(p or bytes(rate // 25), "<i2") for p in packets])
    assert np.array_equal(made[offset:][: len(whole)], np.clip(np.rint(whole), -32768, 32767))
    assert not made[:offset].any()
    assert not made[offset + len(whole) :].any()
