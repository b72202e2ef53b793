"""Utterances from recordings: words, phonemes and the times of marks."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from realizer.core.errors import RealizerError
from realizer.speech.align.aligner import Aligner, align_request
from realizer.speech.align.recording import mono
from realizer.speech.utterance import Recording, SpeechRequest, Utterance

KEPT = 8  # recordings; a document is looked at more than once before it plays


def utterance_of_recording(
    pcm: npt.ArrayLike, rate: float, request: SpeechRequest, *, aligner: Aligner | None = None
) -> Utterance:
    """A recording of what is asked for as an utterance: its words, phonemes and marks where they are heard.

    Args:
        pcm: as in `align`.
        rate: Hz.
        request: the text with its marks; how it is to be spoken does not matter.
        aligner: only this one.

    Raises:
        AlignError, VoiceError: as `align`.
    """
    sound = mono(pcm, rate)
    found, reference = align_request(sound, int(rate), request, aligner, None)
    knots = [(time, at) for a, b in zip(reference.words, found.words, strict=True) for time, at in
             ((a.start, b.start), (a.end, b.end))]  # fmt: skip
    was, now = np.maximum.accumulate(np.array([(0.0, 0.0), *knots]), axis=0).T
    # A word that follows another at once in the reference may follow a pause here: of knots at one time the
    # last counts, so that a mark before a word comes when that word does.
    marks = {name: float(np.interp(time, was, now)) for name, time in reference.marks.items()}
    return Utterance(
        duration=len(sound) / rate,
        words=found.words,
        phonemes=found.phonemes,
        marks=marks,
        sample_rate=int(rate),
        pcm=np.rint(sound * 32767).astype(np.int16),
        warnings=found.warnings,
    )


@lru_cache(KEPT)
def align_recording(request: SpeechRequest, recording: Recording) -> Utterance:
    """As `utterance_of_recording`; it sounds also where it cannot be aligned, with a warning."""
    try:
        return utterance_of_recording(recording.pcm, recording.rate, request)
    except RealizerError as error:
        told = f"the lips do not move with the recording: {error}"
        duration = len(recording.pcm) / recording.rate
        return Utterance(duration, (), (), {}, recording.rate, recording.pcm, (told,))
