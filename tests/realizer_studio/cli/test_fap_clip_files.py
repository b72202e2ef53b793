"""Clips as FAP text, tables and JSON, with the same contents."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from realizer.animation.fap.fap_clip import FAPClip
from realizer.core.errors import RealizerError
from realizer.offline import realize
from realizer.outputs.csv_table import encode_csv
from realizer.outputs.json_text import encode_json
from realizer.tables import faps
from realizer_studio.cli.fap_clip_files import ENCODINGS, clip_to_range, read_clip


@st.composite
def clips(draw: st.DrawFn) -> FAPClip:
    """Any that is within the ranges of the standard, of two frames or more: one has no rate in a table."""
    count = draw(st.integers(2, 6))
    used = draw(arrays(bool, 68))
    values = np.zeros((count, 68), np.int32)
    for row in faps()[2:]:
        if used[row.fap - 1]:
            number = st.integers(int(row.least), int(row.most))
            values[:, row.fap - 1] = draw(arrays(np.int32, count, elements=number))
    if not used.any():
        used[2] = True
    small = st.integers(0, 63)
    return FAPClip(
        draw(st.from_regex(r"[a-z]{1,12}", fullmatch=True)),
        draw(st.sampled_from([2.0, 5.0, 12.5, 25.0, 29.97, 60.0, 240.0])),
        values,
        used,
        draw(arrays(np.int32, (count, 4), elements=small)) * used[0],
        draw(arrays(np.int32, (count, 6), elements=small)) * used[1],
    )


def same(one: FAPClip, other: FAPClip) -> bool:
    """But for the name, which a table has no place for."""
    parts = ("values", "mask", "visemes", "expressions")
    return one.fps == other.fps and all(np.array_equal(getattr(one, p), getattr(other, p)) for p in parts)


@given(clips(), st.lists(st.sampled_from(list(ENCODINGS)), min_size=1, max_size=3))
@pytest.mark.slow
def test_read_clip_inverts_all_encodings(original: FAPClip, suffixes: list[str]) -> None:
    clip = original
    for suffix in suffixes:
        clip = read_clip(ENCODINGS[suffix](clip).encode())
        assert clip.notes == ()
        if suffix == ".csv":
            assert clip.name == ""
            clip = replace(clip, name=original.name)
    assert same(clip, original)
    assert clip.name == original.name


@pytest.mark.parametrize("encode", [encode_csv, encode_json])
def test_read_clip_reads_outputs_of_realize(encode) -> None:  # type: ignore[no-untyped-def]
    played = realize('<bml id="b"><faceLexeme id="s" lexeme="SURPRISE"/></bml>', fps=30, idle=False)
    clip = read_clip(encode(played).encode())
    assert clip.fps == 30
    np.testing.assert_array_equal(clip.values, played.faps.integers())


def test_clip_to_range_limits_values_with_notes() -> None:
    values = np.zeros((2, 68), np.int32)
    values[:, 2] = -5, 99_999
    clip = FAPClip(
        "x", 25, values, np.arange(68) == 2, np.zeros((2, 4), np.int32), np.zeros((2, 6), np.int32)
    )
    got = clip_to_range(clip)
    assert got.values[:, 2].tolist() == [0, 4320]
    assert got.notes == ("FAP 3 (open_jaw): wanted 0..4320, got -5; limited to it",)
    assert read_clip(ENCODINGS[".fap"](clip).encode()).values[:, 2].tolist() == [0, 4320]
    assert read_clip(ENCODINGS[".json"](clip).encode()).values[:, 2].tolist() == [-5, 99_999]


def test_read_clip_reads_a_table_of_a_spreadsheet() -> None:
    got = read_clip(b"\xef\xbb\xbftime, open_jaw ,comment\r\n1.0,10.4,a\r\n\r\n1.5,20,b\r\n")
    assert got.fps == 2
    assert got.values[:, 2].tolist() == [10, 20]
    assert np.flatnonzero(got.mask).tolist() == [2]
    assert got.notes == ("1 columns are not FAPs and are ignored",)


def test_read_clip_takes_a_table_of_one_frame_as_25_fps() -> None:
    got = read_clip(b"time,open_jaw\n0,7\n")
    assert (got.fps, got.values[0, 2]) == (25, 7)
    assert "have no rate" in got.notes[0]


BAD = {
    "no time": ("open_jaw,head_yaw\n1,2\n", "line 1: wanted a column time and some with names of FAPs"),
    "no FAP": ("time,jaw\n1,2\n", "line 1: wanted a column time and some with names of FAPs"),
    "a column twice": (
        "time,open_jaw,open_jaw\n0,1,1\n",
        "line 1: wanted each column once, got 'open_jaw' twice",
    ),
    "a cell too few": ("time,open_jaw\n0\n", "line 2: wanted 2 cells, got 1"),
    "no number": ("time,open_jaw\n0,wide\n", "line 2, open_jaw: wanted a number, got 'wide'"),
    "not finite": ("time,open_jaw\n0,nan\n", "line 2, open_jaw: wanted a number within 32 bits, got nan"),
    "times that stand": ("time,open_jaw\n1,1\n1,1\n", "time: wanted rising times, got 1 to 1"),
    "uneven times": (
        "time,open_jaw\n0,1\n0.1,1\n1,1\n",
        "time: wanted frames 0.5 s apart, got 0.1 in frame 1",
    ),
    "half JSON": ('{"fps": 25, "fap"', "wanted JSON, got"),
    "JSON of something else": (
        '{"type": "fap"}',
        'wanted {"fps": ..., "fap": {"values": ...}}, got no values',
    ),
    "no frames": ('{"fap": {"values": []}}', "fap.values: wanted a list of frames, got []"),
    "a short frame": ('{"fap": {"values": [[1, 2]]}}', "fap.values[0]: wanted 68 numbers, got 2"),
    "a word": ('{"fap": {"values": [["x"%s]]}}' % (67 * ",0"), "fap.values[0]: wanted a number, got 'x'"),
    "rate 0": ('{"fps": 0, "fap": {"values": [[0]]}}', "fps: wanted a number above 0, got 0"),
    "a viseme missing": (
        '{"fap": {"values": [[0%s]], "viseme": [[1,0,63,0],[1,0,63,0]]}}' % (67 * ",0"),
        "fap.viseme: wanted 1 frames, got 2",
    ),
    "text": ("hello world", "line 1: wanted a header"),
    "nothing of the kind": ("a,b\n1,2\n", "line 1: wanted a column time"),
}


@pytest.mark.parametrize(("text", "says"), BAD.values(), ids=BAD)
def test_read_clip_refuses_other_files_with_the_place(text: str, says: str) -> None:
    with pytest.raises(RealizerError, match=re.escape(says)):
        read_clip(text.encode())


@given(
    st.one_of(st.binary(max_size=200), st.text('{}[]":,0123456789fap values\n', max_size=80).map(str.encode))
)
def test_read_clip_reads_or_refuses_any_bytes(content: bytes) -> None:
    try:
        assert read_clip(content).values.shape[1:] == (68,)
    except RealizerError as error:
        says = str(error)
    else:
        return
    assert "wanted" in says
