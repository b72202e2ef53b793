"""Messages with arrays behind their JSON."""

from __future__ import annotations

import json

import numpy as np

from realizer_studio.editors.packed_messages import packed, unpacked


def test_packed_begins_arrays_where_its_json_says() -> None:
    arrays = {"a": np.arange(3, dtype=np.float32), "b": np.arange(5, dtype=np.float64)}
    message = packed({"id": 1}, arrays)
    length = int.from_bytes(message[:4], "little")
    header = json.loads(message[4 : 4 + length])
    assert header["id"] == 1
    for name, array in arrays.items():
        kind, count, start = header["arrays"][name]
        assert start % 8 == 0
        assert (np.frombuffer(message, f"<{kind}", count, start) == array).all()


def test_unpacked_is_the_json_and_the_bytes_behind_it() -> None:
    assert unpacked('{"type": "open"}') == ({"type": "open"}, b"")
    assert unpacked(b"\2\0\0\0{}mesh") == ({}, b"mesh")
