"""What espeak-ng reports in, times of our words, phonemes and marks out: merged words split, marks found."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import escape

import numpy as np

from realizer.arrays import Int16
from realizer.speech.merged import bare, cuts, is_vowel
from realizer.speech.prosody import PLAIN
from realizer.speech.ssml import Break, Mark, Part, Script, Tag, write_tag
from realizer.speech.utterance import Phoneme, Word
from realizer.speech.words import PlacedMark, words_in

__all__ = ["Document", "Timeline", "timeline", "write_document"]

WORD, SENTENCE, MARK, END, PHONEME = 1, 2, 3, 5, 7
STRESS = {"ˈ": 1, "ˌ": 2}
SILENCE = 8  # of 32768; a closure is exact zeros but for the tail of the sound before
LEAST_CLOSURE = 0.01  # s
# Of its pitch, from 50 % to 200 % of the setting: octaves for each doubling, as heard in its sound.
OCTAVES = 0.72
MOST_PITCH = 198.0  # %; its setting ends there
STOPS = re.compile(r"\.+(?!\w)")
KEPT_OF_VOWEL = 0.4  # of a sound that a closure is cut from

Event = tuple[int, int, int, str]
Spoken = Callable[[Sequence[str]], Sequence[Sequence[str]]]


@dataclass(frozen=True, slots=True)
class Document:
    """What espeak-ng is given.

    Attributes:
        text: SSML; marks are named m0, m1, ...
        words: (word, place) with places as espeak-ng counts them: characters of `text` from 1.
        marks: in the order of the text.
    """

    text: str
    words: tuple[tuple[str, int], ...]
    marks: tuple[PlacedMark, ...]


@dataclass(frozen=True, slots=True)
class Timeline:
    words: tuple[Word, ...]
    phonemes: tuple[Phoneme, ...]
    marks: Mapping[str, float]


@dataclass(slots=True)
class Group:
    """A run of phonemes that begins where one of our words surely begins, and the words in it."""

    sample: int
    first: int  # of the phonemes
    words: list[int] = field(default_factory=list)


def write_document(script: Script) -> Document:
    """The script as SSML: inside <speak>, attributes in double quotes, only elements that are spoken."""
    text = "<speak>"
    words: list[tuple[str, int]] = []
    marks: list[PlacedMark] = []
    for part in _stops_first(script.parts):
        if isinstance(part, str):
            words += [(word, len(text) + len(escape(part[:at])) + 1) for word, at in words_in(part)]
            text += escape(part)
        elif isinstance(part, Mark):
            text += f'<mark name="m{len(marks)}"/>'
            marks.append(PlacedMark(part.name, len(words), False))
        elif isinstance(part, Break):
            text += f'<break time="{round(part.seconds * 1000)}ms"/>'
            marks = [PlacedMark(m.name, m.word, m.paused or m.word == len(words)) for m in marks]
        else:
            text += write_tag(_in_its_units(part))
    return Document(text + "</speak>", tuple(words), tuple(marks))


def _stops_first(parts: Sequence[Part]) -> list[Part]:
    """The parts, full stops that stand behind a mark before it: alone there espeak-ng says "dot"."""
    moved: list[Part] = []
    for part in parts:
        stops = STOPS.match(part) if isinstance(part, str) else None
        at = len(moved)
        while at and isinstance(moved[at - 1], Mark):
            at -= 1
        said = moved[at - 1] if at else None
        if stops is None or at == len(moved) or not isinstance(said, str) or said[-1].isspace():
            moved.append(part)
            continue
        moved[at - 1] = said + stops[0]
        if rest := str(part)[stops.end() :]:
            moved.append(rest)
    return moved


def _in_its_units(tag: Tag) -> Tag:
    """The tag with volume and pitch of <prosody> as espeak-ng means them.

    It reads decibels and semitones as per cent, and its pitch is a setting and not a factor.
    """
    if tag.name != "prosody" or tag.attributes is None:
        return tag
    given = dict(tag.attributes)
    manner = PLAIN.within(given)
    if "volume" in given:
        given["volume"] = f"{100 * manner.volume:.1f}%"
    if manner.pitch != PLAIN.pitch:  # of Hz it alone knows what they are
        given["pitch"] = f"{min(MOST_PITCH, max(0.0, 100 + 100 * np.log2(manner.pitch) / OCTAVES)):.1f}%"
    return Tag(tag.name, tuple(given.items()))


def timeline(document: Document, events: Sequence[Event], pcm: Int16, rate: int, spoken: Spoken) -> Timeline:
    """The times of everything in seconds; phonemes tile 0..len(pcm)/rate without a gap.

    Args:
        document: what was spoken.
        events: (type, sample, place, text) in order.
        pcm: (n,) int16.
        rate: Hz.
        spoken: words -> the phonemes of each alone; only asked where espeak-ng merged words.
    """
    begins, sounds, word_events = _sounds(_linked(events), len(pcm))
    words = _words(document, begins, sounds, word_events, len(pcm), spoken)
    marks = _marks(document, _linked(events), words)
    phonemes = _phonemes(_with_closures(begins, sounds, pcm, rate), sounds, len(pcm), rate)
    return Timeline(
        words=tuple(
            Word(first / rate, last / rate, text)
            for (text, _), (first, last) in zip(document.words, words, strict=True)
        ),
        phonemes=phonemes,
        marks={name: sample / rate for name, sample in marks.items()},
    )


def _linked(events: Sequence[Event]) -> list[Event]:
    """The events with words and marks that come too early moved to their first phoneme.

    Where a nasal runs on into a vowel ("one of", "am in"), espeak-ng reports the second word, after the
    nasal in order, at the time when the nasal begins.
    """
    moved = list(events)
    latest: tuple[int, str] = (-1, "")
    for k, (kind, sample, place, text) in enumerate(moved):
        if kind == PHONEME:
            latest = (sample, text)
        elif kind in (WORD, MARK) and latest[1] and sample <= latest[0]:
            later = next((s for t, s, _, _ in moved[k:] if t in (PHONEME, END)), sample)
            moved[k] = (kind, max(sample, later), place, text)
    return moved


def _sounds(events: Sequence[Event], end: int) -> tuple[list[int], list[str], list[tuple[int, int, int]]]:
    """Starts of phonemes, their IPA with stress, and (sample, place, index of its first phoneme) of words."""
    begins: list[int] = []
    sounds: list[str] = []
    words: list[tuple[int, int, int]] = []
    for kind, sample, place, text in events:
        if kind == WORD:
            words.append((min(sample, end), place, len(sounds)))
        elif kind == PHONEME and not text.startswith("("):  # "(en)": the language changes
            begins.append(min(sample, end))
            sounds.append(text)
    return begins, sounds, words


def _words(
    document: Document,
    begins: Sequence[int],
    sounds: Sequence[str],
    events: Sequence[tuple[int, int, int]],
    end: int,
    spoken: Spoken,
) -> list[tuple[int, int]]:
    """For each of our words: its first sample and the one after its last."""
    if not document.words:
        return []
    starts = {place: index for index, (_, place) in enumerate(document.words)}
    groups: list[Group] = []
    last = -1
    for sample, place, first in events:
        # After some punctuation the place is that of the blank before the word.
        index = starts.get(place, starts.get(place + 1, -1))
        if index > last:
            groups.append(Group(sample, first))
            groups[-1].words.append(index)
            last = index
    if not groups:
        groups = [Group(begins[0] if begins else 0, 0)]
    if not groups[0].words or groups[0].words[0] != 0:  # words before the first that was reported
        groups[0].words = [0]
        groups[0].first = 0
    bounds = [group.words[0] for group in groups] + [len(document.words)]
    for k, group in enumerate(groups):
        group.words = list(range(bounds[k], bounds[k + 1]))
    merged = [i for group in groups if len(group.words) > 1 for i in group.words]
    alone = dict(zip(merged, spoken([document.words[i][0] for i in merged]), strict=True)) if merged else {}
    inner = {first: sample for sample, _, first in events}

    found: list[tuple[int, int]] = []
    for k, group in enumerate(groups):
        stop = groups[k + 1].first if k + 1 < len(groups) else len(sounds)
        own = [i for i in range(group.first, stop) if sounds[i]]  # without pauses
        places = [0]
        if len(group.words) > 1:
            hints = {n for n, i in enumerate(own) if i in inner}
            places = cuts([alone[w] for w in group.words], [sounds[i] for i in own], hints)
        places.append(len(own))
        for n in range(len(group.words)):
            mine = own[places[n] : places[n + 1]]
            if n == 0:
                first = group.sample
            elif mine:
                first = inner.get(mine[0], begins[mine[0]])
            else:
                first = found[-1][1]
            until = begins[mine[-1] + 1] if mine and mine[-1] + 1 < len(begins) else end
            found.append((first, max(first, until if mine else first)))
    # A word ends where the next begins at the latest.
    return [
        (first, min(last, found[k + 1][0]) if k + 1 < len(found) else last)
        for k, (first, last) in enumerate(found)
    ]


def _marks(document: Document, events: Sequence[Event], words: Sequence[tuple[int, int]]) -> dict[str, int]:
    """Mark -> sample: where the next word begins; before a <break> and at the end as it is reported."""
    reported: dict[str, int] = {}
    for kind, sample, _, text in events:
        if kind == MARK:
            reported.setdefault(text, sample)
    marks: dict[str, int] = {}
    latest = 0
    for k, mark in enumerate(document.marks):
        before = words[mark.word - 1][1] if mark.word else 0
        following = words[mark.word] if mark.word < len(words) else None
        heard = reported.get(f"m{k}")
        if following is not None and not mark.paused:
            # A reported mark comes too early where espeak-ng puts a little pause before the word.
            sample = following[0]
        else:
            sample = before if heard is None else heard
        latest = max(latest, sample)
        marks.setdefault(mark.name, latest)
    return marks


def _with_closures(begins: Sequence[int], sounds: Sequence[str], pcm: Int16, rate: int) -> list[int]:
    """Starts of the phonemes with each closure given to the stop that it belongs to.

    espeak-ng reports a stop at its burst: the silence of the closure counts to the sound before, and lips
    that follow it would close when the burst is heard.
    """
    begins = list(begins)
    for k in range(1, len(begins)):
        before, here = begins[k - 1], begins[k]
        if not sounds[k] or not sounds[k - 1] or is_vowel(bare(sounds[k])):
            continue
        if abs(int(pcm[here - 1])) > SILENCE:  # mostly
            continue
        loud = np.flatnonzero(np.abs(pcm[before:here].astype(np.int32)) > SILENCE)
        quiet = before + (int(loud[-1]) + 1 if len(loud) else 0)
        if here - quiet >= LEAST_CLOSURE * rate:
            begins[k] = max(quiet, before + round(KEPT_OF_VOWEL * (here - before)))
    return begins


def _phonemes(begins: Sequence[int], sounds: Sequence[str], end: int, rate: int) -> tuple[Phoneme, ...]:
    found: list[tuple[int, str, int]] = [(0, "", 0)] if not begins or begins[0] > 0 else []
    for k, (sample, sound) in enumerate(zip(begins, sounds, strict=True)):
        until = begins[k + 1] if k + 1 < len(begins) else end
        if until <= sample:
            continue
        ipa = sound.replace("ˈ", "").replace("ˌ", "")
        if not ipa and found and not found[-1][1]:
            continue  # two pauses are one
        stress = next((STRESS[c] for c in sound if c in STRESS), 0)
        found.append((sample, ipa, stress))
    ends = [sample for sample, _, _ in found[1:]] + [end]
    return tuple(
        Phoneme(sample / rate, until / rate, ipa, stress)
        for (sample, ipa, stress), until in zip(found, ends, strict=True)
        if until > sample
    )
