"""A writer for timeline files (TOML); `timeline_reader` reads the same timeline again."""

import json
from typing import Any

from realizer.expressions.timeline import Entry, Timeline, Track


def write_timeline(timeline: Timeline) -> str:
    """Return a timeline as TOML, without the fields that have their defaults."""
    table = timeline_json(timeline)
    lines = [f"{name} = {_value(value)}" for name, value in table.items() if name != "channel"]
    for row in table["channel"]:
        lines += ["", "[[channel]]"]
        lines += [f"{name} = {_value(value)}" for name, value in row.items() if name != "entries"]
        lines += ["entries = [", *(f"    {_value(entry)}," for entry in row["entries"]), "]"]
    return "\n".join(lines).lstrip("\n") + "\n"


def timeline_json(timeline: Timeline) -> dict[str, Any]:
    """Return a timeline as `read_timeline` reads it, without the fields that have their defaults."""
    return {
        **_fields(timeline, Timeline(()), "mixer", "order"),
        "channel": [
            {
                "name": track.name,
                **_fields(track, Track("", ()), "joins", "curve", "start"),
                "entries": [
                    {
                        "expression": entry.expression,
                        **_fields(entry, Entry(""), "intensity", "duration", "onset", "offset", "because"),
                    }
                    for entry in track.entries
                ],
            }
            for track in timeline.tracks
        ],
    }


def _fields(row: object, usual: object, *names: str) -> dict[str, Any]:
    """Return the fields of a row that are not as usual."""
    values = {name: getattr(row, name) for name in names if getattr(row, name) != getattr(usual, name)}
    return {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}


def _value(value: Any) -> str:
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{name} = {_value(one)}' for name, one in value.items())} }}"
    if isinstance(value, str):
        # A string of JSON is one of TOML, but for this character.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return json.dumps(value)
