"""Speech synthesis for blocks: before planning, and again if the plan needs other durations."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace

from bml_schema import Block
from realizer.core.errors import VoiceError
from realizer.playback.player import Player
from realizer.scheduling.timing import Schedule
from realizer.speech.duration_fit import silent_fallback, speak_to_length, stretched
from realizer.speech.registry import find_voice
from realizer.speech.utterance import SpeechRequest, Utterance, Voice


def submit_with_speech(player: Player, block: Block, voice: Voice, now: float = 0.0) -> Schedule:
    """Submit a block with its speech, at other rates if more of the block fits then."""
    requests = player.speech_requests(block)
    utterances = synthesize(requests, voice)
    planned = player.submit(block, now, utterances)
    if planned.lengths:
        again = {b: replace(requests[b], seconds=times["end"]) for b, times in planned.lengths.items()}
        utterances = {b: without_stretch(u) for b, u in utterances.items()} | synthesize(again, voice)
        planned = player.submit(block, now, utterances)
    if planned.lengths:
        planned = player.submit(block, now, stretch_to_fit(utterances, planned.lengths))
    return planned


def synthesize(requests: Mapping[str, SpeechRequest], voice: Voice) -> dict[str, Utterance]:
    """Synthesize the speech of a block; if the voice fails, use the silent voice and add a warning."""
    utterances: dict[str, Utterance] = {}
    for behaviour, request in requests.items():
        try:
            utterances[behaviour] = speak_to_length(voice, request)
        except VoiceError as error:
            utterances[behaviour] = silent_fallback(request, error)
        except Exception as error:  # of a plug-in
            words = f"the voice failed: {type(error).__name__}: {error}"
            utterances[behaviour] = silent_fallback(request, words)
    return utterances


def without_stretch(utterance: Utterance) -> Utterance:
    return replace(utterance, stretch=(1.0, 1.0))


def stretch_to_fit(
    utterances: Mapping[str, Utterance], lengths: Mapping[str, Mapping[str, float]]
) -> dict[str, Utterance]:
    """Stretch utterances to their planned durations, finally."""
    return {
        b: stretched(u, lengths[b]) if b in lengths else without_stretch(u) for b, u in utterances.items()
    }


@contextmanager
def open_voice(voice: Voice | str | None) -> Iterator[Voice]:
    """Open a voice by its name and close it afterwards; an open voice stays open."""
    if voice is not None and not isinstance(voice, str):
        yield voice
        return
    opened = _NamedVoice(voice)
    try:
        yield opened
    finally:
        opened.close()


class _NamedVoice:
    """A voice by name; the default voice is opened on first use."""

    def __init__(self, name: str | None) -> None:
        self.name = name or "default"
        self._voice = None if name is None else find_voice(name)

    def say(self, request: SpeechRequest) -> Utterance:
        if self._voice is None:
            self._voice = find_voice()
        return self._voice.say(request)

    def close(self) -> None:
        if self._voice is not None:
            self._voice.close()
