"""Times of words, phonemes and marks from the answers of espeak-ng's process."""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from realizer.core.array_types import Int16
from realizer.speech.espeak.document import Document
from realizer.speech.utterance import STRETCH, Phoneme, Utterance, Word, tile
from realizer.speech.words import divided, is_vowel, strip_marks

STRESS = {"ˈ": 1, "ˌ": 2}
SILENCE = 8  # of 32768; a closure is exact zeros, except for the tail of the sound before
MIN_CLOSURE = 0.01  # s
KEPT_OF_VOWEL = 0.4  # of a sound whose end is given to a closure

Spoken = Callable[[Sequence[str]], Sequence[Sequence[str]]]
WORD, MARK, END, PHONEME = 1, 3, 5, 7

Event = tuple[int, int, int, str]

# espeak_EVENT of speak_lib.h; `text` is a phoneme, which has no terminating 0 if it takes all eight bytes.
LAYOUT = np.dtype(
    [
        ("type", np.intc),
        ("unique_identifier", np.uintc),
        ("place", np.intc),
        ("length", np.intc),
        ("audio_position", np.intc),
        ("sample", np.intc),
        ("user_data", np.uintp),
        ("text", "S8"),
    ],
    align=True,
)


def timeline(document: Document, events: Sequence[Event], pcm: Int16, rate: int, spoken: Spoken) -> Utterance:
    """Return the utterance; its phonemes and pauses cover 0..len(pcm)/rate without gaps.

    Args:
        events: (type, sample, place, text) in order.
        spoken: returns the phonemes of words spoken separately; called if espeak-ng merged words.
    """
    events = _linked(events)
    begins, sounds, word_events = _sounds(events, len(pcm))
    words = _words(document, begins, sounds, word_events, len(pcm), spoken)
    marks = _marks(document, events, words)
    return Utterance(
        duration=len(pcm) / rate,
        words=tuple(
            Word(first / rate, last / rate, text)
            for (text, _), (first, last) in zip(document.words, words, strict=True)
        ),
        phonemes=_phonemes(_with_closures(begins, sounds, pcm, rate), sounds, len(pcm), rate),
        marks={name: sample / rate for name, sample in marks.items()},
        sample_rate=rate,
        pcm=pcm,
        stretch=STRETCH,
    )


