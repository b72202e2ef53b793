"""Sound mixed in blocks equals sound mixed as a whole."""

from __future__ import annotations

import math

import numpy as np
import pytest

from realizer.playback.scheduled_speech import render_utterance
from realizer.server.streams.audio_stream import AudioStream
from realizer.speech.utterance import Utterance
from tests.realizer.server.conftest import RATE, TALK, Driver, spoken


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


def sound_of(client):
    return [f for f in client.frames if f.stream == "audio"]


def test_audio_subscription_sends_at_most_a_tenth_ahead_and_not_in_silence(driver) -> None:
    driver.send({"type": "subscribe", "stream": "audio"})
    driver.run(0.5)
    assert not sound_of(driver.clients[1])
    driver.send(TALK.format("b"))
    client = driver.run(5)
    packets = sound_of(client)
    assert len(packets) in (50, 51)
    assert all(len(p.values) == RATE // 50 for p in packets)
    assert [p.time for p in packets] == pytest.approx([p.frame * 0.02 for p in packets])
    sent = [t for t, m in zip(client.times, client.messages, strict=True) if isinstance(m, bytes)]
    assert all(p.time - t <= 0.1 + 1e-6 for p, t in zip(packets, sent, strict=True))


def test_audio_subscription_sends_the_whole_sound(driver) -> None:
    driver.send({"type": "subscribe", "stream": "audio"})
    client = driver.send(TALK.format("b"))
    packets = sound_of(driver.run(5))
    start = next(f for f in client.feedback if getattr(f, "id", "") == "b:s:start").global_time
    heard = np.concatenate([p.values for p in packets])
    first = round((start - packets[0].time) * RATE)
    pcm = spoken().pcm
    assert np.array_equal(heard[first : first + len(pcm)], pcm)


def test_audio_subscription_takes_back_sound_after_a_stop(driver) -> None:
    driver.send({"type": "subscribe", "stream": "audio"})
    driver.send(TALK.format("b"))
    driver.run(0.5)
    before = len(sound_of(driver.clients[1]))
    driver.send({"type": "stop"})
    after = sound_of(driver.run(5))[before:]
    assert after[0].flush
    assert after[0].time == pytest.approx(0.5, abs=0.021)
    assert after[-1].time < 0.6
    assert abs(int(after[-1].values[-1])) < 2000, "it fades out"


def test_audio_subscription_is_due_a_tenth_before_the_next_packet(driver) -> None:
    driver.send({"type": "subscribe", "stream": "audio"})
    (subscription,) = driver.session.connections[1].subscriptions.values()
    assert subscription.next_due() == math.inf
    driver.send('<bml id="b"><speech id="s" start="2"><text>Hello</text></speech></bml>')
    assert not list(subscription.messages(driver.now))
    (speech,) = driver.session.player.speech()
    assert subscription.next_due() == pytest.approx(math.floor(speech.start / 0.02) * 0.02 - 0.1)
    driver.send({"type": "stop"})
    assert subscription.next_due() in (-math.inf, math.inf)
