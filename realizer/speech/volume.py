"""Phoneme loudness from the volume that a text requests."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import replace

from realizer.speech.ssml import read_script
from realizer.speech.utterance import SpeechRequest, Utterance
from realizer.speech.words import WordToken, tokens


def with_volumes(request: SpeechRequest, utterance: Utterance) -> Utterance:
    """The utterance, each phoneme with the volume of the <prosody> elements around its word.

    By the text and not by the sound: how loud a voice or a recording is of itself says nothing of effort.
    Where the voice has other words than the text, they lie over each other evenly.
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
