"""Synthesis to a given duration, by speaking rate and a small time stretch."""

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from realizer.core.errors import VoiceError
from realizer.speech.ssml import read_script
from realizer.speech.utterance import WARP, SpeechRequest, Utterance, Voice
from realizer.speech.words import WordToken, tokens

# Attempts at other rates; more than one is needed because rates have steps and pauses do not scale evenly.
TRIES = 9
# The remaining difference is removed by resampling, which changes the pitch inaudibly: by a tenth of a
# semitone.
NEAR = 0.006


def speak_to_length(voice: Voice, request: SpeechRequest) -> Utterance:
    """Synthesize speech that lasts `request.seconds`, if set, by choosing a rate and then resampling.

    A recording (`request.recording`) keeps its length. It raises VoiceError as `voice.say`.
    """
    if request.recording is not None:
        from realizer.speech.recorded.recorded_speech import utterance_of

        return with_volumes(request, utterance_of(request, request.recording))
    if (given := request.given) is not None:
        from realizer.speech.recorded.given_times import at_given_times

        said = Utterance(0.0, (), (), {})
        if request.ssml.strip():
            said = _synthesize(voice, replace(request, seconds=given.duration, given=None))
            marks = {name: time for name, time in given.marks.items() if name in said.marks}
            said = stretched(said, {**marks, "end": given.duration})
        return with_volumes(request, at_given_times(said, given))
    return with_volumes(request, _synthesize(voice, request))


def silent_fallback(request: SpeechRequest, fault: VoiceError | str) -> Utterance:
    """Return the silent voice's utterance of a request that another voice failed, with a warning."""
    from realizer.speech.silent import SilentVoice

    made = speak_to_length(SilentVoice(), request)
    return replace(made, warnings=(*made.warnings, f"{fault}; the silent voice is used instead"))


def _synthesize(voice: Voice, request: SpeechRequest) -> Utterance:
    utterance = voice.say(replace(request, seconds=None))
    if request.seconds is None or not utterance.duration:
        return utterance
    rate, best = request.rate, utterance
    slow: tuple[float, float] | None = None  # the fastest rate that is too slow, and its duration
    fast: tuple[float, float] | None = None
    for _ in range(TRIES):
        if abs(best.duration / request.seconds - 1.0) <= NEAR:
            break
        if utterance.duration > request.seconds:
            slow = (rate, utterance.duration)
        else:
            fast = (rate, utterance.duration)
        if slow and fast and slow[1] > fast[1]:
            # Interpolate between the two by duration, at a distance from both ends to make progress.
            part = min(0.8, max(0.2, (slow[1] - request.seconds) / (slow[1] - fast[1])))
            rate = slow[0] + part * (fast[0] - slow[0])
        else:
            rate *= utterance.duration / request.seconds
        before, utterance = utterance, voice.say(replace(request, rate=rate, seconds=None))
        if abs(utterance.duration - request.seconds) < abs(best.duration - request.seconds):
            best = utterance
        elif utterance.duration == before.duration and not (slow and fast):
            break  # the engine's slowest or fastest rate
    return allow_small_warp(stretched(best, {"end": request.seconds}))


def stretched(utterance: Utterance, times: Mapping[str, float]) -> Utterance:
    """Return the utterance with its end and marks at given seconds; it cannot stretch again."""
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


def shortened(utterance: Utterance, end: float) -> Utterance:
    """Return an utterance that ends at `end` seconds, which cuts its closing pause."""
    if utterance.pcm is not None:
        end = int(end * utterance.sample_rate + 1e-6) / utterance.sample_rate
    return replace(
        utterance,
        duration=end,
        words=tuple(replace(w, end=min(w.end, end)) for w in utterance.words),
        phonemes=tuple(replace(p, end=min(p.end, end)) for p in utterance.phonemes if p.start < end),
        marks={name: min(time, end) for name, time in utterance.marks.items()},
        pcm=None if utterance.pcm is None else utterance.pcm[: round(end * utterance.sample_rate)],
    )


def allow_small_warp(utterance: Utterance) -> Utterance:
    """Return an utterance that may only be resampled a little, not synthesized again."""
    return replace(utterance, stretch=WARP if utterance.duration else (1.0, 1.0))


def with_volumes(request: SpeechRequest, utterance: Utterance) -> Utterance:
    """Return the utterance with the volumes of <prosody> elements applied to the phonemes inside them.

    Volumes come from the text, because the loudness of the sound does not indicate effort. If the voice
    reports other words than the text has, their indices are scaled.
    """
    if "volume" not in request.ssml or not utterance.words:
        return utterance
    volumes = [item.volume for item in tokens(read_script(request), "") if isinstance(item, WordToken)]
    if all(volume == 1.0 for volume in volumes):
        return utterance
    starts = [word.start for word in utterance.words]

    def volume(middle: float) -> float:
        word = max(0, bisect_right(starts, middle) - 1)
        return volumes[word * len(volumes) // len(starts)]

    return replace(
        utterance,
        phonemes=tuple(
            replace(p, volume=volume((p.start + p.end) / 2)) if p.ipa else p for p in utterance.phonemes
        ),
    )
