"""Forced alignment of recordings with their text, by the best aligner installed."""

import logging
from dataclasses import replace
from functools import lru_cache
from typing import Literal
from xml.sax.saxutils import escape

import numpy as np
import numpy.typing as npt

from realizer.core.array_types import Float32, Float64
from realizer.core.errors import RealizerError
from realizer.speech.letter_to_sound import subtag
from realizer.speech.registry import reference_voice
from realizer.speech.utterance import Recording, SpeechRequest, Utterance, Voice
from realizer_studio.align import features, sphinx
from realizer_studio.align.alignment import AlignError, Alignment, moved
from realizer_studio.align.dtw_align import dtw_align
from realizer_studio.align.features import mono, to_aligner

Aligner = Literal["pocketsphinx", "espeak"]

DOUBT = 0.5  # a smaller confidence is a warning
OTHER = "+f3"  # a female voice of espeak-ng, in addition to the default, which is male
FASTEST = 4.0  # times the rate of a voice; nobody speaks faster

HOP = 160  # samples between the frames in which sound is audible or not
INSTALL = "no aligner, words are spread evenly: pip install 'bml-realizer[speech,align]'"
CACHED = 8  # recordings; a document is planned more than once before it plays

log = logging.getLogger(__name__)


def align(
    pcm: npt.ArrayLike,
    rate: float,
    text: str,
    language: str = "en-US",
    *,
    aligner: Aligner | None = None,
    voice: Voice | None = None,
) -> Alignment:
    """Find the times of the words and phonemes of a text in a recording.

    English is aligned by pocketsphinx if it is installed; other languages, and recordings that it cannot
    align, by warping espeak-ng's speech to the recording. Without either, words are spread over the sound.

    Args:
        pcm: (n,) or (n, channels) samples: int16, int32 or floats in -1..1.
        rate: Hz.
        language: BCP-47.
        aligner: the only one to use.
        voice: used instead of espeak-ng.

    Raises:
        AlignError: if the recording, the text or the given aligner cannot be used.
        VoiceError: if the text is too long, or espeak-ng died.
    """
    return align_request(
        mono(pcm, rate), int(rate), SpeechRequest(escape(text), language=language), aligner, voice
    )[0]


def align_request(
    sound: Float32, rate: int, request: SpeechRequest, aligner: Aligner | None, voice: Voice | None
) -> tuple[Alignment, Utterance]:
    """Align a recording (n,), -1..1, and return a voice's utterance of the request too; see `align`.

    The voice, rate and duration of the request are ignored.
    """
    heard, duration = to_aligner(sound, rate), len(sound) / rate
    if reason := _unusable_reason(aligner, voice):
        raise AlignError(reason)
    speaker = voice or reference_voice()
    plain = replace(request, voice=None, rate=1.0, seconds=None, recording=None)
    reference = speaker.say(plain)
    if not reference.words:
        raise AlignError("text: wanted words, got none")
    needed = reference.words[-1].end - reference.words[0].start
    if duration < needed / FASTEST:
        raise AlignError(
            f"recording: wanted about {needed:.1f} s for {len(reference.words)} words, got {duration:.2f} s"
        )
    warnings = reference.warnings
    found = None
    if aligner == "pocketsphinx" or (
        aligner is None and subtag(request.language) == "en" and not sphinx.install_hint()
    ):
        found = sphinx.model_align(heard, duration, reference)
        if found is None:
            reason = "pocketsphinx does not find the text in the recording"
            if aligner is not None:
                raise AlignError(reason)
            log.info("%s: aligned by espeak-ng instead", reason)
    if found is None:
        if reference.pcm is None:
            found = uniform_align(heard, duration, reference)
        else:
            others = [speaker.say(replace(plain, voice=OTHER))] if voice is None else []
            found = dtw_align(heard, duration, [reference, *others])
    if found.confidence < DOUBT and found.aligner != "even":
        warnings += (f"the recording does not sound like the text (confidence {found.confidence:.2f})",)
    return replace(found, warnings=(*warnings, *found.warnings)), reference


def _unusable_reason(aligner: str | None, voice: Voice | None) -> str | None:
    from realizer.speech.espeak import voice as espeak

    if aligner not in (None, "pocketsphinx", "espeak"):
        return f"aligner: wanted pocketsphinx or espeak, got {aligner!r}"
    if aligner == "pocketsphinx":
        return sphinx.install_hint()
    return espeak.install_hint() if aligner == "espeak" and voice is None else None


def uniform_align(sound: Float32, duration: float, reference: Utterance) -> Alignment:
    """Spread the words of the reference over the audible parts of the recording; the confidence is 0."""
    loud = features.loudness(features.energies(sound, HOP))
    _, talks = features.voice_activity(loud)
    passed = np.append(0.0, np.cumsum(talks)) / max(int(talks.sum()), 1)
    passed += np.arange(len(passed)) * 1e-12  # strictly rising, so that it has an inverse
    times = np.minimum(np.arange(len(passed)) * HOP / features.RATE, duration)
    first, last = reference.words[0].start, reference.words[-1].end

    def spread(pairs: Float64) -> Float64:
        return np.interp(np.clip((pairs - first) / max(last - first, 1e-6), 1e-6, 1.0), passed, times)

    words = spread(np.array([(w.start, w.end) for w in reference.words]))
    phonemes = spread(np.array([(p.start, p.end) for p in reference.phonemes]))
    found = moved("even", reference, duration, words, phonemes, [0.0] * len(words), 0.0)
    return replace(found, warnings=(INSTALL,))


@lru_cache(CACHED)
def align_recording(request: SpeechRequest, recording: Recording) -> Utterance:
    """Return a recording as an utterance, with words, phonemes and marks at the times of alignment.

    If it cannot be aligned, return the sound alone with a warning. Voice, rate and duration of the request
    are ignored.
    """
    pcm, rate = recording.pcm, recording.rate
    try:
        sound = mono(pcm, rate)
        found, reference = align_request(sound, rate, request, None, None)
    except RealizerError as error:
        warning = f"the lips do not move with the recording: {error}"
        return Utterance(len(pcm) / rate, (), (), {}, rate, pcm, (warning,))
    knots = [(time, at) for a, b in zip(reference.words, found.words, strict=True) for time, at in
             ((a.start, b.start), (a.end, b.end))]  # fmt: skip
    was, now = np.maximum.accumulate(np.array([(0.0, 0.0), *knots]), axis=0).T
    # Words that are adjacent in the reference may have a pause between them here: of knots at one time the
    # last counts, so that a mark before a word is at the start of that word.
    marks = {name: float(np.interp(time, was, now)) for name, time in reference.marks.items()}
    return Utterance(len(pcm) / rate, found.words, found.phonemes, marks, rate, pcm, found.warnings)


class RecordingAligner:
    """The entry point `realizer.aligners`: `align_recording`, and what is missing for it."""

    description = "pocketsphinx finds words in recordings of English"

    def missing(self) -> str | None:
        """Return what to install for pocketsphinx, or None."""
        return sphinx.install_hint()

    def __call__(self, request: SpeechRequest, recording: Recording, /) -> Utterance:
        """Return a recording as an utterance with the words of its text, as `align_recording` does."""
        return align_recording(request, recording)


ALIGNER = RecordingAligner()
