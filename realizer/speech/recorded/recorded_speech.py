"""Utterances from a recording and its known times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from realizer.core.array_types import Float64
from realizer.speech.recorded.loudness_lips import by_loudness
from realizer.speech.utterance import Phoneme, Recording, SpeechRequest, Utterance, Word

# Words of a voice touch where those of a recording may lie apart: what ends with a word ends so much before
# the next one begins.
EDGE = 1e-4  # s
SIDE = 1e-3  # letters


def utterance_of(request: SpeechRequest, recording: Recording) -> Utterance:
    """The recording as an utterance: by the times that came with it, or else aligned, or else by loudness.

    Phonemes that were told move the lips as they are; of words alone, each has the phonemes a voice gives
    it. Marks of the text come before the word that they stand before. Without times the text is found in the
    sound; without a text the mouth opens as the sound is loud.

    Raises:
        VoiceError: the text is too long, or the voice died that knows what its phonemes are.
    """
    # Imported here: what it needs takes longer to load than most texts to speak.
    from realizer.speech.align.recording_marks import align_recording

    if not recording.words and not recording.phonemes:
        if request.ssml.strip():
            found = align_recording(request, recording)
            return found if found.phonemes else replace(found, phonemes=_opening(recording))
        return _utterance(recording, (), _opening(recording), {})
    words, phonemes = recording.words, recording.phonemes
    if request.ssml.strip() and (request.marks or not words or not phonemes):
        reference = _reference(request)
        own = words or _one_word(phonemes, reference)
        was, now = _knots(reference.words, own)
        marks = {name: float(np.interp(time, was, now)) for name, time in reference.marks.items()}
        if not words:
            words = tuple(
                replace(w, start=float(s), end=float(e))
                for w, s, e in zip(
                    reference.words,
                    np.interp([w.start for w in reference.words], was, now),
                    np.interp([w.end - EDGE for w in reference.words], was, now),
                    strict=True,
                )
            )
        if not phonemes:
            phonemes = tuple(
                replace(
                    p, start=float(np.interp(p.start, was, now)), end=float(np.interp(p.end - EDGE, was, now))
                )
                for p in reference.phonemes
            )
        return _utterance(recording, words, phonemes, marks)
    return _utterance(recording, words, phonemes or _opening(recording), {})


def _utterance(
    recording: Recording, words: Sequence[Word], phonemes: Sequence[Phoneme], marks: dict[str, float]
) -> Utterance:
    """Everything inside the sound, phonemes without gaps."""
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
    kept = (replace(w, start=min(w.start, duration), end=min(w.end, duration)) for w in words)
    inside = {name: min(max(time, 0.0), duration) for name, time in marks.items()}
    return Utterance(duration, tuple(kept), tuple(tiled), inside, recording.rate, recording.pcm)


def _opening(recording: Recording) -> tuple[Phoneme, ...]:
    return by_loudness(recording.pcm, recording.rate)


def _reference(request: SpeechRequest) -> Utterance:
    """What a voice makes of the same text; its times are those of nobody."""
    from realizer.speech.registry import reference_voice

    return reference_voice().say(replace(request, voice=None, rate=1.0, seconds=None, recording=None))


def _one_word(phonemes: Sequence[Phoneme], reference: Utterance) -> tuple[Word, ...]:
    """All the text as one word, from the first sound to the last."""
    said = [p for p in phonemes if p.ipa] or list(phonemes)
    return (Word(said[0].start, said[-1].end, "".join(w.text for w in reference.words)),)


def _knots(reference: Sequence[Word], own: Sequence[Word]) -> tuple[Float64, Float64]:
    """Times of the reference, and of the recording: where the same letters of the text are said.

    Whoever times words may divide them otherwise than we do; letters are the same.
    """
    letters, times = _letters(reference)
    places, instants = _letters(own)
    if not len(times) or not len(instants):
        return np.zeros(1), np.zeros(1)
    if len(own) == 1 and len(reference) > 1:  # one stretch of sound: as the reference goes, evenly
        return times[[0, -1]], instants[[0, -1]]
    # Between two words a pause may lie: a word begins behind it, and ends before it.
    beside = np.where(np.arange(len(letters)) % 2 == 0, SIDE, -SIDE)
    times[1::2] -= EDGE
    return times, np.interp(letters * (places[-1] / letters[-1]) + beside, places, instants)


def _letters(words: Sequence[Word]) -> tuple[Float64, Float64]:
    """How many letters of the text come before each word's start and end, and when that is."""
    said = [(word, sum(map(str.isalnum, word.text))) for word in words]
    said = [(word, length) for word, length in said if length]
    ends = np.cumsum([length for _, length in said], dtype=np.float64)
    letters = np.column_stack([np.append(0.0, ends)[:-1], ends]).ravel()
    times = np.array([time for word, _ in said for time in (word.start, word.end)], np.float64)
    return letters, np.maximum.accumulate(times)
