"""Times of words and IPA phonemes from hibari's readings and durations; joining of pieces of speech."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise
from typing import Literal

import numpy as np

from realizer import tables
from realizer.core.array_types import Int16
from realizer.speech.utterance import Phoneme, tile
from realizer.speech.words import PlacedMark, divided, is_vowel, words_in

Role = Literal["sound", "primary", "secondary", "long", "pause", "joint"]
# A word as hibari reads it: text, phonemes in hibari's signs, whether a blank follows.
Token = tuple[str, str, bool]
WINDOW = 12  # most words into which a number or an abbreviation is expanded
QUIET = 0.02  # of the loudest sample: the start and the end of a sentence without known lengths
SILENCE = 40  # of 32768; pauses are nearly zeros, the faintest fricatives above 100
KEPT_OF_LAST = 0.4  # of a sound whose end is silent
SHARES = {"pause": 1.5, "vowel": 1.0, "consonant": 0.6}  # relative lengths, if unknown; our choice


@dataclass(frozen=True, slots=True)
class SignRow:
    """A row of the table of hibari's signs."""

    sign: str
    ipa: str
    role: Role


@dataclass(frozen=True, slots=True)
class Sound:
    """A phoneme or pause (ipa ""), in samples from the start of its sentence; `token` is its word's index."""

    ipa: str
    stress: int
    start: int
    end: int
    token: int


@cache
def _signs() -> Mapping[str, SignRow]:
    return {row.sign or " ": row for row in tables.csv_rows("phonemes_hibari.csv", SignRow)}


def _role(sign: str) -> tuple[str, Role]:
    row = _signs().get(sign)
    return (row.ipa, row.role) if row else (sign, "sound")


def signs_of(sentence: Sequence[Token]) -> tuple[str, tuple[int, ...]]:
    """Return the signs of a sentence for hibari, and for each the index of its token."""
    signs, owners = "", []
    for k, (_, phonemes, blank) in enumerate(sentence):
        written = phonemes + (" " if blank and k + 1 < len(sentence) else "")
        signs += written
        owners += [k] * len(written)
    return signs, tuple(owners)


