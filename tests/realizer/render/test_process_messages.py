"""Tests of the shared memory and the pipes of the drawing process."""

from __future__ import annotations

import os

import numpy as np
import pytest

from realizer.render.process_messages import Failed, Pixels, connection


@pytest.mark.parametrize("channels", [3, 4])
def test_pixels_are_seen_by_all_that_map_them(channels: int) -> None:
    with Pixels.create(2, (5, 4), channels) as file:
        one, other = (Pixels(file.fileno(), 2, (5, 4), channels) for _ in range(2))
        status = os.fstat(file.fileno())
    assert (status.st_size, status.st_nlink) == (2 * 4 * 5 * channels, 0)
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
