"""The output .csv: time, every AU and every FAP, a row for each frame."""

import csv
import io
from collections.abc import Iterable
from typing import Any

from realizer.animation.axis import AU_NAMES
from realizer.outputs.output import text_output
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
