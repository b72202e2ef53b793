"""Tests of the decoder of what meshopt packs, by streams of the encoder that most programs use."""

from __future__ import annotations

import base64
import csv
import zlib
from pathlib import Path

import pytest

from realizer_studio.faces.arkit.meshopt import unpack

LINES = (Path(__file__).parent / "meshopt_cases.csv").read_text("utf-8").splitlines()
CASES = {row["name"]: row for row in csv.DictReader(line for line in LINES if line[0] != "#")}


def unpacked(row: dict[str, str], cut: int = 0) -> bytes:
    packed = base64.b64decode(row["packed"])
    packed = packed[: len(packed) - cut]
    return unpack(packed, row["mode"], row["transform"], int(row["count"]), int(row["stride"]))


@pytest.mark.parametrize("name", CASES)
def test_unpack_gives_what_was_packed(name: str) -> None:
    assert zlib.crc32(unpacked(CASES[name])) == int(CASES[name]["crc"])


@pytest.mark.parametrize("name", CASES)
def test_unpack_refuses_data_that_end_too_early(name: str) -> None:
    with pytest.raises(ValueError, match="end too early or are broken"):
        unpacked(CASES[name], 30 if CASES[name]["mode"] == "ATTRIBUTES" else 60)


def test_unpack_refuses_an_odd_stride() -> None:
    with pytest.raises(ValueError, match="stride 6"):
        unpack(b"\xa0" + bytes(40), "ATTRIBUTES", "NONE", 1, 6)
    with pytest.raises(ValueError, match="broken"):
        unpack(b"\xd1" + bytes(40), "INDICES", "NONE", 1, 6)
