"""Tests of the files of a recording."""

from __future__ import annotations

import csv
import io
import json

import numpy as np
import pytest

from bml_schema import parse
from realizer.animation.fap.fap_reader import read_fap
from realizer_studio.tracking.files import FORMATS, by_mapping, unit_columns
from realizer_studio.tracking.person_recording import Recording
from realizer_studio.tracking.regressor import MEASURED_UNITS


def recording() -> Recording:
    """A smile with a turn of the head to the left; nobody is seen in the last frame."""
    units, faps = np.zeros((3, len(MEASURED_UNITS))), np.zeros((3, 68))
    units[:2, MEASURED_UNITS.index("12L")] = 0.75
    faps[:2, 11] = 240.4
    faps[:2, 48] = np.radians(30) / 1e-5
    return Recording(10.0, np.arange(3) / 10, units, faps, np.array([True, True, False]))


def test_units_of_the_head_are_shares_of_their_rotation() -> None:
    columns = unit_columns(recording())
    assert columns["51"] == pytest.approx([0.5, 0.5, 0])
    assert not columns["52"].any()


def test_table_has_a_column_for_each_unit_and_blanks_where_nobody_is_seen() -> None:
    head, *rows = csv.reader(io.StringIO(FORMATS[".csv"](recording(), "x")))
    assert head[:3] == ["time", "AU1L", "AU1R"]
    assert rows[1][head.index("AU12L")] == "0.7500"
    assert set(rows[2][1:]) == {""}


def test_json_has_units_faps_and_head() -> None:
    content = json.loads(FORMATS[".json"](recording(), "x"))
    assert content["head"]["values"][0] == [0, 30, 0]
    assert content["fap"]["values"][1][11] == 240
    assert content["seen"] == [True, True, False]
    assert len(content["au"]["names"]) == len(content["au"]["values"][0])


def test_fap_file_and_document_hold_the_same_values() -> None:
    clip = read_fap(FORMATS[".fap"](recording(), "x"))
    assert clip.values[:, 11].tolist() == [240, 240, 0]
    document = FORMATS[".bml"](recording(), "x")
    assert 'type="FAPS"' in document
    assert parse(document).id == "tracked"


def test_faps_by_mapping_come_from_the_units() -> None:
    mapped = by_mapping(recording(), "ada")
    assert mapped.faps[0, 12] == 0  # the right corner of the mouth
    assert mapped.faps[0, 11] > 100
    assert mapped.faps[0, 48] == recording().faps[0, 48]
