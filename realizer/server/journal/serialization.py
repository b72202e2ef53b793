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

# Python writes a float so that it is read again to the last bit.
CHANNELS = {"channel": Channel, "fewer": BlinkReduction}


def character_to_json(character: Character) -> dict[str, Any]:
    """A face with all that it holds beyond any block."""
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


def character_from_json(told: Mapping[str, Any]) -> Character:
    """What `character_to_json` told of.

    Raises:
        KeyError, TypeError, ValueError: it is none.
    """
    shifts = [
        BaseShift(
            float(shift["begin"]),
            float(shift["end"]),
            frozenset(shift["regions"]),
            tuple(map(_channel_from_json, shift["channels"])),
        )
        for shift in told["shifts"]
    ]
    direct, feeling = (
        {name: _channel_from_json(one) for name, one in told[of].items()} for of in ("direct", "feeling")
    )
    return Character(told["id"], shifts, direct, feeling)


def schedule_to_json(schedule: Schedule) -> dict[str, Any]:
    """When the sync points of a block were: what references to it may still ask."""
    return {
        "block": schedule.block,
        "start": schedule.start,
        "points": {behaviour: list(points) for behaviour, points in schedule.points.items()},
        "times": {behaviour: times.tolist() for behaviour, times in schedule.times.items()},
    }


def schedule_from_json(told: Mapping[str, Any]) -> Schedule:
    """What `schedule_to_json` told of.

    Raises:
        KeyError, TypeError, ValueError: it is none.
    """
    points = {behaviour: tuple(names) for behaviour, names in told["points"].items()}
    times = {behaviour: np.array(at, np.float64) for behaviour, at in told["times"].items()}
    return Schedule(told["block"], points, times, start=float(told["start"]))


def _channel_to_json(channel: Channel) -> dict[str, Any]:
    """Its attributes, but those that are as they are where nobody says anything."""
    kind = next(name for name, one in CHANNELS.items() if one is type(channel))
    told: dict[str, Any] = {
        "kind": kind,
        "target": channel.target.name,
        "times": channel.times.tolist(),
        "values": channel.values.tolist(),
        "curve": channel.curve,
        "layer": channel.layer.name,
        "holds": channel.keeps_last,
        "source": channel.source,
    }
    if channel.gains:
        told["gains"] = [list(gain) for gain in channel.gains]
    if channel.until < float("inf"):
        told["until"] = channel.until
    if channel.crossfade is not None:
        told["joint"] = list(channel.crossfade)
    if channel.weight is not None:
        told["there"] = channel.weight.tolist()
    return told


def _channel_from_json(told: Mapping[str, Any]) -> Channel:
    there = told.get("there")
    return CHANNELS[told["kind"]](
        axis()[told["target"]],
        np.array(told["times"], np.float64),
        np.array(told["values"], np.float64),
        curve=told["curve"],
        layer=Layer[told["layer"]],
        keeps_last=told["holds"],
        gains=tuple(Gain(*gain) for gain in told.get("gains", ())),
        until=told.get("until", float("inf")),
        crossfade=None if told.get("joint") is None else Crossfade(*told["joint"]),
        weight=None if there is None else np.array(there, np.float64),
        source=told["source"],
    )
