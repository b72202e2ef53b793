"""Volumes of phonemes, as requested by the text."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import replace

from realizer.speech.ssml import read_script
from realizer.speech.utterance import SpeechRequest, Utterance
from realizer.speech.words import WordToken, tokens


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
