"""Sound packets: sent ahead, taken back, none in silence."""

from __future__ import annotations

import math

import numpy as np
import pytest

from realizer.server.streams.audio_packets import packets_due, send_packets
from tests.realizer.server.conftest import RATE, TALK, spoken


def sound_of(client):
    return [f for f in client.frames if f.stream == "audio"]


def test_send_packets_sends_at_most_a_tenth_ahead_and_not_in_silence(driver) -> None:
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


def test_send_packets_sends_the_whole_sound(driver) -> None:
    driver.send({"type": "subscribe", "stream": "audio"})
    client = driver.send(TALK.format("b"))
    packets = sound_of(driver.run(5))
    start = next(f for f in client.feedback if getattr(f, "id", "") == "b:s:start").global_time
    heard = np.concatenate([p.values for p in packets])
    first = round((start - packets[0].time) * RATE)
    pcm = spoken().pcm
    assert np.array_equal(heard[first : first + len(pcm)], pcm)


def test_send_packets_takes_back_sound_after_a_stop(driver) -> None:
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


def test_packets_due_is_a_tenth_before_the_next_packet(driver) -> None:
    driver.send({"type": "subscribe", "stream": "audio"})
    connection = driver.session._connections[1]
    (subscription,) = connection.subscriptions.values()
    assert packets_due(subscription) == math.inf
    driver.send('<bml id="b"><speech id="s" start="2"><text>Hello</text></speech></bml>')
    send_packets(connection, subscription, driver.now, [])
    (speech,) = driver.session.player.speech()
    assert packets_due(subscription) == pytest.approx(math.floor(speech.start / 0.02) * 0.02 - 0.1)
    driver.send({"type": "stop"})
    assert packets_due(subscription) in (-math.inf, math.inf)
