"""The mpeg4.toml of a face folder: reader and writer."""

import json
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Int32
from realizer.core.errors import FaceError
from realizer.core.toml_text import parse_toml
from realizer.face.reading import face_errors
from realizer_studio.faces.mpeg4.zones import Setup, Zone

FILE = "mpeg4.toml"
HEAD = """\
# The zones of the MPEG-4 deformer (Paul 2010, 4.3.3). `realizer faces zones NAME` makes fields.npz from them.
# size and pivot in metres; points override those of features.csv; a mask's vertices as ranges, last included
"""
MAX_VERTICES = 2**20
KEYS = ("joined", "synced", "whole", "points", "zone", "masks")


def read_setup(path: Path) -> Setup:
    """Read the parameters from a file.

    Raises:
        FaceError: no such file, not TOML, an unknown key, or a value of the wrong kind or out of range.
    """
    with face_errors(path, "a TOML file with the deformer's zones"):
        table = parse_toml(path.read_text("utf-8"))
    return setup_from(path, table)


def setup_from(path: Path | str, table: dict[str, Any]) -> Setup:
    """Return the parameters from a table with the keys of the file, as `setup_table` returns it.

    Raises:
        FaceError: as `read_setup`; `path` begins its text.
    """
    if unknown := sorted(set(table) - set(KEYS)):
        raise FaceError(f"{path}: wanted {', '.join(KEYS)}; got {', '.join(unknown)}")
    zones: dict[int, Zone] = {}
    for number, entry in enumerate(_entry(path, table, "zone", list), 1):
        zone = _zone(f"{path}: zone {number}", entry)
        if zone.fap in zones:
            raise FaceError(f"{path}: zone {number}: FAP {zone.fap} has one already; delete one of them")
        zones[zone.fap] = zone
    masks: dict[int, Int32] = {}
    for key, ranges in _entry(path, table, "masks", dict).items():
        for word in key.split():
            masks[_integer(f"{path}: masks: {key!r}", word)] = _expanded(f"{path}: masks: {key!r}", ranges)
    positions = _entry(path, table, "points", dict)
    points = {name: _triple(f"{path}: points: {name}", position) for name, position in positions.items()}
    synced, rigid = (
        frozenset(_integer(f"{path}: {key}", fap) for fap in _entry(path, table, key, list))
        for key in ("synced", "whole")
    )
    return Setup(points, zones, masks, synced, bool(table.get("joined", True)), rigid)


def setup_table(setup: Setup) -> dict[str, Any]:
    """Return the parameters as a table with the keys of the file, for JSON."""
    return {
        "joined": setup.joined,
        "synced": sorted(setup.synced),
        "whole": sorted(setup.rigid),
        "points": {name: list(position) for name, position in setup.points.items()},
        "zone": [asdict(setup.zones[fap]) for fap in sorted(setup.zones)],
        "masks": {str(fap): ranges(mask) for fap, mask in sorted(setup.masks.items())},
    }


def write_setup(path: Path, setup: Setup) -> None:
    """Write the file, without feature points, which are in the folder's features.csv."""
    lines = [HEAD + f"joined = {_toml(setup.joined)}"]
    lines.append(
        f"synced = [{', '.join(map(str, sorted(setup.synced)))}]  # FAPs whose two sides go together"
    )
    if setup.rigid:
        lines.append(f"whole = [{', '.join(map(str, sorted(setup.rigid)))}]")
    defaults = {f.name: f.default for f in fields(Zone)}
    for fap in sorted(setup.zones):
        zone = setup.zones[fap]
        lines += ["", "[[zone]]"]
        changed = {name: value for name, value in asdict(zone).items() if value != defaults[name]}
        lines += [f"{name} = {_toml(value)}" for name, value in changed.items()]
    if setup.masks:
        lines += ["", "[masks]  # FAPs that share it = vertices"]
        shared: dict[str, list[int]] = {}
        for fap in sorted(setup.masks):
            shared.setdefault(ranges(setup.masks[fap]), []).append(fap)
        lines += [f'"{" ".join(map(str, group))}" = "{ranges}"' for ranges, group in shared.items()]
    path.write_text("\n".join(lines) + "\n", "utf-8")


def _zone(where: str, entry: Any) -> Zone:
    if not isinstance(entry, dict):
        raise FaceError(f"{where}: wanted a table, got {entry!r}")
    kinds = {f.name: str(f.type) for f in fields(Zone)}
    unknown = sorted(set(entry) - set(kinds))
    if unknown:
        raise FaceError(f"{where}: wanted {', '.join(kinds)}; got {', '.join(unknown)}")
    for name in ("fap", "falloff", "size"):
        if name not in entry:
            raise FaceError(f"{where}: {name} is missing")
    readers: dict[str, Any] = {"Triple": _triple, "int": _integer, "float": _number, "bool": _flag}
    values = {
        name: readers[kinds[name]](f"{where}: {name}", value) if kinds[name] in readers else value
        for name, value in entry.items()
    }
    try:
        return Zone(**values)
    except FaceError as error:
        raise FaceError(f"{where}: {error}") from None


def _entry(
    path: Path | str, table: dict[str, Any], key: str, kind: type[list[Any]] | type[dict[str, Any]]
) -> Any:
    value = table.get(key, kind())
    if not isinstance(value, kind):
        raise FaceError(f"{path}: {key}: wanted a {'list' if kind is list else 'table'}, got {value!r}")
    return value


def _flag(where: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise FaceError(f"{where}: wanted true or false, got {value!r}")
    return value


def _number(where: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FaceError(f"{where}: wanted a number, got {value!r}")
    return float(value)


def _integer(where: str, value: Any) -> int:
    try:
        return int(value)
    except (TypeError, ValueError, OverflowError):
        raise FaceError(f"{where}: wanted a FAP's number, got {value!r}") from None


def _triple(where: str, value: Any) -> tuple[float, float, float]:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise FaceError(f"{where}: wanted three numbers, got {value!r}")
    x, y, z = (_number(where, number) for number in value)
    return x, y, z


def _expanded(where: str, ranges: Any) -> Int32:
    """Return the vertices of ranges: `"3-5 9"` is 3, 4, 5, 9."""
    mask = np.zeros(MAX_VERTICES, bool)
    for word in str(ranges).split():
        first, _, last = word.partition("-")
        try:
            vertices = range(int(first), int(last or first) + 1)
        except ValueError:
            vertices = range(0)
        if not vertices or vertices[-1] >= MAX_VERTICES:
            raise FaceError(f"{where}: wanted ranges such as '3-5 9', got {word[:80]!r}")
        mask[vertices.start : vertices.stop] = True
    return np.flatnonzero(mask).astype(np.int32)


def ranges(mask: Int32) -> str:
    """Return ascending numbers as ranges: 3, 4, 5, 9 are `"3-5 9"`."""
    cuts = np.flatnonzero(np.diff(mask) != 1) + 1
    runs = [run for run in np.split(mask, cuts) if len(run)]
    return " ".join(str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs)


def _toml(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(f'{float(number):.7g}' for number in value)}]"
    return f"{value:.7g}" if isinstance(value, float) else json.dumps(value)
