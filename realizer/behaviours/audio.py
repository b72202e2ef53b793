"""audiofile: plays a sound file of the media folder, or a clip of a client."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bml_schema import AudioFile
from realizer.behaviours import recordings
from realizer.behaviours.kind import BehaviourKind, Fault, PlanningContext
from realizer.scheduling.timing import Timing
from realizer.speech.utterance import Utterance


def timing(node: AudioFile, context: PlanningContext) -> Timing:
    """Return the duration of the file; with an end in the document, sound is cut off or silence added."""
    length = np.array([sound(node, context).duration])
    rigid = Timing(("start", "end"), length, length, np.ones(1), rigid=True)
    return replace(rigid, least=np.zeros(1), rigid=False) if "end" in node.syncs else rigid


def check(node: AudioFile, context: PlanningContext) -> tuple[Fault, ...]:
    return recordings.faults(node.file_name, context)


def sound(node: AudioFile, context: PlanningContext) -> Utterance:
    recording = recordings.recording(node.file_name, context)
    return Utterance(len(recording.pcm) / recording.rate, (), (), {}, recording.rate, recording.pcm)


KINDS = (BehaviourKind(AudioFile, timing, check=check, sound=sound, parameters={"volume": 100.0}),)
