"""The table of streams, and what is derived from it."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from realizer.animation.axis import axis
from realizer.animation.fap.conversion import standard
from realizer.animation.frames import AUFrames
from realizer.protocol.messages.common import Encoding, NumericStream, StreamName
from realizer.protocol.messages.requests import Subscribe
from realizer.protocol.streams import KINDS, STREAMS
from realizer.protocol.wire import pack, pack_frames, unpack
from realizer.server.streams.frame_windows import SOURCES

ROWS = pytest.mark.parametrize("row", STREAMS.values(), ids=list(STREAMS))


def test_kinds_are_the_streams_that_have_one_in_order() -> None:
    assert list(KINDS) == list(range(1, len(KINDS) + 1))
    assert {row.name for row in KINDS.values()} == {n for n, row in STREAMS.items() if row.kind is not None}


def test_streams_are_the_literals_of_messages() -> None:
    assert get_args(StreamName) == tuple(STREAMS)
    assert set(get_args(NumericStream)) == SOURCES.keys()
    assert set(get_args(Encoding)) == {name for row in STREAMS.values() for name in row.encodings}


@ROWS
def test_row_has_a_kind_where_it_is_binary(row) -> None:
    assert (row.kind is not None) == ("binary" in row.encodings) == bool(row.payload)
    assert row.numeric == (row.name in SOURCES)


@ROWS
def test_options_are_fields_of_subscribe(row) -> None:
    own = {
        name
        for name, field in Subscribe.model_fields.items()
        if (field.description or "").startswith(f"{row.name}:")
    }
    assert own == set(row.options) - {"fps", "character", "ahead"}
    assert set(row.options) <= Subscribe.model_fields.keys()


@pytest.mark.parametrize("row", KINDS.values(), ids=lambda row: row.name)
def test_message_is_unpacked_as_its_stream(row) -> None:
    numbers = np.arange(6, dtype=row.dtype or "u1")
    frame = unpack(pack(row.name, 3, 0.12, numbers.tobytes(), flush=row.flushes))
    assert (frame.kind, frame.stream, frame.flush) == (row.kind, row.name, row.flushes)
    if row.dtype is not None:
        assert frame.values.dtype == row.dtype
        assert np.array_equal(frame.values.ravel(), numbers)
        assert frame.values.shape == ((6,) if row.width == 1 else (6 // row.width, row.width))


@pytest.mark.parametrize("name", list(SOURCES))
def test_source_gives_a_named_number_of_the_kind_of_the_table(name) -> None:
    frames = AUFrames(np.arange(3) / 25, np.zeros((3, len(axis())), np.float32))
    rows = SOURCES[name].rows(frames, standard(), False)
    assert rows.shape == (3, len(SOURCES[name].names()))
    message, size = pack_frames(name, 0, frames.times, rows)
    assert unpack(message[:size]).values.shape == rows[0].shape
