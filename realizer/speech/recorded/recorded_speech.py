"""Utterances from recordings, by known times, by alignment, or by their sound alone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from itertools import pairwise
from typing import Protocol, TypeVar

import numpy as np

from realizer import tables
from realizer.core.array_types import Bool, Float64, Int16
from realizer.core.errors import PluginError
from realizer.core.registry import Registry
from realizer.speech.sound_visemes.mel_stream import viseme_facts
from realizer.speech.sound_visemes.recogniser import recognised
from realizer.speech.utterance import Phoneme, Recording, SpeechRequest, Utterance, Word, tile
from realizer.speech.voice_activity import spans_of_voice
from realizer.tables.phonemes import symbols

# Words of a voice are adjacent, while those of a recording may have gaps: the end of a word is mapped as a
# time this much before the start of the next one.
EDGE = 1e-4  # s
SIDE = 1e-3  # letters
# s by which times may be wrong without a warning, as those of many voices are
SLACK = 0.1
SOUNDS = "phonemes or visemes"
OVERLAP = {"words": 0.1, SOUNDS: 0.03}
MILLISECONDS = 10  # lengths of the sound after which a time is probably in another unit
WORD = "word-"  # before the number of a word, from 1 on
STEP = 0.02  # s between the instants at which sounds are compared
CACHED = 8  # recordings; a document is planned more than once before it plays

Timed = TypeVar("Timed", Word, Phoneme)


class Aligner(Protocol):
    """Finds the words of a text in a recording of it."""

    description: str

    def missing(self) -> str | None:
        """Return what to install for its best results, or None."""

    def __call__(self, request: SpeechRequest, recording: Recording, /) -> Utterance:
        """Return the recording as an utterance; without words, but a warning, if it cannot be aligned."""


# The first one is used.
ALIGNERS: Registry[Aligner] = Registry(
    "realizer.aligners",
    {},
    wanted="a realizer.speech.recorded.recorded_speech.Aligner",
    accepts=lambda value: callable(value) and hasattr(value, "missing"),
)


def utterance_of(request: SpeechRequest, recording: Recording) -> Utterance:
    """Return a recording as an utterance, by its times if known, else by alignment, else by its sound.

    Known phonemes are used unchanged; if only words are known, each has the phonemes of the reference voice.
    Words, or phonemes, most of which are outside the sound or name no sound are not used, with a warning.
    Marks are placed before their words. Without times the text is aligned with the sound; without a text
    mouth shapes are recognised in the sound, or if it is no speech, the mouth opens with the loudness.

    Raises:
        VoiceError: if the text is too long, or the reference voice died.
    """
    usable, warnings = _checked(recording)
    found = _placed(request, usable)
    return replace(found, warnings=(*warnings, *found.warnings)) if warnings else found


def _aligned(request: SpeechRequest, recording: Recording) -> Utterance:
    """Return a recording with the words of its text where they are in the sound, or without words."""
    try:
        if not ALIGNERS:
            raise PluginError("no aligner is installed (group realizer.aligners)")
        return ALIGNERS[next(iter(ALIGNERS))](request, recording)
    except PluginError as error:
        warning = f"the words are not found in the recording: {error}"
        return replace(_utterance(recording, (), (), {}), warnings=(warning,))


def _placed(request: SpeechRequest, recording: Recording) -> Utterance:
    from realizer.speech.registry import reference_voice

    if not recording.words and not recording.phonemes:
        if request.ssml.strip():
            found = _aligned(request, recording)
            return found if found.phonemes else replace(found, phonemes=_by_sound(recording))
        return _utterance(recording, (), _by_sound(recording), {})
    words, phonemes = recording.words, recording.phonemes
    if request.ssml.strip() and (request.marks or not words or not phonemes):
        # Its times only count relatively.
        reference = reference_voice().say(
            replace(request, voice=None, rate=1.0, seconds=None, recording=None)
        )
        own = words or _one_word(phonemes, reference)
        was, now = _knots(reference.words, own)
        marks = {name: float(np.interp(time, was, now)) for name, time in reference.marks.items()}

        def moved(part: Timed) -> Timed:
            start, end = np.interp((part.start, part.end - EDGE), was, now).tolist()
            return replace(part, start=start, end=end)

        marks = {**_word_marks(words), **marks}
        words = words or tuple(map(moved, reference.words))
        phonemes = phonemes or tuple(map(moved, reference.phonemes))
        return _utterance(recording, words, phonemes, marks)
    return _utterance(recording, words, phonemes or _by_sound(recording), _word_marks(words))


def _word_marks(words: Sequence[Word]) -> dict[str, float]:
    """Return the marks `word-1`, `word-2` ... at the known words of a recording, so that each is reported."""
    return {f"{WORD}{number}": word.start for number, word in enumerate(words, 1)}


def _utterance(
    recording: Recording, words: Sequence[Word], phonemes: Sequence[Phoneme], marks: dict[str, float]
) -> Utterance:
    """Return an utterance with all times within the sound, and pauses in the gaps between phonemes."""
    duration = len(recording.pcm) / recording.rate
    tiled: list[Phoneme] = []
    now = 0.0
    for phoneme in phonemes:
        start, end = min(max(phoneme.start, now), duration), min(phoneme.end, duration)
        if end <= start:
            continue
        if start > now:
            tiled.append(Phoneme(now, start, ""))
        tiled.append(replace(phoneme, start=start, end=end))
        now = end
    if tiled and now < duration:
        tiled.append(Phoneme(now, duration, ""))
    kept = tuple(replace(w, start=min(w.start, duration), end=min(w.end, duration)) for w in words)
    inside = {name: min(max(time, 0.0), duration) for name, time in marks.items()}
    return Utterance(duration, kept, tuple(tiled), inside, recording.rate, recording.pcm)


@lru_cache(CACHED)
def _checked(recording: Recording) -> tuple[Recording, tuple[str, ...]]:
    """Return a recording with the words and phonemes that can be used, and what is wrong with the others."""
    duration = len(recording.pcm) / recording.rate
    given, unit = _in_seconds("words", recording.words, duration)
    words, wrong = _usable("words", given, duration)
    heard, other = _in_seconds(SOUNDS, recording.phonemes, duration)
    phonemes, more = _usable(SOUNDS, heard, duration)
    if (words, phonemes) != (recording.words, recording.phonemes):
        recording = replace(recording, words=words, phonemes=phonemes)
    return recording, (*recording.warnings, *unit, *wrong, *other, *more)


def _in_seconds(
    kind: str, given: tuple[Timed, ...], duration: float
) -> tuple[tuple[Timed, ...], tuple[str, ...]]:
    """Return items in seconds, and a sentence if they were in milliseconds: then they are far outside."""
    last = max((item.start for item in given), default=0.0)
    if not MILLISECONDS * duration < last <= 1000 * (duration + SLACK):
        return given, ()
    text = f"wanted {kind} in seconds within {duration:.2f} s, got one at {last:g}: taken as milliseconds"
    return tuple(replace(i, start=i.start / 1000, end=i.end / 1000) for i in given), (text,)


def _usable(kind: str, given: tuple[Timed, ...], duration: float) -> tuple[tuple[Timed, ...], list[str]]:
    """Return items, none if most cannot be used, and a sentence for each kind of fault."""
    spoken = [(item, text) for item in given if (text := _text_of(item).strip())]
    late = [(item, text) for item, text in spoken if item.start > duration + SLACK]
    turned = [(item, text) for item, text in spoken if item.end < item.start]
    mute = [text for item, text in spoken if isinstance(item, Phoneme) and not symbols(text)]
    torn = [(a, b) for a, b in pairwise(given) if a.end > b.start + OVERLAP[kind]]
    faults: list[str] = []
    if late:
        item, text = late[0]
        faults.append(
            f"wanted {kind} that begin within the {duration:.2f} s of the sound, got {text!r} at "
            f"{item.start:.2f} s{_more(late)}"
        )
    if turned:
        item, text = turned[0]
        faults.append(
            f"wanted {kind} that begin before they end, got {text!r} from {item.start:.2f} s "
            f"to {item.end:.2f} s{_more(turned)}"
        )
    if torn:
        one, two = torn[0]
        faults.append(
            f"wanted {kind} that follow each other, got {_text_of(one)!r} up to {one.end:.2f} s and "
            f"{_text_of(two)!r} from {two.start:.2f} s on{_more(torn)}"
        )
    if mute:
        faults.append(f'wanted phonemes in IPA, or "" for a pause, got {mute[0]!r}{_more(mute)}')
    bad = set(mute)
    good = sum(item.start < min(item.end, duration) and text not in bad for item, text in spoken)
    if spoken and (not good or 2 * good < len(spoken)):
        return (), [*faults, f"these {kind} are not used"]
    return tuple(replace(item, end=max(item.start, item.end)) for item in given), faults


def _text_of(item: Word | Phoneme) -> str:
    return item.text if isinstance(item, Word) else item.ipa


def _more(found: Sequence[object]) -> str:
    return f", and {len(found) - 1} more" if len(found) > 1 else ""


def _one_word(phonemes: Sequence[Phoneme], reference: Utterance) -> tuple[Word, ...]:
    """Return all the text as one word, from the first sound to the last."""
    spoken = [p for p in phonemes if p.ipa] or list(phonemes)
    return (Word(spoken[0].start, spoken[-1].end, "".join(w.text for w in reference.words)),)


def _knots(reference: Sequence[Word], own: Sequence[Word]) -> tuple[Float64, Float64]:
    """Return times in the reference and in the recording at which the same letters of the text are spoken.

    Letters are compared because recordings may divide the text into other words.
    """
    letters, times = _letters(reference)
    places, instants = _letters(own)
    if not len(times) or not len(instants):
        return np.zeros(1), np.zeros(1)
    if len(own) == 1 and len(reference) > 1:  # a single span for all words: scale the reference
        return times[[0, -1]], instants[[0, -1]]
    # If there is a pause between two words, it belongs to neither.
    beside = np.where(np.arange(len(letters)) % 2 == 0, SIDE, -SIDE)
    times[1::2] -= EDGE
    return times, np.interp(letters * (places[-1] / letters[-1]) + beside, places, instants)


def _letters(words: Sequence[Word]) -> tuple[Float64, Float64]:
    """Return the number of letters of the text before each word's start and end, and the times of these."""
    spoken = [(word, sum(map(str.isalnum, word.text))) for word in words]
    spoken = [(word, length) for word, length in spoken if length]
    ends = np.cumsum([length for _, length in spoken], dtype=np.float64)
    letters = np.column_stack([np.append(0.0, ends)[:-1], ends]).ravel()
    times = np.array([time for word, _ in spoken for time in (word.start, word.end)], np.float64)
    return letters, np.maximum.accumulate(times)


