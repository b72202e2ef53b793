"""Tests of the check of what this machine can draw with."""

from __future__ import annotations

import os

import numpy as np
import pytest

from realizer.render.drawing_process import Failed, Pixels, available_backend, connection, unavailable_reason


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


@pytest.mark.slow
def test_available_names_the_backend_or_what_to_install():
    way, fix = available_backend()
    assert (way in ("gl", "onboard")) != (way == "")
    assert (fix is None) == (way != "")
    assert unavailable_reason() == fix


@pytest.mark.gl("onboard")
def test_available_backend_is_the_requested_one():
    assert available_backend("onboard") == ("onboard", None)


def test_available_lists_the_known_backends():
    assert unavailable_reason("vulkan") == "drawing: wanted one of auto, gl, onboard, got 'vulkan'"


@pytest.mark.gl("onboard")
@pytest.mark.slow
def test_available_backend_reads_the_variable(monkeypatch):
    monkeypatch.setenv("REALIZER_DRAW", "onboard")
    available_backend.cache_clear()
    assert available_backend()[0] == "onboard"
    available_backend.cache_clear()
