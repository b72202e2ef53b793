"""audiofile: plays a sound file of the media folder, or a clip of a client."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bml_schema import AudioFile
from realizer.animation.channel import Channel
from realizer.behaviours import recordings
from realizer.behaviours.kind import BehaviourKind, Fault, PlanningContext
from realizer.core.array_types import Float64
from realizer.scheduling.timing import Timing
from realizer.speech.utterance import Utterance


def timing(node: AudioFile, context: PlanningContext) -> Timing:
    """Return the duration of the file; with an end in the document, sound is cut off or silence added."""
    length = np.array([_sound(node, context).duration])
    whole = Timing(("start", "end"), length, length, np.ones(1), rigid=True)
    return replace(whole, least=np.zeros(1), rigid=False) if "end" in node.syncs else whole


def expand(node: AudioFile, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return no channels: the phonemes of the sound are unknown."""
    return ()


def check(node: AudioFile, context: PlanningContext) -> tuple[Fault, ...]:
    return recordings.faults(node.file_name, context)


def sound(node: AudioFile, context: PlanningContext) -> Utterance | None:
    return _sound(node, context)


def _sound(node: AudioFile, context: PlanningContext) -> Utterance:
    recording = recordings.recording(node.file_name, context)
    return Utterance(len(recording.pcm) / recording.rate, (), (), {}, recording.rate, recording.pcm)


KINDS = (BehaviourKind(AudioFile, timing, expand, check, sound=sound, parameters={"volume": 100.0}),)
