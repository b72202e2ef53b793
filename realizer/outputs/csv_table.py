"""The outputs .csv (time, AUs and FAPs) and .arkit.csv (ARKit weights as Live Link Face writes them)."""

import csv
import io
from collections.abc import Iterable
from typing import Any

import numpy as np

from realizer.animation.arkit import ARKIT_NAMES, ArkitFrames, arkit
from realizer.animation.axis import AU_NAMES
from realizer.outputs.output import Output, text_output
from realizer.realization import Realization
from realizer.tables import faps


def csv_text(header: Iterable[str], rows: Iterable[Iterable[Any]]) -> str:
    """Return a table as CSV."""
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\n").writerows([header, *rows])
    return buffer.getvalue()


def encode_csv(realization: Realization) -> str:
    """Return rows of `time` in seconds, AUs such as `AU12L` in 0..1, FAPs as integers in FAPU."""
    frames = zip(
        realization.aus.times, realization.aus.aus.tolist(), realization.faps.integers().tolist(), strict=True
    )
    return csv_text(
        ["time", *(f"AU{name}" for name in AU_NAMES()), *(row.name for row in faps())],
        ([f"{time:.6f}", *(f"{au:.4f}" for au in aus), *values] for time, aus, values in frames),
    )


CSV = text_output(".csv", "text/csv", "a row a frame: time, action units, FAPs", encode_csv)

_EYE = ("Blink", "LookDown", "LookIn", "LookOut", "LookUp", "Squint", "Wide")
# The order of the app's files.
SHAPES = (
    *(f"Eye{word}{side}" for side in ("Left", "Right") for word in _EYE),
    *(f"Jaw{word}" for word in ("Forward", "Right", "Left", "Open")),
    *(f"Mouth{word}" for word in ("Close", "Funnel", "Pucker", "Right", "Left")),
    *(f"Mouth{word}{side}" for word in ("Smile", "Frown", "Dimple", "Stretch") for side in ("Left", "Right")),
    *(f"Mouth{word}{lip}" for word in ("Roll", "Shrug") for lip in ("Lower", "Upper")),
    *(f"Mouth{word}{side}" for word in ("Press", "LowerDown", "UpperUp") for side in ("Left", "Right")),
    *("BrowDownLeft", "BrowDownRight", "BrowInnerUp", "BrowOuterUpLeft", "BrowOuterUpRight"),
    *("CheekPuff", "CheekSquintLeft", "CheekSquintRight", "NoseSneerLeft", "NoseSneerRight", "TongueOut"),
)
TURNS = tuple(
    f"{part}{turn}" for part in ("Head", "LeftEye", "RightEye") for turn in ("Yaw", "Pitch", "Roll")
)
COLUMNS = ("Timecode", "BlendShapeCount", *SHAPES, *TURNS)


def encode_arkit_csv(frames: ArkitFrames, fps: float) -> str:
    """Return rows of the time as `HH:MM:SS:FF.fff` at `fps`, 61, weights 0..1, and rotations in radians.

    Yaw is to the character's left, pitch down, roll to its right, as in the file of an unmirrored face in
    Unreal. Eyes do not roll.
    """
    order = [ARKIT_NAMES().index(name[0].lower() + name[1:]) for name in SHAPES]
    eyes = np.pad(frames.eyes, ((0, 0), (0, 0), (0, 1))).reshape(len(frames.times), 6)
    rows = np.concatenate([frames.weights[:, order], frames.head, eyes], axis=1) + 0.0  # no -0
    timed = zip(frames.times.tolist(), rows.tolist(), strict=True)
    return csv_text(
        COLUMNS, ([_timecode(time, fps), len(row), *(f"{value:.6f}" for value in row)] for time, row in timed)
    )


def _timecode(seconds: float, fps: float) -> str:
    thousandths = round(seconds * 1000 * fps)  # of a frame
    whole, rest = divmod(thousandths, round(1000 * fps))
    return f"{whole // 3600:02}:{whole // 60 % 60:02}:{whole % 60:02}:{rest // 1000:02}.{rest % 1000:03}"


ARKIT_CSV = Output(
    ".arkit.csv",
    "text/csv",
    "a row a frame: ARKit's 52 weights as Live Link Face writes them",
    lambda made, _: encode_arkit_csv(arkit(made.aus, made.mapping), made.fps).encode(),
)