def _linked(events: Sequence[Event]) -> list[Event]:
    """Return the events with words and marks that are too early moved to their first phoneme.

    If a nasal continues into a vowel ("one of", "am in"), espeak-ng reports the second word after the nasal,
    but with the time at which the nasal starts.
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
    """Return starts of phonemes, their IPA with stress, and (sample, place, first phoneme) of words."""
    begins: list[int] = []
    sounds: list[str] = []
    words: list[tuple[int, int, int]] = []
    for kind, sample, place, text in events:
        if kind == WORD:
            words.append((min(sample, end), place, len(sounds)))
        elif kind == PHONEME and not text.startswith("("):  # "(en)": the language changes
            begins.append(min(sample, end))
            sounds.append(text)
    # Above 400 words a minute, espeak-ng reports some sounds after those that follow them.
    return sorted(begins), sounds, words


def _words(
    document: Document,
    begins: Sequence[int],
    sounds: Sequence[str],
    events: Sequence[tuple[int, int, int]],
    end: int,
    spoken: Spoken,
) -> list[tuple[int, int]]:
    """Return (first sample, sample after the last) of each word of the document."""
    if not document.words:
        return []
    starts = {place: index for index, (_, place) in enumerate(document.words)}
    # Runs of phonemes that start where espeak-ng reports a word: (sample, first phoneme, first word).
    groups: list[tuple[int, int, int]] = []
    for sample, place, first in events:
        # After some punctuation the place is the blank before the word.
        index = starts.get(place, starts.get(place + 1, -1))
        if index > (groups[-1][2] if groups else -1):
            groups.append((sample, first, index))
    if not groups:
        groups = [(begins[0] if begins else 0, 0, 0)]
    elif groups[0][2]:  # words before the first reported one
        groups[0] = (groups[0][0], 0, 0)
    following = [*groups[1:], (end, len(sounds), len(document.words))]
    inside = [range(group[2], after[2]) for group, after in zip(groups, following, strict=True)]
    merged = [i for words in inside if len(words) > 1 for i in words]
    alone = dict(zip(merged, spoken([document.words[i][0] for i in merged]), strict=True)) if merged else {}
    inner = {first: sample for sample, _, first in events}

    found: list[tuple[int, int]] = []
    for (sample, opens, _), (_, stop, _), words in zip(groups, following, inside, strict=True):
        own = [i for i in range(opens, stop) if sounds[i]]  # without pauses
        hints = {n for n, i in enumerate(own) if i in inner}
        parts = divided(own, [alone.get(i, ()) for i in words], [sounds[i] for i in own], hints)
        for n, part in enumerate(parts):
            if n == 0:
                first = sample
            elif part:
                first = inner.get(part[0], begins[part[0]])
            else:
                first = found[-1][1]
            until = begins[part[-1] + 1] if part and part[-1] + 1 < len(begins) else end
            found.append((first, max(first, until if part else first)))
    # A word ends at the latest where the next one begins.
    return [
        (first, min(last, found[k + 1][0]) if k + 1 < len(found) else last)
        for k, (first, last) in enumerate(found)
    ]


def _marks(document: Document, events: Sequence[Event], words: Sequence[tuple[int, int]]) -> dict[str, int]:
    """Return the sample of each mark: the start of the next word; as reported before a <break> or the end."""
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
            # The reported time is too early if espeak-ng makes a short pause before the word.
            sample = following[0]
        else:
            sample = before if heard is None else heard
        latest = max(latest, sample)
        marks.setdefault(mark.name, latest)
    return marks


def _with_closures(begins: Sequence[int], sounds: Sequence[str], pcm: Int16, rate: int) -> list[int]:
    """Return the starts of phonemes with each closure added to its stop.

    espeak-ng reports a stop at its burst and counts the silence of the closure as part of the sound before,
    so that lips would close only when the burst is heard.
    """
    begins = list(begins)
    loud = (pcm > SILENCE) | (pcm < -SILENCE)
    mostly = [True, *loud.take([start - 1 for start in begins[1:]], mode="wrap").tolist()]
    for k in range(1, len(begins)):
        before, start = begins[k - 1], begins[k]
        # In fast speech, the last sounds may begin after the end of the sound.
        if mostly[k] or before >= min(start, len(loud)):
            continue
        if not sounds[k] or not sounds[k - 1] or _is_vowel(sounds[k]):
            continue
        backwards = loud[before:start][::-1]
        still = int(backwards.argmax())  # 0 also if nothing is loud
        quiet = start - still if still else before
        if start - quiet >= MIN_CLOSURE * rate:
            begins[k] = max(quiet, before + round(KEPT_OF_VOWEL * (start - before)))
    return begins


def _phonemes(begins: Sequence[int], sounds: Sequence[str], end: int, rate: int) -> tuple[Phoneme, ...]:
    spans = zip(begins, [*begins[1:], end], sounds, strict=False)
    starts = [(sample, *_plain(sound)) for sample, until, sound in spans if until > sample]
    return tile(starts if begins and begins[0] == 0 else [(0, "", 0), *starts], end, rate)


# There are only a few hundred different sounds.
@lru_cache(maxsize=2048)
def _plain(sound: str) -> tuple[str, int]:
    stress = next((STRESS[c] for c in sound if c in STRESS), 0)
    return sound.replace("ˈ", "").replace("ˌ", ""), stress


@lru_cache(maxsize=2048)
def _is_vowel(sound: str) -> bool:
    return is_vowel(strip_marks(sound))


def read_answer(head: Mapping[str, Any], body: bytes) -> tuple[list[Event], Int16]:
    """Parse an answer to "say" of `espeak_worker`.

    Return (type, sample, place, text) of words, marks, phonemes and ends in order, where `text` is a
    phoneme's IPA or a mark's name; and (n,) int16 samples, read-only.
    """
    size: int = head["events"]
    fields = np.frombuffer(body, LAYOUT, size // LAYOUT.itemsize)
    marks = iter(head["marks"])
    events: list[Event] = []
    columns = (fields[name].tolist() for name in ("type", "sample", "place", "text"))
    for kind, sample, place, raw in zip(*columns, strict=True):
        if kind == PHONEME:
            events.append((kind, sample, place, _label(raw)))
        elif kind == MARK:
            events.append((kind, sample, place, next(marks)))
        elif kind in (WORD, END):
            events.append((kind, sample, place, ""))
    return events, np.frombuffer(body, "<i2", offset=size)


# A language has about a hundred.
@lru_cache(maxsize=2048)
def _label(raw: bytes) -> str:
    return raw.split(b"\0")[0].decode("utf-8", "replace")
