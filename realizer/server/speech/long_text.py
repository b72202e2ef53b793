"""Synthesis of long texts in parts, so that sound starts early."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from xml.sax.saxutils import unescape

import numpy as np

from realizer.core.array_types import Int16
from realizer.playback.scheduled_speech import resample
from realizer.server.speech.sentence_splitter import SentenceSplitter, is_sentence
from realizer.speech.duration_fit import shortened
from realizer.speech.ssml import NAMED
from realizer.speech.utterance import Phoneme, SpeechRequest, Utterance, Word
from realizer.text.parts import ANY_TAG as TAG

# Least length of the second and further parts. Each is planned separately, so that frames are not delayed.
PART = 400
CHUNK = 500  # characters that are split at a time
# Elements that can be repeated around each part of their content.
MANNERS = frozenset({"emphasis", "lang", "prosody", "voice"})
ELEMENT = re.compile(r"\s*(<([a-z-]+)\b[^<>]*>)(.*)(</\2\s*>)\s*", re.DOTALL)
# The prior of the speaking rate: characters a second, and its weight in characters of synthesized speech.
PACE, WEIGHT = 15.0, 60
# Voices end every request with the pause of a full stop. After a comma this much of it is kept.
COMMA = 0.15  # s
QUOTES: Mapping[str, str] = {"&quot;": '"', "&apos;": "'"}


class LongText:
    """A text that is synthesized part by part."""

    def __init__(self, request: SpeechRequest) -> None:
        self.ready_until = 0.0  # seconds of finished sound
        self._request = request
        # An iterator, because splitting a long text takes a while too.
        self._parts = _parts(request.ssml)
        self._next = next(self._parts, None)
        self._current = ""  # the part that `next` returned last
        self._characters = 0  # of the finished parts
        self._joined: list[tuple[float, Utterance]] = []
        self._words: list[Word] = []
        self._phonemes: list[Phoneme] = []
        self._marks: dict[str, float] = {}
        self._room: Int16 = np.zeros(0, np.int16)  # the sound, with spare space
        self._length = 0
        self._rate = 0

    def next(self) -> SpeechRequest | None:
        """Return the request of the next part; None after the last."""
        if self._next is None:
            return None
        self._current, self._next = self._next, next(self._parts, None)
        names = {name for name, _ in _marks(self._current)}
        marks = tuple(mark for mark in self._request.marks if mark in names)
        return replace(self._request, ssml=self._current, marks=marks)

    @property
    def is_complete(self) -> bool:
        """Whether `next` has returned the last part."""
        return self._next is None

    def add_part(self, part: Utterance, soonest: float = 0.0) -> Utterance:
        """Append the synthesized part that `next` returned last.

        Args:
            soonest: earliest start of the part, in seconds from the start of the text, because sound before
                that has been played.

        Returns:
            The whole utterance; its end and the marks of missing parts are estimated.
        """
        if self._next is not None and not is_sentence(self._current):
            part = trim_final_pause(part)
        start = max(self.ready_until, soonest) if self._joined else 0.0
        self._append_sound(part, start)
        if self._rate:
            # Parts begin at whole samples.
            start = round(start * self._rate) / self._rate
        self._joined.append((start, part))
        self._words += [Word(w.start + start, w.end + start, w.text) for w in part.words]
        self._phonemes += [replace(p, start=p.start + start, end=p.end + start) for p in part.phonemes]
        self._marks |= {name: time + start for name, time in part.marks.items()}
        self.ready_until = start + part.duration
        self._characters += spoken_length(self._current)
        missing_marks, missing_duration = self._estimate()
        return Utterance(
            duration=self.ready_until + missing_duration,
            words=tuple(self._words),
            phonemes=tuple(self._phonemes),
            marks={**missing_marks, **self._marks},
            sample_rate=self._rate,
            pcm=self._room[: self._length] if self._rate else None,
            warnings=tuple(dict.fromkeys(text for _, one in self._joined for text in one.warnings)),
            stretch=part.stretch,
            sections=tuple(self._joined),
        )

    def _append_sound(self, part: Utterance, start: float) -> None:
        """Append the sound of a part, after silence if it comes late."""
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
            self._room = room  # earlier utterances keep the old array
        self._room[first:last] = pcm
        self._length = last

    def _estimate(self) -> tuple[dict[str, float], float]:
        spoken = sum(part.duration for _, part in self._joined)
        pace = (spoken + WEIGHT / PACE) / (self._characters + WEIGHT)  # s a character
        if self._next is None:
            return {}, 0.0
        text, done = self._request.ssml, self._characters
        marks = {name: self.ready_until + (at - done) * pace for name, at in _marks(text) if at >= done}
        return marks, max(0, spoken_length(text) - done) * pace


def spoken_length(text: str) -> int:
    """Return the number of characters of a text without its tags."""
    return len(TAG.sub("", text))


def _parts(text: str) -> Iterator[str]:
    part, length = "", 1
    for piece in _pieces(text):
        part += piece
        if len(part) >= length:
            yield part
            part, length = "", PART
    if part:
        yield part


def _pieces(text: str) -> Iterator[str]:
    """Yield sentences and clauses; the tags of a long element of MANNERS are repeated around its parts."""
    clauses = SentenceSplitter()
    for at in range(0, len(text), CHUNK):
        for piece in clauses.feed(text[at : at + CHUNK], close=at + CHUNK >= len(text)):
            element = ELEMENT.fullmatch(piece) if len(piece) > PART else None
            nested = {tag[2] for tag in TAG.finditer(element[3])} if element else set()
            if element is None or element[2] not in MANNERS - nested:
                yield piece
            else:
                yield from (f"{element[1]}{part}{element[4]}" for part in _parts(element[3]))


def _marks(text: str) -> Iterator[tuple[str, int]]:
    """Yield the name of each mark and the number of spoken characters before it."""
    length, last = 0, 0
    for tag in TAG.finditer(text):
        length += tag.start() - last
        last = tag.end()
        if mark := NAMED.match(tag[0]):
            yield unescape(mark[1] if mark[1] is not None else mark[2], QUOTES), length


def trim_final_pause(part: Utterance) -> Utterance:
    """Return an utterance whose final pause is at most that of a comma."""
    last = part.phonemes[-1] if part.phonemes else None
    if last is None or last.ipa or last.end - last.start <= COMMA:
        return part
    return shortened(part, last.start + COMMA)
