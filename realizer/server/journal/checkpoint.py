"""Checkpoints: the state of a session while no block plays, as parts of a journal."""

import json
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from realizer.animation.axis import axis
from realizer.animation.channel import Channel, Crossfade, Gain, Layer
from realizer.animation.idle.blinks import OnsetMask
from realizer.playback.character import BaseShift, Character
from realizer.playback.player import Player
from realizer.scheduling.timing import Schedule
from realizer.server.documents.document_queue import Submission
from realizer.server.journal.entry import JournalError
from realizer.server.session.character_faces import CharacterFaces
from realizer.server.session.connections import FeedbackLog
from realizer.server.speech.audio_clips import AudioClips
from realizer.server.speech.clip import Clip

VERSION = 1
STATE, CLIP = "state", "clip:"
CHANNELS = {"channel": Channel, "fewer": OnsetMask}


@dataclass(eq=False)
class Checkpoint:
    """The state of a session that outlives its blocks: written to a journal, and read from it."""

    player: Player
    faces: CharacterFaces
    clips: AudioClips
    submission: Submission
    feedback_log: FeedbackLog

    def is_possible(self, ended_by: float) -> bool:
        """Return whether nothing plays or is prepared; see `Player.is_idle`."""
        return self.submission.is_idle and self.player.manager.is_idle(ended_by)

    def write(self, at: float, connections: Collection[int]) -> dict[str, str | None]:
        """Return the parts that a journal stores."""
        player, tts, scene = self.player, self.submission.tts, self.player.context.scene
        past, expected = player.blocks.snapshot()
        data = {
            "version": VERSION,
            "at": at,
            "connections": list(connections),
            "seq": self.feedback_log.newest,
            "told": self.feedback_log.last(),
            "scene": None if scene is None else {name: list(place) for name, place in scene.items()},
            "characters": [character_to_json(character) for character in player.cast],
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


def character_to_json(character: Character) -> dict[str, Any]:
    """Return a character with the channels that outlive blocks."""
    return {
        "id": character.id,
        "shifts": [
            {
                "begin": shift.begin,
                "end": shift.end,
                "regions": sorted(shift.regions),
                "channels": [_channel_to_json(channel) for channel in shift.channels],
            }
            for shift in character.shifts
        ],
        "direct": {name: _channel_to_json(channel) for name, channel in character.direct.items()},
        "feeling": {name: _channel_to_json(channel) for name, channel in character.emotion.items()},
        "responses": [_channel_to_json(channel) for channel in character.responses],
        "heard": character.heard and {**vars(character.heard), "rest": character.heard.rest.tolist()},
    }


def character_from_json(data: Mapping[str, Any]) -> Character:
    """Return the character that `character_to_json` wrote.

    Raises:
        KeyError, TypeError, ValueError: the data is not a character.
    """
    shifts = [
        BaseShift(
            float(shift["begin"]),
            float(shift["end"]),
            frozenset(shift["regions"]),
            tuple(map(_channel_from_json, shift["channels"])),
        )
        for shift in data["shifts"]
    ]
    direct, emotion = (
        {name: _channel_from_json(channel) for name, channel in data[key].items()}
        for key in ("direct", "feeling")
    )
    # Journals of 0.1 have no responses and hear no sound.
    responses = [_channel_from_json(channel) for channel in data.get("responses", ())]
    if (heard := data.get("heard")) is not None:
        from realizer.speech.voice_activity import VoiceActivity

        heard = VoiceActivity(**{**heard, "rest": np.array(heard["rest"], np.int16)})
    return Character(data["id"], shifts, direct, emotion, responses, heard)


def schedule_to_json(schedule: Schedule) -> dict[str, Any]:
    """Return the sync points of a block and their times, to which later blocks may refer."""
    return {
        "block": schedule.block,
        "start": schedule.start,
        "points": {behaviour: list(points) for behaviour, points in schedule.points.items()},
        "times": {behaviour: times.tolist() for behaviour, times in schedule.times.items()},
    }


def schedule_from_json(data: Mapping[str, Any]) -> Schedule:
    """Return the schedule that `schedule_to_json` wrote.

    Raises:
        KeyError, TypeError, ValueError: the data is not a schedule.
    """
    points = {behaviour: tuple(names) for behaviour, names in data["points"].items()}
    times = {behaviour: np.array(at, np.float64) for behaviour, at in data["times"].items()}
    return Schedule(data["block"], points, times, start=float(data["start"]))


def _channel_to_json(channel: Channel) -> dict[str, Any]:
    data: dict[str, Any] = {
        "kind": next(name for name, kind in CHANNELS.items() if kind is type(channel)),
        "target": channel.target.name,
        "times": channel.times.tolist(),
        "values": channel.values.tolist(),
        "curve": channel.curve,
        "layer": channel.layer.name,
        "holds": channel.keeps_last,
        "source": channel.source,
    }
    if channel.gains:
        data["gains"] = [list(gain) for gain in channel.gains]
    if channel.until < float("inf"):
        data["until"] = channel.until
    if channel.crossfade is not None:
        data["joint"] = list(channel.crossfade)
    if channel.weight is not None:
        data["there"] = channel.weight.tolist()
    return data


def _channel_from_json(data: Mapping[str, Any]) -> Channel:
    return CHANNELS[data["kind"]](
        axis()[data["target"]],
        np.array(data["times"], np.float64),
        np.array(data["values"], np.float64),
        curve=data["curve"],
        layer=Layer[data["layer"]],
        keeps_last=data["holds"],
        gains=tuple(Gain(*gain) for gain in data.get("gains", ())),
        until=data.get("until", float("inf")),
        crossfade=Crossfade(*data["joint"]) if "joint" in data else None,
        weight=np.array(data["there"], np.float64) if "there" in data else None,
        source=data["source"],
    )
