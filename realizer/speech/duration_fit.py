"""Synthesis to a given duration, by speaking rate and a small time stretch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from realizer.core.errors import VoiceError
from realizer.speech.utterance import WARP, SpeechRequest, Utterance, Voice
from realizer.speech.volume import with_volumes

# A voice is asked again at another rate so often; its rate has steps, and pauses do not stretch evenly.
TRIES = 9
# What is left is made up for by playing it faster or slower by so little (a tenth of a semitone) that nobody
# hears it.
NEAR = 0.006


def speak_to_length(voice: Voice, request: SpeechRequest) -> Utterance:
    """Speak, `say.seconds` long where that is given: at the rate that comes nearest, then by resampling.

    What is recorded is not spoken (`speech.given`), and stays as long as it is.

    Raises:
        VoiceError: as `voice.say`.
    """
    if request.recording is not None:
        from realizer.speech.recorded.recorded_speech import utterance_of

        return with_volumes(request, utterance_of(request, request.recording))
    return with_volumes(request, _synthesize(voice, request))


def silent_fallback(request: SpeechRequest, fault: VoiceError | str) -> Utterance:
    """What the silent voice makes of what another one failed to say, with a warning that says why.

    Raises:
        VoiceError: the text is too long.
    """
    from realizer.speech.silent import SilentVoice

    made = speak_to_length(SilentVoice(), request)
    return replace(made, warnings=(*made.warnings, f"{fault}; this one has no sound"))


def _synthesize(voice: Voice, request: SpeechRequest) -> Utterance:
    utterance = voice.say(replace(request, seconds=None))
    if request.seconds is None or not utterance.duration:
        return utterance
    rate, best = request.rate, utterance
    slow: tuple[float, float] | None = None  # the fastest rate that is too slow, and how long it takes
    fast: tuple[float, float] | None = None
    for _ in range(TRIES):
        if abs(best.duration / request.seconds - 1.0) <= NEAR:
            break
        if utterance.duration > request.seconds:
            slow = (rate, utterance.duration)
        else:
            fast = (rate, utterance.duration)
        if slow and fast and slow[1] > fast[1]:
            # Between the two, by length as they lie, but never so near to one of them that nothing is won.
            part = min(0.8, max(0.2, (slow[1] - request.seconds) / (slow[1] - fast[1])))
            rate = slow[0] + part * (fast[0] - slow[0])
        else:
            rate *= utterance.duration / request.seconds
        before, utterance = utterance, voice.say(replace(request, rate=rate, seconds=None))
        if abs(utterance.duration - request.seconds) < abs(best.duration - request.seconds):
            best = utterance
        elif utterance.duration == before.duration and not (slow and fast):
            break  # as slow or as fast as it can
    return allow_small_warp(stretched(best, {"end": request.seconds}))


def stretched(utterance: Utterance, times: Mapping[str, float]) -> Utterance:
    """The same utterance with its end, and marks that are named, at these times; it stretches no more.

    Args:
        times: "end" or a mark -> seconds from its start.
    """
    was = {**utterance.marks, "end": utterance.duration}
    knots = sorted((was[name], time) for name, time in times.items() if name in was)
    source, target = (np.array([0.0, *side]) for side in zip(*knots, strict=True))
    source, target = np.maximum.accumulate(source), np.maximum.accumulate(target)

    def moved(time: float) -> float:
        return float(np.interp(time, source, target))

    end, pcm = float(target[-1]), utterance.pcm
    if pcm is not None:
        rate = utterance.sample_rate
        at = np.interp(np.arange(round(end * rate)) / rate, target, source) * rate
        pcm = np.rint(np.interp(at, np.arange(len(pcm)), pcm)).astype(np.int16)
    return replace(
        utterance,
        duration=end,
        words=tuple(replace(w, start=moved(w.start), end=moved(w.end)) for w in utterance.words),
        phonemes=tuple(replace(p, start=moved(p.start), end=moved(p.end)) for p in utterance.phonemes),
        marks={name: times[name] if name in times else moved(at) for name, at in utterance.marks.items()},
        pcm=pcm,
        stretch=(1.0, 1.0),
        sections=(),
    )


def allow_small_warp(utterance: Utterance) -> Utterance:
    """An utterance that the voice is not asked for again: it can be warped a little."""
    return replace(utterance, stretch=WARP if utterance.duration else (1.0, 1.0))
