"""Speech of any other voice: sound that is sent in clips, with or without the times of its words."""

import logging
import math
import secrets
import time
from collections.abc import Awaitable, Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from realizer.client.speech import Control, OpenSpeech, Wait
from realizer.core.array_types import Float32, Float64, Int16
from realizer.protocol.wire import ClipPiece, pack_clip

# Sound without words is sent in pieces of this length; the first one starts the speech. They get longer if
# much was sent ahead, which costs the service less.
PIECE, LONGEST_PIECE = 0.2, 2.0  # s
LONGEST = 1 << 20  # bytes of one message
# The sound of a last word, whose end is not known, waits at most so long for the next word.
HOLD = 1.0  # s
LOUDEST = 4.0  # floats beyond it are not within -1 to 1 and a little too loud, but int16 samples
DESCRIBING = ("text", "words", "phonemes", "visemes")  # fields of `speech`

Send = Callable[[bytes], Awaitable[None]]
Pcm = bytes | bytearray | memoryview | Int16 | Float32 | Float64
Timed = tuple[float, str] | tuple[float, float, str] | Mapping[str, Any]
OnWord = Callable[[dict[str, Any]], object]
_LOG = logging.getLogger("realizer.client")


class Voice(OpenSpeech):
    """A speech whose sound is sent as it comes, which `Client.voice` returns."""

    def __init__(
        self,
        rate: int,
        opening: Mapping[str, Any],
        send: Send,
        control: Control,
        wait: Wait,
        on_word: OnWord | None = None,
    ) -> None:
        super().__init__(f"say-{secrets.token_hex(4)}", opening, control, wait)
        self._rate = checked_rate(rate)
        self._send = send
        self._sound = np.zeros(0, np.int16)  # that is not sent
        self._sent = 0  # samples
        self._words: list[dict[str, Any]] = []  # those that are not sent; times from the start of the speech
        self._given: list[dict[str, Any]] = []  # all words
        self._on_word = on_word
        self.progress.on_word = self._report
        self._clips = 0
        self._began = 0.0  # when the first clip was sent, on a clock that never jumps

    async def write(self, pcm: Pcm) -> None:
        """Add mono sound, which is spoken at once: int16, or floats from -1 to 1.

        Give words before their sound: a clip is cut where a word begins, so that no word is torn.

        Raises:
            TypeError, ValueError: this is no mono sound.
            ClientError: the speech was refused or closed, or the connection has ended.
        """
        samples = samples_of(pcm)
        if self._stopped:
            return
        self._check_open()
        async with self._sending:
            self._sound = np.concatenate((self._sound, samples))
            ready = self._ready()
            ahead = self._sent / self._rate - (time.monotonic() - self._began)
            piece = min(max(PIECE, ahead / 2), LONGEST_PIECE) if self._clips else PIECE
            if ready >= piece * self._rate:
                await self._flush(ready)

    async def words(self, words: Iterable[Timed]) -> None:
        """Add words, (seconds, word) or (start, end, word), in seconds from the start of the speech.

        Raises:
            TypeError, ValueError: they have another form, or times that go back, or their sound was sent.
            ClientError: as `write`.
        """
        added = timed("words", words)
        if self._stopped:
            return
        self._check_open()
        last = max(self._sent / self._rate, self._words[-1]["start"] if self._words else 0.0)
        for word in added:
            if word["start"] < last - 1 / self._rate:
                raise ValueError(f"words: wanted times from {last:.3f} s on, got {word['start']:.3f} s")
            last = word["start"]
        self._words += added
        self._given += added

    async def close(self) -> None:
        if self._closed:
            return
        self._closed = True
        async with self._sending:
            if len(self._sound) and self.progress.fault is None:
                await self._flush(len(self._sound))
            await self._speech(close=True)

    async def stop(self) -> None:
        self._sound = self._sound[:0]
        await super().stop()

    async def clip(self, sound: bytes, rate: int, **description: Any) -> None:
        """Send a clip and append it to the speech.

        Args:
            rate: of PCM; 0 for a sound file.
            description: fields of the message `speech` that describe it.
        """
        if not self._clips:
            self._began = time.monotonic()
        id = f"{self.id}-{self._clips}"
        self._clips += 1
        # With its words before its sound, no mouth shapes are recognised in it. Otherwise the speech follows
        # the first piece: it begins while the rest of a long clip is on its way.
        is_described = any(description.get(name) not in (None, []) for name in DESCRIBING)
        if is_described:
            await self._speech(clip=id, **description)
        for number, at in enumerate(range(0, max(1, len(sound)), LONGEST)):
            final = at + LONGEST >= len(sound)
            await self._send(pack_clip(ClipPiece(id, number, rate, sound[at : at + LONGEST], final)))
            if not (number or is_described):
                await self._speech(clip=id, **description)

    def expect_words(self, words: Iterable[dict[str, Any]]) -> None:
        """Take the words of the next clip, of which each is reported when it is spoken."""
        self._given += words

    def _report(self, index: int, time: float) -> None:
        """Pass on a word that is spoken. A fault of the program's function does not end the connection."""
        if self._on_word is not None and index < len(self._given):
            try:
                self._on_word({**self._given[index], "time": time})
            except Exception:
                _LOG.exception("on_word failed")

    def _ready(self) -> int:
        """Return how many samples can be sent: all, or up to the start of a word that may go on."""
        if not self._words:
            return len(self._sound)
        starts = [round(word["start"] * self._rate) - self._sent for word in self._words]
        last, end = starts[-1], self._words[-1].get("end")
        ends = last + HOLD * self._rate if end is None else end * self._rate - self._sent
        if len(self._sound) >= ends:
            return len(self._sound)
        return max((start for start in starts if start <= len(self._sound)), default=len(self._sound))

    async def _flush(self, count: int) -> None:
        """Send so many samples as a clip, with the words that begin in it."""
        sound, self._sound = self._sound[:count], self._sound[count:]
        begin = self._sent / self._rate
        self._sent += count
        inside = [word for word in self._words if round(word["start"] * self._rate) < self._sent]
        del self._words[: len(inside)]
        words = [
            word | {name: max(0.0, word[name] - begin) for name in ("start", "end") if name in word}
            for word in inside
        ]
        await self.clip(sound.astype("<i2").tobytes(), self._rate, **({"words": words} if words else {}))


