"""Sender of sound packets: due packets of a subscription, and the time of the next one."""

from __future__ import annotations

import math

from realizer.protocol.wire import pack
from realizer.server.session.effects import Effect, Send
from realizer.server.streams.audio_stream import AHEAD, PACKET
from realizer.server.streams.connection import AudioSubscription, Connection
from realizer.server.streams.frame_windows import EPSILON


def send_packets(connection: Connection, s: AudioSubscription, now: float, effects: list[Effect]) -> None:
    """Send the packets that are due, after taking back those that a change of plans has made wrong."""
    sound, current = s.sound, math.floor((now + EPSILON) / PACKET)
    if s.version != sound.player.version:
        s.version = sound.player.version
        if (changed := _changed(s, current)) is not None:
            effects.append(Send(connection.id, _packet(s, changed, b"", forget=True)))
            s.next = changed
    span = sound.span()
    last = math.floor((now + AHEAD + EPSILON) / PACKET)
    if span is None or s.next > last:
        return
    for number in range(max(s.next, current), last + 1):
        pcm = sound.packet(number)
        s.sent.append((number, pcm))
        if pcm is None:
            continue
        if connection.is_slow:
            connection.dropped += 1
            continue
        effects.append(Send(connection.id, _packet(s, number, pcm)))
    s.next = last + 1


def packets_due(s: AudioSubscription) -> float:
    """Return the time at which `send_packets` is due next; infinity if nothing sounds."""
    if s.version != s.sound.player.version:
        return -math.inf
    span = s.sound.span()
    if span is None or span[1] <= s.next * PACKET:
        return math.inf
    return max(s.next * PACKET, math.floor(span[0] / PACKET) * PACKET) - AHEAD


def _changed(s: AudioSubscription, current: int) -> int | None:
    """Return the number of the first packet sent ahead that would differ now, or None."""
    ahead = sorted((number, pcm) for number, pcm in dict(s.sent).items() if number >= current)
    return next((number for number, pcm in ahead if s.sound.packet(number) != pcm), None)


def _packet(s: AudioSubscription, number: int, pcm: bytes, *, forget: bool = False) -> bytes:
    return pack("audio", number, number * PACKET, pcm, character=s.index, flush=forget)