@lru_cache(CACHED)
def _by_sound(recording: Recording) -> tuple[Phoneme, ...]:
    """Return the phonemes that are heard; if the sound is no speech, vowels that follow the loudness.

    Noise and hum are pauses.
    """
    pcm, rate = recording.pcm, recording.rate
    spans = spans_of_voice(pcm, rate)
    if not spans:
        return ()
    loudness = by_loudness(pcm, rate)
    heard = recognised(pcm, rate) if recording.heard is None else recording.heard
    return _inside(spans, heard if _is_speech(heard, loudness) else loudness)


def _inside(spans: Sequence[tuple[float, float]], phonemes: Sequence[Phoneme]) -> tuple[Phoneme, ...]:
    """Return phonemes that cover a sound, with pauses outside of some spans of it."""
    starts = [(0.0, "", 0)]
    for phoneme in phonemes:
        for begin, end in spans:
            if phoneme.ipa and phoneme.start < end and phoneme.end > begin:
                starts.append((max(phoneme.start, begin), phoneme.ipa, phoneme.stress))
                starts.append((min(phoneme.end, end), "", 0))
    return tile(starts, phonemes[-1].end) if phonemes else ()


def _is_speech(heard: Sequence[Phoneme], loudness: Sequence[Phoneme]) -> bool:
    """Return whether the loud parts of a sound are heard as sounds that are loud in speech."""
    if not heard or not loudness:
        return False
    facts = viseme_facts()
    resonant = {row["ipa"] for row in facts["class"] if row.get("resonant")}
    loudest = tables.toml_table("envelope.toml")["opening"][0]["ipa"]
    times = np.arange(0.0, loudness[-1].end, STEP)
    is_loud = _at([p.ipa == loudest for p in loudness], loudness, times)
    is_resonant = _at([p.ipa in resonant for p in heard], heard, times)
    return bool((is_loud & is_resonant).sum() > facts["resonant"] * is_loud.sum())


