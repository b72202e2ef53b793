"""What is to be said, and how long it is to last, in; an utterance of that length out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from realizer.speech.utterance import Say, Utterance, Voice

__all__ = ["fitted", "stretched"]

# A voice is asked again at another rate so often; its rate has steps, and pauses do not stretch evenly.
TRIES = 3
# What is left is made up for by playing it faster or slower by so little (a tenth of a semitone) that nobody
# hears it.
NEAR = 0.006


def fitted(voice: Voice, say: Say) -> Utterance:
    """Speak, `say.seconds` long where that is given: at another rate, and what is left by resampling.

    Raises:
        VoiceError: as `voice.say`.
    """
    utterance = voice.say(replace(say, seconds=None))
    if say.seconds is None or not utterance.duration:
        return utterance
    rate = say.rate
    for _ in range(TRIES):
        ratio = utterance.duration / say.seconds
        if abs(ratio - 1.0) <= NEAR:
            break
        rate *= ratio
        utterance = voice.say(replace(say, rate=rate, seconds=None))
    return stretched(utterance, say.seconds)


def stretched(utterance: Utterance, seconds: float) -> Utterance:
    """The same utterance, exactly so long; it does not stretch any more."""
    ratio = seconds / utterance.duration
    pcm = utterance.pcm
    if pcm is not None:
        at = np.linspace(0.0, len(pcm) - 1.0, round(seconds * utterance.sample_rate))
        pcm = np.rint(np.interp(at, np.arange(len(pcm)), pcm)).astype(np.int16)
    return replace(
        utterance,
        duration=seconds,
        words=tuple(replace(w, start=w.start * ratio, end=w.end * ratio) for w in utterance.words),
        phonemes=tuple(replace(p, start=p.start * ratio, end=p.end * ratio) for p in utterance.phonemes),
        marks={name: time * ratio for name, time in utterance.marks.items()},
        pcm=pcm,
        stretch=(1.0, 1.0),
    )
