"""The text of FAP files."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from realizer.animation.fap.fap_clip import FAPClip
from realizer.animation.fap.fap_reader import read_fap
from realizer.animation.frames import FAPFrames
from realizer.outputs.fap_text import encode


@st.composite
def clips(draw) -> FAPClip:
    count = draw(st.integers(1, 5))
    used = draw(arrays(bool, 68))
    numbers = st.integers(-(2**31) + 1, 2**31 - 1)
    values = draw(arrays(np.int32, (count, 68), elements=numbers)) * used
    values[:, :2] = 0
    return FAPClip(
        draw(st.from_regex(r"[^\s\0]{1,12}", fullmatch=True)),
        draw(st.sampled_from([2.0, 5.0, 12.5, 25.0, 29.97, 60.0])),
        values.astype(np.int32),
        used,
        draw(arrays(np.int32, (count, 4), elements=numbers)) * used[0],
        draw(arrays(np.int32, (count, 6), elements=numbers)) * used[1],
    )


@given(clips())
def test_encode_is_inverted_by_read_fap(original):
    again = read_fap(encode(original))
    assert again == original
    assert [note for note in again.notes if "range" not in note] == []


def test_encode_writes_a_header_and_one_mask_for_all_frames():
    def mask(*used):
        return " ".join("1" if fap in used else "0" for fap in range(1, 69))

    varying = read_fap(f"2.1 x 25 2\n{mask(3)}\n0 7\n{mask(48)}\n1 -2\n")
    assert encode(varying) == f"2.1 x 25 2\n{mask(3, 48)}\n0 7 0\n{mask(3, 48)}\n1 0 -2\n"


def test_encode_writes_integers_and_a_name_without_blanks():
    frames = FAPFrames(np.zeros(1), np.full((1, 68), 1.5, np.float32), np.ones(68, bool))
    tokens = encode(FAPClip.of(frames, 25.0, "a b")).split()
    assert tokens[1] == "a_b"
    assert all(re.fullmatch(r"-?\d+", token) for token in tokens[2:])


def test_encode_omits_compound_faps_by_default():
    frames = FAPFrames(np.zeros(1), np.full((1, 68), 9, np.float32), np.ones(68, bool))
    lines = encode(FAPClip.of(frames, 25.0, "x")).splitlines()
    assert lines[1].split()[:3] == ["0", "0", "1"]
    assert len(lines[2].split()) == 1 + 66


def test_encode_refuses_a_rate_of_0():
    with pytest.raises(ValueError, match="fps: wanted a positive number, got 0"):
        encode(FAPClip("x", 0, *[np.zeros((0, 68), np.int32)] * 4))
