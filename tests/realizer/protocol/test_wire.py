"""Binary frames: round trips, and the bytes of the header."""

from __future__ import annotations

import json
import struct
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.protocol.streams import KINDS, STREAMS, Stream
from realizer.protocol.wire import (
    ClipPiece,
    WireError,
    json_frame,
    pack,
    pack_clip,
    pack_frames,
    unpack,
    unpack_clip,
)


@given(
    stream=st.sampled_from([row.name for row in KINDS.values()]),
    frame=st.integers(0, 2**32 - 1),
    time=st.floats(0, 1e6),
    payload=st.binary(max_size=64),
    character=st.integers(0, 255),
    forget=st.booleans(),
)
def test_unpack_returns_what_was_packed(stream, frame, time, payload, character, forget) -> None:
    got = unpack(pack(stream, frame, time, payload, character=character, flush=forget))
    assert (got.stream, got.frame, got.time, got.payload) == (stream, frame, time, payload)
    assert (got.character, got.flush) == (character, forget)


@given(
    stream=st.sampled_from(["fap", "au"]),
    first=st.integers(0, 2**31),
    count=st.integers(0, 5),
    width=st.integers(1, 70),
    character=st.integers(0, 255),
)
def test_pack_frames_equals_pack_of_each_frame(stream, first, count, width, character) -> None:
    dtype = STREAMS[stream].dtype
    rows = np.arange(count * width).reshape(count, width).astype(dtype)
    times = (first + np.arange(count)) / 25
    whole, size = pack_frames(stream, first, times, rows, character=character)
    alone = [
        pack(stream, first + k, float(times[k]), rows[k].tobytes(), character=character) for k in range(count)
    ]
    assert [whole[k * size : (k + 1) * size] for k in range(count)] == alone
    assert len(whole) == count * size


def test_pack_has_a_little_endian_header_of_16_bytes() -> None:
    message = pack("audio", 7, 0.14, b"xy", character=3, flush=True)
    assert struct.unpack("<BBHId", message[:16]) == (4, 1, 0x103, 7, 0.14)
    assert message[16:] == b"xy"


@pytest.mark.parametrize(
    ("stream", "values"),
    [
        ("fap", np.arange(68, dtype="<i4")),
        ("au", np.linspace(0, 1, 9, dtype="<f4")),
        ("audio", np.arange(-5, 5, dtype="<i2")),
        ("mesh", np.arange(12, dtype="<i2").reshape(4, 3)),
    ],
)
def test_values_have_the_type_of_their_kind(stream, values) -> None:
    got = unpack(pack(stream, 0, 0.0, values.tobytes())).values
    assert got.dtype == values.dtype
    assert np.array_equal(got, values)


def test_unpack_needs_no_class_of_a_stream_of_numbers(monkeypatch) -> None:
    jaw = Stream("jaw", ("binary", "json"), ("fps",), kind=99, dtype="<f4", payload="float32")
    monkeypatch.setitem(KINDS, 99, jaw)
    message = bytearray(pack("au", 3, 0.12, np.array([0.5, 1], "<f4").tobytes()))
    message[0] = 99
    frame = replace(unpack(bytes(message)), stream_info={"names": ["open", "forward"]})
    assert (frame.stream, frame.frame, frame.time) == ("jaw", 3, 0.12)
    assert frame.named == {"open": 0.5, "forward": 1}


def test_vertices_are_scaled_and_moved() -> None:
    steps = np.array([[-2, 0, 2], [4, 6, 8]], "<i2")
    frame = unpack(pack("mesh", 0, 0.0, steps.tobytes()))
    described = replace(frame, stream_info={"scale": 0.5, "offset": [1.0, 2.0, 3.0]})
    assert described.vertices.tolist() == [[0, 2, 4], [3, 5, 7]]
    with pytest.raises(WireError, match="a mesh whose scale is known"):
        _ = frame.vertices


def test_values_refuse_a_picture() -> None:
    with pytest.raises(WireError, match="picture has no values"):
        _ = unpack(pack("video", 0, 0.0, b"jpeg")).values


@pytest.mark.parametrize(
    ("message", "says"),
    [
        (b"short", "16 bytes, got 5"),
        (struct.pack("<BBHId", 1, 9, 0, 0, 0.0), "version 1 .* got 9"),
        (struct.pack("<BBHId", 77, 1, 0, 0, 0.0), "got 77"),
    ],
)
def test_unpack_refuses_invalid_messages(message, says) -> None:
    with pytest.raises(WireError, match=says):
        unpack(message)


def test_json_frame_has_stream_number_and_time() -> None:
    assert json.loads(json_frame("fap", 3, 0.12, [1, 2])) == {
        "type": "fap",
        "frame": 3,
        "time": 0.12,
        "values": [1, 2],
    }
    assert json.loads(json_frame("au", 0, 0.0, [], "Ada"))["character"] == "Ada"


def test_unpack_clip_returns_what_was_packed() -> None:
    piece = ClipPiece("müsli", 7, 22050, b"\x01\x02\x03", final=False)
    message = pack_clip(piece)
    assert message[:8] == bytes([4, 1, 0, 0, 7, 0, 0, 0])
    assert unpack_clip(message) == piece
    assert unpack_clip(pack_clip(replace(piece, final=True))).final


@pytest.mark.parametrize(
    ("message", "says"),
    [
        (b"\x04\x01", "header"),
        (pack("fap", 0, 0.0, b""), "kind 1"),
        (pack("audio", 0, 0.0, b"abc"), "rate and an id"),
        (pack("audio", 0, 0.0, b"\x00\x00\x00\x00\x05ab"), "id of 5 bytes"),
        (pack("audio", 0, 0.0, b"\x00\x00\x00\x00\x00ab"), "id of 1 bytes"),
        (pack("audio", 0, 0.0, b"\x00\x00\x00\x00\x02\xff\xfe"), "UTF-8"),
    ],
)
def test_unpack_clip_refuses_invalid_messages(message, says) -> None:
    with pytest.raises(WireError, match=says):
        unpack_clip(message)
