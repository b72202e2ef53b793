"""The times of a recorded speech that its document gives: of marks, words and visemes."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache

from bml_schema import Speech
from bml_schema.nodes import RECORDED, own
from realizer import tables
from realizer.speech.utterance import GivenTimes, Phoneme, Recording, Utterance, Word, tile

CACHED = 32  # descriptions; a document is planned more than once before it plays


@dataclass(frozen=True, slots=True)
class _Mouth:
    viseme: str
    ipa: str  # "" for silence


@dataclass(frozen=True, slots=True)
class _Phoneme:
    arpabet: str
    ipa: str


def at_given_times(said: Utterance, given: GivenTimes) -> Utterance:
    """Return what a voice said, stretched to the marks and the end of given times, with their visemes."""
    return Utterance(
        duration=said.duration or given.duration,
        # Times may be given for a part of the words.
        words=given.words if _letters(given.words) == _letters(said.words) else said.words or given.words,
        # Visemes may be given for a part of the words.
        phonemes=(*given.phonemes, *(p for p in said.phonemes if p.start >= given.last)),
        marks={**said.marks, **given.marks},
        sample_rate=said.sample_rate,
        pcm=said.pcm,
        warnings=said.warnings,
    )


def _letters(words: tuple[Word, ...]) -> str:
    return "".join(filter(str.isalnum, "".join(word.text for word in words))).casefold()


@lru_cache(CACHED)
def with_times(recording: Recording, given: GivenTimes) -> Recording:
    """Return a recording with given times."""
    return Recording(
        recording.rate,
        recording.pcm,
        recording.text,
        given.words or recording.words,
        given.phonemes if given.last > given.duration / 2 else recording.phonemes,
        recording.heard,
    )


def given_times(node: Speech) -> GivenTimes | None:
    """Return the times that a speech gives of its recording, or None."""
    found = next((d.content for d in node.descriptions if d.type == RECORDED), None)
    return None if found is None else _read(found)


@lru_cache(CACHED)
def _read(content: str) -> GivenTimes | None:
    try:
        recorded = ElementTree.fromstring(content)
        marks = {m.get("name", ""): float(m.get("time", "")) for m in recorded.iter(own("mark"))}
        words = tuple(
            Word(float(w.get("start", "")), float(w.get("end", "")), w.text or "")
            for w in recorded.iter(own("word"))
        )
        visemes = sorted(
            (float(v.get("start", "")), float(v.get("end", "")), v.get("name", ""))
            for v in recorded.iter(own("viseme"))
        )
    except (ElementTree.ParseError, ValueError):
        return None
    unknown = dict.fromkeys(name for *_, name in visemes if name.lower() not in _mouths())
    return GivenTimes(marks, words, _phonemes(visemes), tuple(unknown))


def _phonemes(visemes: list[tuple[float, float, str]]) -> tuple[Phoneme, ...]:
    """Return the sounds of visemes, without gaps: the mouth is closed between them."""
    starts: list[tuple[float, str, int]] = []
    now = 0.0
    for start, end, name in visemes:
        if start > now:
            starts.append((now, "", 0))
        starts.append((start, _mouths().get(name.lower(), ""), 0))
        now = max(now, end)
    return tile(starts, now)


@cache
def _mouths() -> Mapping[str, str]:
    """Return name of a viseme or of a phoneme of ARPAbet, in lower case -> IPA."""
    known: dict[str, str] = {}
    for phoneme in tables.csv_rows("phonemes_arpabet.csv", _Phoneme):
        known.setdefault(phoneme.arpabet.lower(), phoneme.ipa)  # the first row is its sound
    return known | {row.viseme.lower(): row.ipa for row in tables.csv_rows("visemes_smartbody.csv", _Mouth)}
