"""Long texts spoken in parts, so that sound starts early."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from xml.sax.saxutils import unescape

import numpy as np

from realizer.core.array_types import Int16
from realizer.playback.audio_mix import resample
from realizer.server.speech.sentence_splitter import TAG, SentenceSplitter, is_sentence
from realizer.speech.ssml import NAMED
from realizer.speech.utterance import Phoneme, SpeechRequest, Utterance, Word

# Characters up to which a text is said in one: espeak needs 15 ms for so many.
SHORT = 160
# And of which a part is made, from the second one on. Each is planned by itself while frames are due.
PART = 400
CHUNK = 500  # characters that are looked through at a time
# Elements that are the same of each part as of the whole.
MANNERS = frozenset({"emphasis", "lang", "prosody", "voice"})
ELEMENT = re.compile(r"\s*(<([a-z-]+)\b[^<>]*>)(.*)(</\2\s*>)\s*", re.DOTALL)
# What a second of speech is taken for while little of it is there: this many characters, with the weight of
# so many characters of what is there.
PACE, WEIGHT = 15.0, 60
# A voice ends whatever it says as it ends a sentence; behind a comma this much of the pause is left.
COMMA = 0.15  # s
QUOTES: Mapping[str, str] = {"&quot;": '"', "&apos;": "'"}


class LongText:
    """A text that is said part by part.

    Args:
        request: the whole of it.

    Attributes:
        ready_until: seconds of sound that are there.
    """

    def __init__(self, request: SpeechRequest) -> None:
        self.ready_until = 0.0
        self._say = request
        # Taken apart as it is said: that of a long text takes a while too.
        self._parts = _parts(request.ssml)
        self._coming = next(self._parts, None)
        self._asked: str | None = None
        self._characters = 0  # that are there
        self._joined: list[tuple[float, Utterance]] = []
        self._words: list[Word] = []
        self._phonemes: list[Phoneme] = []
        self._marks: dict[str, float] = {}
        self._room: Int16 = np.zeros(0, np.int16)  # for the sound, and more
        self._length = 0
        self._rate = 0

    @staticmethod
    def is_applicable(request: SpeechRequest) -> bool:
        """Whether it is better said in parts."""
        return len(request.ssml) > SHORT and request.seconds is None and request.recording is None

    def next(self) -> SpeechRequest | None:
        """The next part, which is to be said now; None where there is no more."""
        if self._coming is None:
            return None
        self._asked, self._coming = self._coming, next(self._parts, None)
        names = {name for name, _ in _marks(self._asked)}
        return replace(self._say, ssml=self._asked, marks=tuple(m for m in self._say.marks if m in names))

    @property
    def is_complete(self) -> bool:
        """Whether `next` has given the last part."""
        return self._coming is None

    def add_part(self, part: Utterance, soonest: float = 0.0) -> Utterance:
        """What a voice made of the last `next`, behind all the others.

        Args:
            soonest: seconds from the start of the first one; what is there before that was heard already.

        Returns:
            All of it; its end and the marks that are still to come are guessed.
        """
        assert self._asked is not None
        if self._coming is not None and not is_sentence(self._asked):
            part = trim_final_pause(part)
        start = max(self.ready_until, soonest) if self._joined else 0.0
        self._sound(part, start)
        if self._rate:
            # The parts follow each other to the sample.
            start = round(start * self._rate) / self._rate
        self._joined.append((start, part))
        self._words += [Word(w.start + start, w.end + start, w.text) for w in part.words]
        self._phonemes += [replace(p, start=p.start + start, end=p.end + start) for p in part.phonemes]
        self._marks |= {name: time + start for name, time in part.marks.items()}
        self.ready_until = start + part.duration
        self._characters += len(TAG.sub("", self._asked))
        guessed, left = self._estimate()
        return Utterance(
            duration=self.ready_until + left,
            words=tuple(self._words),
            phonemes=tuple(self._phonemes),
            marks={**guessed, **self._marks},
            sample_rate=self._rate,
            pcm=self._room[: self._length] if self._rate else None,
            warnings=tuple(dict.fromkeys(text for _, one in self._joined for text in one.warnings)),
            stretch=part.stretch,
            sections=tuple(self._joined),
        )

    def _sound(self, part: Utterance, start: float) -> None:
        """Put the sound of a part behind the others, with silence between where it comes late."""
        if part.pcm is None or not part.sample_rate:
            return
        self._rate = self._rate or part.sample_rate
        pcm = part.pcm
        if part.sample_rate != self._rate:
            pcm = np.rint(resample(pcm, part.sample_rate, self._rate)).astype(np.int16)
        first = round(start * self._rate)
        last = first + len(pcm)
        if last > len(self._room):
            room = np.zeros(2 * last, np.int16)
            room[: self._length] = self._room[: self._length]
            self._room = room  # what was given out before keeps the old one
        self._room[first:last] = pcm
        self._length = last

    def _estimate(self) -> tuple[dict[str, float], float]:
        """The marks of what is left, and how long that is."""
        spoken = sum(part.duration for _, part in self._joined)
        pace = (spoken + WEIGHT / PACE) / (self._characters + WEIGHT)  # s a character
        if self._coming is None:
            return {}, 0.0
        text, there = self._say.ssml, self._characters
        marks = {
            name: self.ready_until + (before - there) * pace
            for name, before in _marks(text)
            if before >= there
        }
        return marks, max(0, len(TAG.sub("", text)) - there) * pace


def _parts(text: str) -> Iterator[str]:
    """The first clause alone, then as many as are a part."""
    part, wanted = "", 1
    for piece in _pieces(text):
        part += piece
        if len(part) >= wanted:
            yield part
            part, wanted = "", PART
    if part:
        yield part


def _pieces(text: str) -> Iterator[str]:
    """Sentences and clauses; a long element that only says how to speak is around each part in it."""
    clauses = SentenceSplitter()
    for at in range(0, len(text), CHUNK):
        for piece in clauses.feed(text[at : at + CHUNK], close=at + CHUNK >= len(text)):
            around = ELEMENT.fullmatch(piece) if len(piece) > PART else None
            if around is None or around[2] not in MANNERS or around[2] in _names(around[3]):
                yield piece
                continue
            for inside in _parts(around[3]):
                yield f"{around[1]}{inside}{around[4]}"


def _names(text: str) -> set[str]:
    return {tag[2] for tag in TAG.finditer(text)}


def _marks(text: str) -> Iterator[tuple[str, int]]:
    """Name of a mark, and how many characters that are said stand before it."""
    length, last = 0, 0
    for tag in TAG.finditer(text):
        length += tag.start() - last
        last = tag.end()
        if named := NAMED.match(tag[0]):
            yield unescape(named[1] if named[1] is not None else named[2], QUOTES), length


def trim_final_pause(part: Utterance) -> Utterance:
    """With the pause of a comma at its end, where the voice has made that of a full stop."""
    last = part.phonemes[-1] if part.phonemes else None
    if last is None or last.ipa or last.end - last.start <= COMMA:
        return part
    end = last.start + COMMA
    if part.pcm is not None:
        end = round(end * part.sample_rate) / part.sample_rate
    return replace(
        part,
        duration=end,
        words=tuple(replace(w, end=min(w.end, end)) for w in part.words),
        phonemes=(*part.phonemes[:-1], replace(last, end=end)),
        marks={name: min(time, end) for name, time in part.marks.items()},
        pcm=None if part.pcm is None else part.pcm[: round(end * part.sample_rate)],
    )
