"""Checkpoints: the state of a session while no block plays, as parts of a journal."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from realizer.behaviours.kind import Position
from realizer.playback.character import Character
from realizer.scheduling.timing import Schedule
from realizer.server.journal.entry import JournalError
from realizer.server.journal.serialization import (
    character_from_json,
    character_to_json,
    schedule_from_json,
    schedule_to_json,
)
from realizer.server.speech.audio_clips import Clip

VERSION = 1
STATE, CLIP = "state", "clip:"


@dataclass(frozen=True)
class SessionState:
    """The state of a session that outlives its blocks.

    Attributes:
        at: seconds on the session clock.
        connections: numbers of the connections.
        seq: sequence number of the last feedback.
        last_messages: the last feedback messages, the oldest first.
        faces, voices: index of a character -> name of the face or voice that a client chose.
        past, expected: schedules of ended blocks, and of anticipated sync points.
        request_count: number of speech requests so far.
        fault: last error of a voice.
        clips: ids of the sound clips, the oldest first.
    """

    at: float
    connections: Sequence[int]
    seq: int
    last_messages: Sequence[str]
    scene: Mapping[str, Position] | None
    characters: Sequence[Character]
    faces: Mapping[int, str]
    voices: Mapping[int, str]
    past: Sequence[Schedule]
    expected: Schedule
    request_count: int
    fault: str | None
    clips: Sequence[str]


def write(state: SessionState, clips: Mapping[str, str | None]) -> dict[str, str | None]:
    """Return the parts that a journal stores.

    Args:
        clips: id -> JSON of each clip that has changed since the last checkpoint, None for a deleted clip.
    """
    data = {
        "version": VERSION,
        "at": state.at,
        "connections": list(state.connections),
        "seq": state.seq,
        "told": list(state.last_messages),
        "scene": None if state.scene is None else {name: list(place) for name, place in state.scene.items()},
        "characters": [character_to_json(character) for character in state.characters],
        "faces": {str(index): face for index, face in state.faces.items()},
        "voices": {str(index): voice for index, voice in state.voices.items()},
        "past": [schedule_to_json(schedule) for schedule in state.past],
        "expected": schedule_to_json(state.expected),
        "spoken": state.request_count,
        "fault": state.fault,
        "clips": list(state.clips),
    }
    return {STATE: json.dumps(data, ensure_ascii=False), **{CLIP + id: text for id, text in clips.items()}}


def read(session: str, parts: Mapping[str, str]) -> tuple[SessionState, dict[str, Clip]]:
    """Return the state in the checkpoint of a session, and its clips by id.

    Args:
        parts: as in `SavedSession`.

    Raises:
        JournalError: the parts are not a checkpoint, or of another version.
    """
    try:
        data = json.loads(parts[STATE])
        if data["version"] != VERSION:
            words = f"wanted one of version {VERSION}, got {data['version']!r}"
            raise JournalError(f"the checkpoint of session {session}: {words}")
        scene = data["scene"]
        state = SessionState(
            at=float(data["at"]),
            connections=[int(connection) for connection in data["connections"]],
            seq=int(data["seq"]),
            last_messages=[str(text) for text in data["told"]],
            scene=None if scene is None else {name: (x, y, z) for name, (x, y, z) in scene.items()},
            characters=[character_from_json(character) for character in data["characters"]],
            faces={int(index): face for index, face in data["faces"].items()},
            voices={int(index): voice for index, voice in data["voices"].items()},
            past=[schedule_from_json(schedule) for schedule in data["past"]],
            expected=schedule_from_json(data["expected"]),
            request_count=int(data["spoken"]),
            fault=data["fault"],
            clips=data["clips"],
        )
        return state, {id: Clip.from_json(json.loads(parts[CLIP + id])) for id in state.clips}
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        fault = f"{type(error).__name__}: {error}"
        raise JournalError(f"the checkpoint of session {session} cannot be read: {fault}") from None
