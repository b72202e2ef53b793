"""Tests of the check of what this machine can draw with."""

from __future__ import annotations

import pytest

from realizer.render.drawing_process import available_backend, unavailable_reason


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
