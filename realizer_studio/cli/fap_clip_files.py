"""Readers and writers of FAP clips as .fap, .csv and .json files."""

import csv
import io
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from realizer.animation.fap.fap_clip import FAPClip
from realizer.animation.fap.fap_reader import INT32, read_fap
from realizer.core.errors import RealizerError
from realizer.core.json_reader import parse_json
from realizer.outputs import fap_text
from realizer.outputs.csv_table import csv_text
from realizer.outputs.json_text import json_line
from realizer.tables import faps

# Table columns of FAP 1 and 2.
VISEME = tuple(f"viseme_{part}" for part in ("select1", "select2", "blend", "def"))
EXPRESSION = tuple(
    f"expression_{part}" for part in ("select1", "intensity1", "select2", "intensity2", "init_face", "def")
)


def read_clip(content: bytes) -> FAPClip:
    """Read a clip from any of the three formats; its `notes` list deviations from the format.

    Also reads the tables and JSON of `realizer realize`, ignoring values that are not FAPs.

    Raises:
        RealizerError: if it is none of them, or a cell is not a number; the text says where.
    """
    text = content.decode("utf-8-sig", "replace")
    if text.lstrip().startswith("{"):
        return _from_json(text)
    if "," in text.partition("\n")[0]:
        return _from_csv(text)
    return read_fap(content)


def clip_to_range(clip: FAPClip) -> FAPClip:
    """Limit a clip to the range of the standard, with a note for each FAP that exceeded it."""
    rows = faps()
    values = np.clip(clip.values, [row.least for row in rows], [row.most for row in rows]).astype(np.int32)
    values[:, :2] = clip.values[:, :2]
    notes = [
        f"FAP {row.fap} ({row.name}): wanted {row.least:g}..{row.most:g}, got {before[before != after][0]}; "
        "limited to it"
        for row, before, after in zip(rows, clip.values.T, values.T, strict=True)
        if (before != after).any()
    ]
    return replace(clip, values=values, notes=(*clip.notes, *notes))


def _to_csv(clip: FAPClip) -> str:
    """Return rows of `time` in seconds, the numbers of FAP 1 and 2, and the FAPs in the mask, in FAPU."""
    columns = [VISEME, EXPRESSION, *((row.name,) for row in faps()[2:])]
    names = [name for part, shown in zip(columns, clip.mask, strict=True) if shown for name in part]
    rows = enumerate(fap_text.columns(clip).tolist())
    return csv_text(["time", *names], ([f"{frame / clip.fps:.9g}", *row] for frame, row in rows))


def _from_csv(text: str) -> FAPClip:
    try:
        lines = [(number, row) for number, row in enumerate(csv.reader(io.StringIO(text)), 1) if any(row)]
    except csv.Error as error:
        raise RealizerError(f"wanted a table, got {error}") from None
    (_, head), *body = lines or [(1, [""])]
    head = [name.strip() for name in head]
    numbers = {row.name: row.fap for row in faps()[2:]}
    if "time" not in head or not (named := {*numbers, *VISEME, *EXPRESSION}.intersection(head)):
        raise RealizerError(f"line 1: wanted a column time and some with names of FAPs, got {head[:6]}")
    if len(set(head)) < len(head):
        twice = next(name for name in head if head.count(name) > 1)
        raise RealizerError(f"line 1: wanted each column once, got {twice!r} twice")
    column_of = {name: k for k, name in enumerate(head) if name in named or name == "time"}
    cells = np.empty((len(body), len(column_of)))
    for index, (number, row) in enumerate(body):
        if len(row) != len(head):
            raise RealizerError(f"line {number}: wanted {len(head)} cells, got {len(row)}")
        cells[index] = [_number(row[k], f"line {number}, {name}") for name, k in column_of.items()]
    columns = dict(zip(column_of, cells.T, strict=True))
    fps, notes = _rate(columns["time"])
    ignored = len(head) - 1 - len(named)
    if ignored:
        notes.append(f"{ignored} columns are not FAPs and are ignored")
    values, mask = np.zeros((len(body), 68)), np.zeros(68, bool)
    for name, fap in numbers.items():
        if name in columns:
            values[:, fap - 1], mask[fap - 1] = columns[name], True
    compound = []
    for fap, names in ((0, VISEME), (1, EXPRESSION)):
        mask[fap] = any(name in columns for name in names)
        compound.append(np.stack([columns.get(name, np.zeros(len(body))) for name in names], axis=1))
    return FAPClip(
        "", fps, _rounded(values), mask, _rounded(compound[0]), _rounded(compound[1]), tuple(notes)
    )


