"""Files of a recording: FAPs, CSV, JSON, and BML that replays it."""

import json
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from realizer.animation.axis import au, axis
from realizer.animation.fap.conversion import to_fap
from realizer.animation.fap.fap_clip import FAPClip
from realizer.animation.frames import AUFrames, FAPFrames
from realizer.behaviours.keyframes import document_of
from realizer.core.array_types import Bool, Float64
from realizer.core.units import ANGLE_UNIT
from realizer.face.fap_mapping import mapping_of
from realizer.outputs.csv_table import csv_text
from realizer.outputs.fap_text import encode
from realizer.tables import by_number, faps
from realizer.tables.cooccurrence import rules
from realizer_studio.tracking.person_recording import Recording
from realizer_studio.tracking.regressor import MEASURED_FAPS, MEASURED_UNITS, Measured

HEAD = (48, 49, 50)
# FAPs of a rotation (of both eyes or the head) -> action units of positive and negative values.
ROTATIONS: Mapping[tuple[int, ...], tuple[int, int]] = {
    (48,): (54, 53),
    (49,): (51, 52),
    (50,): (56, 55),
    (23, 24): (61, 62),
    (25, 26): (64, 63),
}


def unit_columns(measured: Recording | Measured) -> dict[str, Float64]:
    """Return the values (n,) 0..1 of all measured action units, including those of head and eyes."""
    columns = dict(zip(MEASURED_UNITS, measured.units.T, strict=True))
    for numbers, units in ROTATIONS.items():
        degrees = np.degrees(measured.faps[:, np.array(numbers) - 1].mean(axis=1) * ANGLE_UNIT)
        for sign, unit in zip((1, -1), units, strict=True):
            share = np.clip(sign * degrees / by_number()[unit].degrees, 0, 1)
            columns |= {target.name: share for target in au(unit)}
    return columns


def by_mapping(recording: Recording, face: str) -> Recording:
    """Return the recording with FAPs computed from its action units by a face's mapping; raises FaceError."""
    rows = np.zeros((len(recording.times), len(axis())), np.float32)
    rows[:, [axis()[name].column for name in MEASURED_UNITS]] = recording.units
    faps = to_fap(AUFrames(recording.times, rows, rules()), mapping_of(face)).values.astype(np.float64)
    turned = [fap - 1 for numbers in ROTATIONS for fap in numbers]
    faps[:, turned] = recording.faps[:, turned]
    return replace(recording, faps=faps)


def mask() -> Bool:
    """Return (68,) whether each FAP is measured."""
    measured = np.zeros(68, bool)
    measured[np.array([*MEASURED_FAPS, *HEAD]) - 1] = True
    return measured


def clip_of(faps: Float64, observed: Bool, fps: float, name: str) -> FAPClip:
    """Return FAPs (n, 68), with a mask (68,) of observed ones, as a clip of at least two frames."""
    values = np.repeat(faps, 2, axis=0) if len(faps) == 1 else faps
    frames = FAPFrames(np.arange(len(values)) / fps, values.astype(np.float32), observed)
    return FAPClip.of(frames, fps, name)


def _clip(recording: Recording, name: str) -> FAPClip:
    return clip_of(recording.faps, mask(), recording.fps, name)


def _csv(recording: Recording, name: str) -> str:
    columns = unit_columns(recording)
    rows = zip(recording.times, recording.visible, zip(*columns.values(), strict=True), strict=True)
    return csv_text(
        ["time", *(f"AU{unit}" for unit in columns)],
        ([f"{time:.6f}", *(f"{v:.4f}" if visible else "" for v in values)] for time, visible, values in rows),
    )


def _json(recording: Recording, name: str) -> str:
    columns = unit_columns(recording)
    values = np.stack(list(columns.values()), axis=1)
    turned = np.degrees(recording.faps[:, np.array(HEAD) - 1] * ANGLE_UNIT)
    content = {
        "fps": recording.fps,
        "frames": len(recording.times),
        "duration": float(recording.times[-1]),
        "seen": recording.visible.tolist(),
        "au": {"names": list(columns), "values": values.round(4).tolist()},
        "head": {"names": ["pitch", "yaw", "roll"], "values": turned.round(2).tolist()},
        "fap": {
            "names": [row.name for row in faps()],
            "values": np.rint(recording.faps).astype(int).tolist(),
            "mask": mask().tolist(),
        },
    }
    return json.dumps(content) + "\n"


# Suffix -> the text of a recording with a name.
FORMATS: Mapping[str, Callable[[Recording, str], str]] = {
    ".fap": lambda recording, name: encode(_clip(recording, name)),
    ".csv": _csv,
    ".json": _json,
    ".bml": lambda recording, name: document_of(_clip(recording, name), "tracked"),
}
