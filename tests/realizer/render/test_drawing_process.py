"""What drawing is like on this machine, asked of a new process."""

from __future__ import annotations

import pytest

from realizer.render.drawing_process import available, available_backend


def test_whoever_asks_is_told_the_way_or_what_to_install():
    way, fix = available_backend()
    assert (way in ("gl", "onboard")) != (way == "")
    assert (fix is None) == (way != "")
    assert available() == fix


@pytest.mark.gl("onboard")
def test_the_way_that_was_asked_for_is_the_one_that_is_told():
    assert available_backend("onboard") == ("onboard", None)


def test_another_way_is_told_with_the_known_ones():
    assert available("vulkan") == "drawing: wanted one of auto, gl, onboard, got 'vulkan'"


@pytest.mark.gl("onboard")
def test_a_variable_names_the_way(monkeypatch):
    monkeypatch.setenv("REALIZER_DRAW", "onboard")
    available_backend.cache_clear()
    assert available_backend()[0] == "onboard"
    available_backend.cache_clear()
