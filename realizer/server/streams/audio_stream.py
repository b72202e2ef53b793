"""The sound of a player in packets, mixed ahead in blocks, and subscriptions to it."""

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from realizer.core.array_types import Float32
from realizer.playback.player import Player
from realizer.playback.scheduled_speech import CUT, ScheduledSpeech, render_utterance
from realizer.protocol.wire import pack
from realizer.server.streams.frame_windows import EPSILON

# A sound packet, and how far ahead of its time it is sent.
PACKET = 0.02  # s
AHEAD = 0.1  # s
# Sound is mixed in blocks of so many seconds, of which so many are cached.
BLOCK, BLOCKS = 4, 16


class AudioStream:
    """The sound of one character or all, in packets of 20 ms; packet n begins at n x 0.02 s."""

    def __init__(self, player: Player, rate: int, character: int | None) -> None:
        self.player = player
        self.rate = rate
        self.character = character
        self._samples = round(PACKET * rate)
        self._cache: dict[tuple[int, int], tuple[ScheduledSpeech, Float32]] = {}  # the latest at the end

    def speeches(self) -> list[ScheduledSpeech]:
        """Return the speeches that sound or will sound, in order of their start."""
        return [
            s
            for s in self.player.speech()
            if s.utterance.pcm is not None and self.character in (None, s.character)
        ]

    def span(self) -> tuple[float, float] | None:
        """Return the start of the first speech and the end of the last, in seconds; None without speech."""
        speeches = self.speeches()
        if not speeches:
            return None
        return min(s.start for s in speeches), max(_end(s) for s in speeches)

    def packet(self, number: int) -> bytes | None:
        """Return the PCM of one packet; None in silence."""
        first = number * self._samples
        mix = np.zeros(self._samples, np.float32)
        is_silent = True
        for speech in self.speeches():
            if _end(speech) * self.rate <= first or speech.start * self.rate >= first + self._samples:
                continue
            offset = round(speech.start * self.rate)
            piece = self._pcm(speech, max(0, first - offset), max(0, first + self._samples - offset))
            at = max(0, offset - first)
            mix[at : at + len(piece)] += piece
            is_silent &= not len(piece)
        return None if is_silent else np.clip(np.rint(mix), -32768, 32767).astype("<i2").tobytes()

    def _pcm(self, speech: ScheduledSpeech, first: int, last: int) -> Float32:
        size = BLOCK * self.rate
        blocks = [self._block(speech, n) for n in range(first // size, -(-last // size))]
        joined = blocks[0] if len(blocks) == 1 else np.concatenate([np.zeros(0, np.float32), *blocks])
        begin = first // size * size
        return joined[first - begin : last - begin]

    def _block(self, speech: ScheduledSpeech, number: int) -> Float32:
        """Return `BLOCK` seconds of a speech, so that a long one is mixed only as far as it is heard."""
        key = (id(speech), number)
        cached = self._cache.pop(key, None)
        if cached is None or cached[0] is not speech:
            cached = (speech, self._render(speech, number * BLOCK))
            heard = {id(each) for each in self.speeches()}
            self._cache = {key: kept for key, kept in self._cache.items() if key[0] in heard}
        self._cache[key] = cached
        while len(self._cache) > BLOCKS:
            del self._cache[next(iter(self._cache))]
        return cached[1]

    def _render(self, speech: ScheduledSpeech, second: int) -> Float32:
        utterance = speech.utterance
        assert utterance.pcm is not None
        # A second more on either side, so that filters and fades do not begin anew in each block.
        first, rate = max(0, second - 1), utterance.sample_rate
        pcm = utterance.pcm[first * rate : (second + BLOCK + 1) * rate]
        part = replace(utterance, pcm=pcm, duration=len(pcm) / rate)
        sound = render_utterance(replace(speech, start=speech.start + first, utterance=part), self.rate)
        return sound[(second - first) * self.rate : (second - first + BLOCK) * self.rate]


@dataclass(eq=False)
class AudioSubscription:
    """A subscription to sound: `next` is the next packet to send, `sent` the last few that were sent."""

    sound: AudioStream
    index: int
    next: int
    version: int
    sent: deque[tuple[int, bytes | None]] = field(default_factory=lambda: deque(maxlen=8))

    def messages(self, now: float) -> Iterator[tuple[bytes, bool]]:
        """Yield the messages that are due, each with whether a slow client can do without.

        Packets that a change of plans has made wrong are taken back first.
        """
        sound, current = self.sound, math.floor((now + EPSILON) / PACKET)
        if self.version != sound.player.version:
            self.version = sound.player.version
            if (changed := self._changed(current)) is not None:
                yield self._message(changed, b"", forget=True), False
                self.next = changed
        last = math.floor((now + AHEAD + EPSILON) / PACKET)
        if sound.span() is None or self.next > last:
            return
        for number in range(max(self.next, current), last + 1):
            pcm = sound.packet(number)
            self.sent.append((number, pcm))
            if pcm is not None:
                yield self._message(number, pcm), True
        self.next = last + 1

    def next_due(self) -> float:
        """Return the time at which `messages` is due next; infinity if nothing sounds."""
        if self.version != self.sound.player.version:
            return -math.inf
        span = self.sound.span()
        if span is None or span[1] <= self.next * PACKET:
            return math.inf
        return max(self.next * PACKET, math.floor(span[0] / PACKET) * PACKET) - AHEAD

    def _changed(self, current: int) -> int | None:
        """Return the number of the first packet sent ahead that would differ now, or None."""
        ahead = sorted((number, pcm) for number, pcm in dict(self.sent).items() if number >= current)
        return next((number for number, pcm in ahead if self.sound.packet(number) != pcm), None)

    def _message(self, number: int, pcm: bytes, *, forget: bool = False) -> bytes:
        return pack("audio", number, number * PACKET, pcm, character=self.index, flush=forget)


def _end(speech: ScheduledSpeech) -> float:
    return min(speech.start + speech.utterance.duration, speech.until + CUT)
