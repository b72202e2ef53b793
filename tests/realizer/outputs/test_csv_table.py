"""Tests of the output .csv."""

from __future__ import annotations

import csv
import io

import pytest

from realizer.animation.axis import AU_NAMES
from realizer.outputs.csv_table import encode_csv
from realizer.tables import faps


def test_csv_has_rows_for_frames_and_columns_for_aus_and_faps(realization):
    header, *rows = csv.reader(io.StringIO(encode_csv(realization)))
    assert header[0] == "time"
    assert header[1 : 1 + len(AU_NAMES())] == [f"AU{name}" for name in AU_NAMES()]
    assert header[1 + len(AU_NAMES()) :] == [row.name for row in faps()]
    assert len(set(header)) == len(header)
    assert len(rows) == 38
    last = dict(zip(header, rows[-1], strict=True))
    assert float(last["time"]) == pytest.approx(37 / 25)
    assert float(last["AU12L"]) == 1
    assert int(last["open_jaw"]) == realization.faps.integers()[-1, 2]
