"""Recordings that documents name: clips of clients, and files of the media folder."""

from __future__ import annotations

import difflib

from realizer.behaviours import media
from realizer.behaviours.kind import Fault, PlanningContext
from realizer.behaviours.media import MediaError
from realizer.behaviours.sound_file import read_sound
from realizer.speech.utterance import Recording

CLIP = "clip:"  # before the id of a clip


def recording(name: str, context: PlanningContext) -> Recording:
    """Return the recording with a name.

    Raises:
        MediaError: there is none, or it cannot be read.
    """
    id = _clip(name)
    return media.load(name, context, read_sound) if id is None else _client_clip(id, context)


def faults(name: str, context: PlanningContext) -> tuple[Fault, ...]:
    """Return why a recording cannot be played."""
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
        near = difflib.get_close_matches(id, list(context.clips))
        suggestion = f', did you mean "{CLIP}{near[0]}"?' if near else ""
        raise MediaError(f"wanted a clip that was sent to its last piece, got {CLIP + id!r}{suggestion}")
    return context.clips[id]
