"""audiofile: plays a sound file of the media folder, or a clip that a client sent."""

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
    """As long as the file, exactly; one whose end the document gives is cut off there, or silent from its own
    end on.
    """
    length = np.array([_sound(node, context).duration])
    whole = Timing(("start", "end"), length, length, np.ones(1), rigid=True)
    return replace(whole, least=np.zeros(1), rigid=False) if "end" in node.syncs else whole


def expand(node: AudioFile, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """It moves nothing: nobody knows what is said in it."""
    return ()


def check(node: AudioFile, context: PlanningContext) -> tuple[Fault, ...]:
    return recordings.faults(node.file_name, context)


def sound(node: AudioFile, context: PlanningContext) -> Utterance | None:
    return _sound(node, context)


def _sound(node: AudioFile, context: PlanningContext) -> Utterance:
    recording = recordings.recording(node.file_name, context)
    return Utterance(len(recording.pcm) / recording.rate, (), (), {}, recording.rate, recording.pcm)


KINDS = (BehaviourKind(AudioFile, timing, expand, check, sound=sound, parameters={"volume": 100.0}),)
