"""The output .csv: time, every AU and every FAP, a row for each frame."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

from realizer.animation.axis import AU_NAMES
from realizer.outputs.output import Output, RenderSettings
from realizer.tables import faps

if TYPE_CHECKING:
    from realizer.realization import Realization


def encode_csv(realization: Realization) -> str:
    """Return rows of `time` in seconds, AUs such as `AU12L` in 0..1, FAPs as integers in FAPU."""
    buffer = io.StringIO()
    table = csv.writer(buffer, lineterminator="\n")
    table.writerow(["time", *(f"AU{name}" for name in AU_NAMES()), *(row.name for row in faps())])
    aus, clip = realization.aus, realization.faps
    for time, intensities, values in zip(aus.times, aus.aus.tolist(), clip.integers().tolist(), strict=True):
        table.writerow([f"{time:.6f}", *(f"{x:.4f}" for x in intensities), *values])
    return buffer.getvalue()


def _encode(realization: Realization, drawing: RenderSettings) -> bytes:
    return encode_csv(realization).encode()


CSV = Output(".csv", "text/csv", "a row a frame: time, action units, FAPs", _encode)
