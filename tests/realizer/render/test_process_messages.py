"""Tests of the shared memory and the pipes of the drawing process."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from realizer.render.process_messages import Failed, Pixels, connection


@pytest.mark.parametrize("channels", [3, 4])
def test_pixels_are_seen_by_all_that_map_them(channels: int) -> None:
    path = Pixels.create(2, (5, 4), channels)
    try:
        one, other = (Pixels(path, 2, (5, 4), channels) for _ in range(2))
        assert Path(path).stat().st_size == 2 * 4 * 5 * channels
    finally:
        Path(path).unlink()
    one.array[1, 3, 4] = 7
    assert one.array.shape == (2, 4, 5, channels)
    assert np.array_equal(other.array, one.array)


def test_a_connection_carries_messages_over_its_own_descriptors() -> None:
    ends = os.pipe()
    orders, answers = connection(ends[0], writes=False), connection(ends[1], writes=True)
    for end in ends:
        os.close(end)
    with orders, answers:
        answers.send(Failed("no"))
        assert orders.recv() == Failed("no")
