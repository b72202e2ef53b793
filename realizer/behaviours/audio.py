"""audiofile: plays a recording, which is a sound file of the media folder or a clip of a client."""

from dataclasses import replace

import numpy as np

from bml_schema import AudioFile
from realizer.behaviours import media
from realizer.behaviours.kind import BehaviourKind, Fault, PlanningContext
from realizer.behaviours.media import MediaError
from realizer.behaviours.sound_file import read_sound
from realizer.core.similar import did_you_mean, similar
from realizer.scheduling.timing import Timing
from realizer.speech.utterance import Recording, Utterance

CLIP = "clip:"  # before the id of a clip


def recording(name: str, context: PlanningContext) -> Recording:
    """Return the recording with a name; raise MediaError if there is none, or it cannot be read."""
    id = _clip(name)
    return media.load(name, context, read_sound) if id is None else _client_clip(id, context)


def faults(name: str, context: PlanningContext) -> tuple[Fault, ...]:
    id = _clip(name)
    if id is None:
        return media.faults(name, context, read_sound)
    try:
        _client_clip(id, context)
    except MediaError as error:
        return (Fault("CANNOT_CREATE_BEHAVIOR", f"fileName: {error}"),)
    return ()


def _clip(name: str) -> str | None:
    return name.strip()[len(CLIP) :] if name.strip().startswith(CLIP) else None


def _client_clip(id: str, context: PlanningContext) -> Recording:
    if id not in context.clips:
        suggestion = did_you_mean(f'"{CLIP}{clip}"' for clip in similar(id, context.clips, 1))
        raise MediaError(f"wanted a clip that was sent to its last piece, got {CLIP + id!r}{suggestion}")
    return context.clips[id]


def timing(node: AudioFile, context: PlanningContext) -> Timing:
    """Return the duration of the file; with an end in the document, sound is cut off or silence added."""
    length = np.array([sound(node, context).duration])
    rigid = Timing(("start", "end"), length, length, np.ones(1), rigid=True)
    return replace(rigid, least=np.zeros(1), rigid=False) if "end" in node.syncs else rigid


def check(node: AudioFile, context: PlanningContext) -> tuple[Fault, ...]:
    if found := faults(node.file_name, context):
        return found
    return tuple(
        Fault("CUSTOM_ATTRIBUTE_NOT_SUPPORTED", f"fileName: {text}", fatal=False)
        for text in recording(node.file_name, context).warnings
    )


def sound(node: AudioFile, context: PlanningContext) -> Utterance:
    found = recording(node.file_name, context)
    return Utterance(len(found.pcm) / found.rate, (), (), {}, found.rate, found.pcm)


KINDS = (BehaviourKind(AudioFile, timing, check=check, sound=sound, parameters={"volume": 100.0}),)
