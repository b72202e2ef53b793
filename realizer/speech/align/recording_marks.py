"""Utterances from recordings by alignment: words, phonemes and marks."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import numpy.typing as npt

from realizer.core.errors import RealizerError
from realizer.speech.align.aligner import Aligner, align_request
from realizer.speech.align.recording import mono
from realizer.speech.utterance import Recording, SpeechRequest, Utterance

CACHED = 8  # recordings; a document is planned more than once before it plays


def utterance_of_recording(
    pcm: npt.ArrayLike, rate: float, request: SpeechRequest, *, aligner: Aligner | None = None
) -> Utterance:
    """Return a recording as an utterance, with words, phonemes and marks at the times of alignment.

    Args:
        pcm: as in `align`.
        rate: Hz.
        request: the text with its marks; its voice, rate and duration are ignored.
        aligner: the only one to use.

    Raises:
        AlignError, VoiceError: as `align`.
    """
    sound = mono(pcm, rate)
    found, reference = align_request(sound, int(rate), request, aligner, None)
    knots = [(time, at) for a, b in zip(reference.words, found.words, strict=True) for time, at in
             ((a.start, b.start), (a.end, b.end))]  # fmt: skip
    was, now = np.maximum.accumulate(np.array([(0.0, 0.0), *knots]), axis=0).T
    # Words that are adjacent in the reference may have a pause between them here: of knots at one time the
    # last counts, so that a mark before a word is at the start of that word.
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


@lru_cache(CACHED)
def align_recording(request: SpeechRequest, recording: Recording) -> Utterance:
    """Return `utterance_of_recording`, or the sound alone with a warning if it cannot be aligned."""
    try:
        return utterance_of_recording(recording.pcm, recording.rate, request)
    except RealizerError as error:
        warning = f"the lips do not move with the recording: {error}"
        duration = len(recording.pcm) / recording.rate
        return Utterance(duration, (), (), {}, recording.rate, recording.pcm, (warning,))