def timed(name: str, items: Iterable[Timed]) -> list[dict[str, Any]]:
    """Return words, phonemes or visemes as fields of the message `speech`.

    Raises:
        TypeError: an item has another form; ValueError: a time is negative or not finite.
    """
    found = []
    for item in items:
        numbers, text = (item[:-1], item[-1]) if isinstance(item, Sequence) and item else ((), None)
        if isinstance(item, Mapping) and item.keys() <= {"start", "end", "text"}:
            numbers = tuple(item[n] for n in ("start", "end") if item.get(n) is not None)
            text = item.get("text") if "start" in item else None
        if not (isinstance(text, str) and 1 <= len(numbers) <= 2 and all(map(_is_number, numbers))):
            wanted = "(seconds, text), (start, end, text) or a dictionary of these"
            raise TypeError(f"{name}: wanted {wanted}, got {item!r}")
        if not all(0 <= number < math.inf for number in numbers):
            raise ValueError(f"{name}: wanted seconds from 0 on, got {item!r}")
        found.append(dict(zip(("start", "end"), map(float, numbers), strict=False)) | {"text": text})
    return found


def content_of(sound: Pcm, rate: int | None) -> bytes:
    """Return a sound file, or with a rate PCM, as it is sent. Errors as of `samples_of`."""
    if rate is not None:
        return samples_of(sound).astype("<i2").tobytes()
    if not isinstance(sound, bytes | bytearray | memoryview):
        raise TypeError(f"sound: wanted the bytes of a sound file, or PCM with a rate, got {type(sound)}")
    return bytes(sound)


def samples_of(pcm: Pcm) -> Int16:
    """Return mono sound as int16 samples.

    Raises:
        TypeError: it is of another type.
        ValueError: it is not mono, has half a sample, or floats that are no numbers or far beyond -1 to 1.
    """
    if isinstance(pcm, bytes | bytearray | memoryview):
        if len(bytes(pcm)) % 2:
            raise ValueError(f"sound: wanted samples of two bytes, got {len(bytes(pcm))} bytes")
        return np.frombuffer(bytes(pcm), "<i2").astype(np.int16)
    samples = np.asarray(pcm)
    if samples.dtype != np.int16 and samples.dtype.kind != "f":
        raise TypeError(f"sound: wanted bytes, int16 or floats from -1 to 1, got {samples.dtype}")
    if samples.ndim != 1:
        raise ValueError(f"sound: wanted mono sound, (n,), got {samples.shape}")
    if samples.dtype.kind == "f":
        loudest = float(np.abs(samples).max(initial=0.0))
        if not loudest <= LOUDEST:
            unit = ": int16?" if LOUDEST < loudest < math.inf else ""
            raise ValueError(f"sound: wanted floats from -1 to 1, got up to {loudest:g}{unit}")
        samples = np.rint(samples.clip(-1, 1) * 32767)
    return samples.astype(np.int16)


def checked_rate(rate: int) -> int:
    """Return a number of samples a second; raises TypeError or ValueError for another."""
    if isinstance(rate, bool) or not isinstance(rate, int):
        raise TypeError(f"rate: wanted samples a second, got {rate!r}")
    if rate <= 0:
        raise ValueError(f"rate: wanted samples a second, got {rate}")
    return rate


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