def _at(values: Sequence[bool], phonemes: Sequence[Phoneme], times: Float64) -> Bool:
    return np.array(values)[np.searchsorted([p.start for p in phonemes], times, "right") - 1]


def by_loudness(pcm: Int16, rate: int) -> tuple[Phoneme, ...]:
    """Return vowels that are the more open the louder the sound (n,) is (`envelope.toml`); () for silence.

    Phonemes and pauses cover the sound without gaps.
    """
    facts = tables.toml_table("envelope.toml")
    size = max(1, round(facts["window"] * rate))
    count = -(-len(pcm) // size)
    padded = np.zeros(count * size)
    padded[: len(pcm)] = pcm
    rms = np.sqrt(np.mean(padded.reshape(count, size) ** 2, axis=1))
    loud = float(np.quantile(rms, facts["loud"])) if count else 0.0
    if loud < facts["quietest"]:
        return ()
    level = 20 * np.log10(np.maximum(rms, 1e-9) / loud)
    sounds = [next((s["ipa"] for s in facts["opening"] if one >= s["above"]), "") for one in level]
    starts = [k for k in range(count) if k == 0 or sounds[k] != sounds[k - 1]]
    return tile([(k * size, sounds[k], 0) for k in starts], len(pcm), rate)


@dataclass(frozen=True, slots=True)
class NamedViseme:
    """A row of the table; `ipa` is "" for silence."""

    set: str
    viseme: str
    ipa: str


def sound_of(set: str, viseme: str) -> str:
    """Return the IPA whose mouth shape the viseme is; "" for silence.

    Raises:
        KeyError: if there is no such set, or no such viseme in it; the text lists the known ones.
    """
    if set not in _sounds():
        raise KeyError(f"wanted a set of visemes of {', '.join(_sounds())}, got {set!r}")
    known = _sounds()[set]
    if viseme not in known:
        raise KeyError(f"wanted a viseme of {set}: {', '.join(known)}; got {viseme!r}")
    return known[viseme]


@cache
def _sounds() -> Mapping[str, Mapping[str, str]]:
    rows = tables.csv_rows("visemes_given.csv", NamedViseme)
    return {
        name: {r.viseme: r.ipa for r in rows if r.set == name} for name in dict.fromkeys(r.set for r in rows)
    }