def _rate(times: npt.NDArray[np.float64]) -> tuple[float, list[str]]:
    """Return the frame rate of a column of times, and notes.

    Raises:
        RealizerError: if they do not rise evenly.
    """
    if len(times) < 2:
        return 25.0, ["fewer than two frames have no rate; taken as 25 a second"]
    step = (times[-1] - times[0]) / (len(times) - 1)
    if not step > 0:
        raise RealizerError(f"time: wanted rising times, got {times[0]:g} to {times[-1]:g}")
    deviation = np.abs(times - times[0] - step * np.arange(len(times)))
    if deviation.max() > step / 2:
        got = f"{times[deviation.argmax()]:g} in frame {deviation.argmax()}"
        raise RealizerError(f"time: wanted frames {step:.4g} s apart, got {got}")
    return float(f"{1 / step:.6g}"), []


def _to_json(clip: FAPClip) -> str:
    """Return FAPs in the JSON of `realizer realize`, with the numbers of FAP 1 and 2 if in the mask."""
    fap: dict[str, Any] = {
        "names": [row.name for row in faps()],
        "values": clip.values.tolist(),
        "mask": clip.mask.astype(int).tolist(),
    }
    if clip.mask[0]:
        fap["viseme"] = clip.visemes.tolist()
    if clip.mask[1]:
        fap["expression"] = clip.expressions.tolist()
    return json_line({"name": clip.name, "fps": clip.fps, "frames": len(clip.values), "fap": fap})


def _from_json(text: str) -> FAPClip:
    try:
        content = parse_json(text)
    except ValueError as error:
        raise RealizerError(f"wanted JSON, got {error}") from None
    fap = content.get("fap")
    if not isinstance(fap, dict) or "values" not in fap:
        raise RealizerError('wanted {"fps": ..., "fap": {"values": ...}}, got no values')
    fps = _number(content.get("fps", 25.0), "fps")
    if not fps > 0:
        raise RealizerError(f"fps: wanted a number above 0, got {fps:g}")
    values = _rounded(np.stack(list(_rows(fap["values"], 68, "fap.values"))))
    count = len(values)
    mask = next(_rows([fap.get("mask", [1] * 68)], 68, "fap.mask")) != 0
    compound = []
    for column, name, width in ((0, "viseme", 4), (1, "expression", 6)):
        mask[column] = name in fap
        rows = list(_rows(fap.get(name, [[0] * width] * count), width, f"fap.{name}"))
        if len(rows) != count:
            raise RealizerError(f"fap.{name}: wanted {count} frames, got {len(rows)}")
        compound.append(_rounded(np.stack(rows)))
    values[:, ~mask] = 0
    return FAPClip(str(content.get("name", "")), fps, values, mask, compound[0], compound[1])


def _rows(rows: Any, width: int, where: str) -> Iterator[npt.NDArray[np.float64]]:
    """Yield each row as numbers; at least one."""
    if not isinstance(rows, list) or not rows:
        raise RealizerError(f"{where}: wanted a list of frames, got {str(rows)[:40]}")
    for number, row in enumerate(rows):
        if not isinstance(row, list) or len(row) != width:
            got = len(row) if isinstance(row, list) else str(row)[:40]
            raise RealizerError(f"{where}[{number}]: wanted {width} numbers, got {got}")
        yield np.array([_number(cell, f"{where}[{number}]") for cell in row])


def _number(cell: Any, where: str) -> float:
    try:
        number = float(cell)
    except (TypeError, ValueError):
        raise RealizerError(f"{where}: wanted a number, got {str(cell)[:40]!r}") from None
    if not abs(number) <= INT32:
        raise RealizerError(f"{where}: wanted a number within 32 bits, got {str(cell)[:40]}")
    return number


def _rounded(values: npt.NDArray[np.float64]) -> npt.NDArray[np.int32]:
    return np.rint(values).astype(np.int32)


# The encoder of each suffix.
ENCODINGS: dict[str, Callable[[FAPClip], str]] = {
    ".fap": lambda clip: fap_text.encode(clip_to_range(clip)),
    ".csv": _to_csv,
    ".json": _to_json,
}
