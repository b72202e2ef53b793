"""Serialization of characters and schedules to JSON data, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from realizer.animation.axis import axis
from realizer.animation.channel import Channel, Crossfade, Gain, Layer
from realizer.animation.idle.blinks import BlinkReduction
from realizer.playback.character import BaseShift, Character
from realizer.scheduling.timing import Schedule

CHANNELS = {"channel": Channel, "fewer": BlinkReduction}


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
    return Character(data["id"], shifts, direct, emotion)


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
    """Return the attributes of a channel except the default values."""
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