def sounds(sentence: Sequence[Token], lengths: Sequence[int]) -> list[Sound]:
    """Return phonemes and pauses in order, which cover the sentence from 0 without gaps.

    The length of a stress sign is added to its vowel; a blank is divided between the phonemes beside it. The
    lengths are in samples: of the silence before, of each sign, and of the silence after.
    """
    signs, owners = signs_of(sentence)
    at, *each, tail = lengths
    found = [Sound("", 0, 0, at, 0)]
    stress = 0
    for sign, owner, length in zip(signs, owners, each, strict=True):
        ipa, role = _role(sign)
        end = at + length
        last = found[-1]
        if role in ("primary", "secondary"):
            stress = 1 if role == "primary" else 2
        elif role == "sound":
            found.append(Sound(ipa, stress, last.end, end, owner))
            stress = 0
        elif role == "pause" and last.ipa:
            found.append(Sound("", 0, last.end, end, owner))
        elif role == "joint" and last.ipa:
            found[-1] = replace(last, end=at + length // 2)
        else:
            mark = "ː" if sign == "ː" and last.ipa else ""
            found[-1] = replace(last, ipa=last.ipa + mark, end=end)
        at = end
    last = found[-1]
    end = at + tail
    if last.ipa and end > last.end:
        found.append(Sound("", 0, last.end, end, last.token))
    else:
        found[-1] = Sound(last.ipa, last.stress, last.start, end, last.token)
    return [sound for sound in found if sound.end > sound.start]


def trim_to_sound(timed: Sequence[Sound], pcm: Int16) -> list[Sound]:
    """Return the sounds with pauses that start where silence does; last sounds of phrases are too long."""
    found = list(timed)
    for k in range(1, len(found)):
        last, pause = found[k - 1], found[k]
        if pause.ipa or not last.ipa:
            continue
        least = last.start + round(KEPT_OF_LAST * (last.end - last.start))
        part = pcm[least : (pause.start + pause.end) // 2]
        loud = np.flatnonzero(np.abs(part.astype(np.int32)) > SILENCE)
        begin = least + (int(loud[-1]) + 1 if len(loud) else 0)
        found[k - 1] = replace(last, end=begin)
        found[k] = replace(pause, start=begin)
    return found


def guess_lengths(sentence: Sequence[Token], pcm: Int16) -> list[int]:
    """Return lengths for `sounds`, for models that do not report them: shares of the audible part."""
    amplitudes = np.abs(pcm.astype(np.int32))
    loud = np.flatnonzero(amplitudes > QUIET * max(1, int(amplitudes.max())))
    first, last = (int(loud[0]), int(loud[-1]) + 1) if len(loud) else (0, len(pcm))
    shares = []
    for sign in signs_of(sentence)[0]:
        ipa, role = _role(sign)
        kind = role if role != "sound" else "vowel" if is_vowel(ipa) else "consonant"
        shares.append(SHARES.get(kind, 0.0))
    total = sum(shares)
    if not total:
        return [0] * (len(shares) + 1) + [len(pcm)]
    borders = first + np.rint(np.cumsum([0.0, *shares]) / total * (last - first)).astype(int)
    return [first, *np.diff(borders).tolist(), len(pcm) - int(borders[-1])]


def word_spans(
    words: Sequence[str],
    tokens: Sequence[Token],
    heard: Sequence[Sound],
    alone: Callable[[Sequence[str]], Sequence[Sequence[str]]],
) -> list[tuple[int, int]]:
    """Return (first sound, sound after the last) of each word; equal indices for a word without sounds.

    hibari expands numbers, dates and abbreviations before it reads them. Words that also occur in the
    expanded text are matched; words between them are divided by their phonemes when spoken separately, which
    `alone` returns. Tokens and sounds are those of all sentences.
    """
    firsts: dict[int, int] = {}
    for k, sound in enumerate(heard):
        if sound.ipa:
            firsts.setdefault(sound.token, k)
    if not words or not firsts:
        return [(0, 0)] * len(words)
    text, starts = "", {}
    for k, (word, _, blank) in enumerate(tokens):
        starts[len(text)] = k
        text += word + (" " if blank else "")
    theirs = list(words_in(text))
    begins: dict[int, int] = {}
    latest = -1
    for index, other in _matched([w.lower() for w in words], [w.lower() for w, _ in theirs]):
        first = firsts.get(starts.get(theirs[other][1], -1), -1)
        if first > latest:
            begins[index] = latest = first
    begins[0] = next(iter(firsts.values()))

    order = sorted(begins)
    found: list[tuple[int, int]] = []
    for opens, closes in pairwise([*order, len(words)]):
        inside, until = range(opens, closes), begins.get(closes, len(heard))
        own = [i for i in range(begins[opens], until) if heard[i].ipa]
        expected = alone([words[i] for i in inside]) if len(inside) > 1 else [()]
        for part in divided(own, expected, [heard[i].ipa for i in own]):
            last = found[-1][1] if found else begins[opens]
            found.append((part[0], part[-1] + 1) if part else (last, last))
    return found


def _matched(ours: Sequence[str], theirs: Sequence[str]) -> list[tuple[int, int]]:
    """Return pairs of equal words in order; after a difference, continue from the nearest equal pair."""
    pairs = []
    i = j = 0
    while i < len(ours) and j < len(theirs):
        if ours[i] == theirs[j]:
            pairs.append((i, j))
            i, j = i + 1, j + 1
            continue
        steps = ((a, n - a) for n in range(1, 2 * WINDOW) for a in range(n + 1))
        near = (
            (i + a, j + b)
            for a, b in steps
            if i + a < len(ours) and j + b < len(theirs) and ours[i + a] == theirs[j + b]
        )
        i, j = next(near, (i + 1, j + 1))
    return pairs


FADE = 0.004  # s, where a sound is cut


@dataclass(slots=True)
class SpeechBuffer:
    """The speech so far."""

    pcm: list[Int16] = field(default_factory=list)  # the pieces, `length` samples in all
    length: int = 0
    phonemes: list[Sound] = field(default_factory=list)  # in order; `start` and `end` in samples of the whole
    words: list[tuple[int, int, str]] = field(default_factory=list)  # first sample, end, text

    def add(self, pcm: Int16) -> None:
        self.pcm.append(pcm)
        self.length += len(pcm)

    def sounds(self, rate: int) -> tuple[Phoneme, ...]:
        """Return phonemes and pauses, which cover the sound without gaps; `rate` is in Hz."""
        starts: list[tuple[float, str, int]] = []
        end = 0
        for sound in self.phonemes:
            if sound.start > end:
                starts.append((end, "", 0))
            if sound.end > sound.start:
                starts.append((sound.start, sound.ipa, sound.stress))
            end = sound.end
        return tile([*starts, (end, "", 0)], self.length, rate)

    def marks(self, placed: Sequence[PlacedMark]) -> dict[str, int]:
        """Return the sample of each mark: the start of the next word, or the last end before a <break>."""
        marks: dict[str, int] = {}
        for mark in placed:
            if mark.word < len(self.words) and not mark.paused:
                marks.setdefault(mark.name, self.words[mark.word][0])
            else:
                marks.setdefault(mark.name, self.words[mark.word - 1][1] if mark.word and self.words else 0)
        return marks


def cut(pcm: Int16, first: int, last: int, rate: int) -> Int16:
    """Return the samples from `first` to `last`, faded in and out where the sound is cut."""
    part = pcm[first:last].astype(np.float32)
    ramp = np.linspace(0, 1, min(len(part), round(FADE * rate)), dtype=np.float32)
    if first > 0:
        part[: len(ramp)] *= ramp
    if last < len(pcm):
        part[len(part) - len(ramp) :] *= ramp[::-1]
    return np.rint(part).astype(np.int16)
