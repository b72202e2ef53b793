"""Checkpoints: the state of a session while no block plays, as parts of a journal."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from realizer.playback.player import Player
from realizer.server.documents.document_queue import Submission
from realizer.server.journal.entry import JournalError
from realizer.server.journal.serialization import (
    character_from_json,
    character_to_json,
    schedule_from_json,
    schedule_to_json,
)
from realizer.server.session.character_faces import CharacterFaces
from realizer.server.session.feedback_log import FeedbackLog
from realizer.server.speech.audio_clips import AudioClips, Clip

VERSION = 1
STATE, CLIP = "state", "clip:"


@dataclass(eq=False)
class Checkpoint:
    """The state of a session that outlives its blocks: written to a journal, and read from it."""

    player: Player
    faces: CharacterFaces
    clips: AudioClips
    submission: Submission
    feedback_log: FeedbackLog

    def write(self, at: float, connections: Collection[int]) -> dict[str, str | None]:
        """Return the parts that a journal stores.

        Args:
            at: seconds on the session clock.
            connections: numbers of the connections.
        """
        player, tts, scene = self.player, self.submission.tts, self.player.context.scene
        past, expected = player.blocks.snapshot()
        data = {
            "version": VERSION,
            "at": at,
            "connections": list(connections),
            "seq": self.feedback_log.newest,
            "told": self.feedback_log.last(),
            "scene": None if scene is None else {name: list(place) for name, place in scene.items()},
            "characters": [character_to_json(character) for character in player.character_states],
            "faces": {str(index): face for index, face in self.faces.assigned.items()},
            "voices": {str(index): voice for index, voice in self.submission.voices.items()},
            "past": [schedule_to_json(schedule) for schedule in past],
            "expected": schedule_to_json(expected),
            "spoken": tts.request_count,
            "fault": tts.fault,
            "clips": self.clips.ids,
        }
        clips = {CLIP + id: text for id, text in self.clips.changes().items()}
        return {STATE: json.dumps(data, ensure_ascii=False), **clips}

    def read(self, session: str, parts: Mapping[str, str]) -> tuple[float, list[int]]:
        """Restore the state of a new session from a checkpoint.

        Args:
            session: its name, for errors.
            parts: as in `SavedSession`.

        Returns:
            The time of the checkpoint on the session clock, and the numbers of the connections.

        Raises:
            JournalError: the parts are not a checkpoint, or of another version.
        """
        player, tts = self.player, self.submission.tts
        try:
            data = json.loads(parts[STATE])
            if data["version"] != VERSION:
                words = f"wanted one of version {VERSION}, got {data['version']!r}"
                raise JournalError(f"the checkpoint of session {session}: {words}")
            at, scene = float(data["at"]), data["scene"]
            player.set_scene(
                None if scene is None else {name: (x, y, z) for name, (x, y, z) in scene.items()}
            )
            player.restore(
                [character_from_json(character) for character in data["characters"]],
                [schedule_from_json(schedule) for schedule in data["past"]],
                schedule_from_json(data["expected"]),
            )
            self.faces.assigned.update({int(index): face for index, face in data["faces"].items()})
            self.submission.voices.update({int(index): voice for index, voice in data["voices"].items()})
            tts.request_count, tts.fault = int(data["spoken"]), data["fault"]
            self.clips.restore({id: Clip.from_json(json.loads(parts[CLIP + id])) for id in data["clips"]})
            self.feedback_log.restore(int(data["seq"]), [str(text) for text in data["told"]], at)
            return at, [int(connection) for connection in data["connections"]]
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            fault = f"{type(error).__name__}: {error}"
            raise JournalError(f"the checkpoint of session {session} cannot be read: {fault}") from None
