"""Timeline files: a reader (TOML or JSON) that reports all faults at once, and a writer (TOML)."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, cast, get_args

import numpy as np

from realizer.core.errors import TableError
from realizer.core.json_reader import parse_json
from realizer.core.similar import did_you_mean, similar
from realizer.core.toml_text import parse_toml
from realizer.expressions.timeline import Curve, Entry, Joins, Mixer, Timeline, Track
from realizer.tables import action_units

MIN_SECONDS, MAX_SECONDS = 0.04, 3600.0
TIMELINE = ("mixer", "order", "channel")
TRACK = ("name", "start", "joins", "curve", "entries")
ENTRY = ("expression", "intensity", "duration", "onset", "offset", "because", "faps", "keys")
MAX_FAPU = 1e6


def read_timeline(content: bytes) -> Timeline:
    """Parse a timeline: JSON if it begins with an object or a list, else TOML.

        mixer = "successive"    # or "additive", the default
        order = [4, 1, 2]       # with "successive": action units that come first

        [[channel]]
        name = "brows"
        joins = "both"          # or "onset", "offset"
        curve = "linear"        # or "smooth"
        start = 0.0
        entries = [
            { expression = "template:surprise", intensity = 0.8, duration = 1.2 },
            { expression = "neutral", duration = 0.5 },
            { expression = "template:anger", onset = 0.2, offset = 0.6, because = "an exclamation" },
            { expression = "keyframes", faps = [31, 32], keys = [[0, 0, 0], [0.5, 90, 80], [1, 0, 0]] },
        ]

    Raises:
        TableError: the text has a line for each fault, with channel and entry.
    """
    try:
        text = content.decode("utf-8-sig")
        table = parse_json(text) if _is_json(text) else parse_toml(text)
    except ValueError as error:
        raise TableError(f"wanted a timeline in TOML or JSON, got: {error}") from None
    if not isinstance(table, dict):
        raise TableError(f'timeline: wanted {{"channel": [...]}}, got a {type(table).__name__}')
    reader = _TimelineReader()
    timeline = reader.timeline(table)
    if reader.faults:
        raise TableError("\n".join(reader.faults))
    return timeline


def _is_json(text: str) -> bool:
    """Return whether a text is JSON; a table of TOML may begin with a bracket, but not with these two."""
    return re.match(r"\s*(\{|\[\s*[{\]])", text) is not None


class _TimelineReader:
    """Reads a timeline and collects its faults."""

    def __init__(self) -> None:
        self.faults: list[str] = []

    def _fault(self, place: str, wanted: str, got: object) -> None:
        try:
            text = "nothing" if got is None else repr(got)
        except ValueError:
            text = "a number of thousands of digits"
        self.faults.append(f"{place}: wanted {wanted}, got {text if len(text) <= 80 else text[:80] + '...'}")

    def _keys(self, row: Mapping[str, Any], known: Sequence[str], place: str) -> None:
        for name in row:
            if name not in known:
                hint = did_you_mean(similar(name, known, 1))
                if place != "timeline" and name in TIMELINE:
                    hint = "; it belongs before all channels"
                self.faults.append(f"{place}: wanted {', '.join(known)}, got {name!r}{hint}")

    def timeline(self, table: Mapping[str, Any]) -> Timeline:
        self._keys(table, TIMELINE, "timeline")
        mixer = cast(Mixer, self._choice(table, "mixer", get_args(Mixer), "timeline"))
        order = self._order(table.get("order", []))
        rows = table.get("channel")
        if not isinstance(rows, list) or not rows:
            self._fault("timeline", "channels, [[channel]] each", rows)
            rows = []
        tracks = tuple(self._track(row, number) for number, row in enumerate(rows, 1))
        return Timeline(tracks, mixer, order)

    def _order(self, aus: Any) -> tuple[int, ...]:
        if not isinstance(aus, list):
            self._fault("timeline, order", "a list of action units, such as [4, 1, 2]", aus)
            return ()
        # Rotations always follow all other units (Wojdel 2005, 5.1).
        sortable = {row.au for row in action_units() if not row.degrees}
        order: list[int] = []
        for number, au in enumerate(aus, 1):
            place = f"timeline, order, place {number}"
            if type(au) is not int or au not in sortable:
                self._fault(place, "the number of an action unit that turns neither head nor eyes", au)
            elif au in order:
                self._fault(place, "each action unit once", au)
            else:
                order.append(au)
        return tuple(order)

    def _track(self, row: Any, number: int) -> Track:
        place = f"channel {number}"
        if not isinstance(row, dict):
            self._fault(place, "a table with entries", row)
            return Track(place, ())
        self._keys(row, TRACK, place)
        name = row.get("name", str(number))
        if not isinstance(name, str) or not name.strip():
            self._fault(f"{place}, name", "a name", name)
        place = f"channel {name}"
        entries = row.get("entries")
        if not isinstance(entries, list) or not entries:
            self._fault(f"{place}, entries", "a list of { expression, intensity, duration }", entries)
            entries = []
        return Track(
            str(name),
            tuple(self._entry(entry, f"{place}, entry {k}") for k, entry in enumerate(entries, 1)),
            cast(Joins, self._choice(row, "joins", get_args(Joins), place)),
            cast(Curve, self._choice(row, "curve", get_args(Curve), place)),
            self._number(row, "start", 0.0, 0.0, MAX_SECONDS, place),
        )

    def _entry(self, row: Any, place: str) -> Entry:
        if not isinstance(row, dict):
            self._fault(place, "{ expression, intensity, duration }", row)
            return Entry("")
        self._keys(row, ENTRY, place)
        expression = row.get("expression")
        if not isinstance(expression, str) or not expression.strip():
            self._fault(f"{place}, expression", "the name of an expression, or neutral", expression)
            expression = ""
        duration, onset, offset = (
            self._number(row, name, MIN_SECONDS, MIN_SECONDS, MAX_SECONDS, place) if name in row else None
            for name in ("duration", "onset", "offset")
        )
        because = row.get("because")
        if because is not None and not isinstance(because, str):
            self._fault(f"{place}, because", "a text", because)
            because = None
        intensity = self._number(row, "intensity", 1.0, 0.0, 1.0, place)
        entry = Entry(expression, intensity, duration, onset, offset, because)
        if entry.is_keyframes:
            return replace(entry, faps=self._faps(row.get("faps"), place), keys=self._keyframes(row, place))
        for name in {"faps", "keys"} & {*row}:
            self._fault(f"{place}, {name}", 'expression = "keyframes" beside it', expression)
        return entry

    def _faps(self, faps: Any, place: str) -> tuple[int, ...]:
        known = isinstance(faps, list) and all(type(fap) is int and 3 <= fap <= 68 for fap in faps)
        if known and 0 < len(faps) == len({*faps}):
            return tuple(faps)
        self._fault(f"{place}, faps", "FAPs 3..68, each once", faps)
        return ()

    def _keyframes(self, row: Mapping[str, Any], place: str) -> tuple[tuple[float, ...], ...]:
        """Return rows of times that rise from 0 and of as many values as there are FAPs."""
        keys, faps = row.get("keys"), row.get("faps")
        width = 1 + (len(faps) if isinstance(faps, list) else 0)
        try:
            table = np.array(keys, np.float64)
        except (ValueError, TypeError, OverflowError):
            table = np.zeros(0)
        if (
            table.ndim == 2
            and table.shape[0] >= 2
            and table.shape[1] == width
            and np.all(np.abs(table) <= MAX_FAPU)
            and table[0, 0] == 0
            and np.all(np.diff(table[:, 0]) > 0)
        ):
            return tuple(map(tuple, table.tolist()))
        wanted = f"rows of a time, rising from 0, and {width - 1} numbers, at least two"
        self._fault(f"{place}, keys", wanted, keys)
        return ()

    def _choice(self, row: Mapping[str, Any], name: str, known: Sequence[str], place: str) -> str:
        value = row.get(name, known[0])
        if value not in known:
            self._fault(f"{place}, {name}", " or ".join(known), value)
            return known[0]
        return str(value)

    def _number(
        self, row: Mapping[str, Any], name: str, default: float, low: float, high: float, place: str
    ) -> float:
        value = row.get(name, default)
        if isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high:
            return float(value)
        self._fault(f"{place}, {name}", f"a number {low:g}..{high:g}", value)
        return default


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
                        **_fields(entry, Entry(""), *ENTRY[1:]),
                    }
                    for entry in track.entries
                ],
            }
            for track in timeline.tracks
        ],
    }


def _fields(row: object, usual: object, *names: str) -> dict[str, Any]:
    """Return the fields of a row that differ from those of `usual`."""
    values = {name: getattr(row, name) for name in names if getattr(row, name) != getattr(usual, name)}
    return {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}


def _value(value: Any) -> str:
    if isinstance(value, tuple | list):
        whole = (int(one) if isinstance(one, float) and one.is_integer() else one for one in value)
        return f"[{', '.join(map(_value, whole))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{name} = {_value(one)}' for name, one in value.items())} }}"
    if isinstance(value, str):
        # A string of JSON is one of TOML, but for this character.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return json.dumps(value)
