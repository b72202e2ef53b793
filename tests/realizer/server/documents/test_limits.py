"""Checks of limits: their error texts name the limit and its setting."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from bml_schema import Block, parse
from realizer import schedule
from realizer.behaviours.registry import VOCABULARY
from realizer.core.settings import Settings
from realizer.scheduling.timing import Schedule
from realizer.server.documents import limits
from realizer.server.documents.limits import (
    duration_error,
    memory_error,
    pixel_rate_error,
)

SPEECH = '<bml id="b"><speech id="s"><text>{}</text></speech></bml>'


def block(text: str) -> Block:
    return parse(text, VOCABULARY)


def test_duration_error_refuses_a_block_that_lasts_too_long() -> None:
    minute = '<bml id="b"><wait id="w" duration="60.5"/></bml>'
    assert duration_error(block(minute), schedule(minute), Settings(max_duration=61)) is None
    words = duration_error(block(minute), schedule(minute), Settings(max_duration=60))
    assert words == "wanted a block of at most 60 s, got 60.5 (REALIZER_MAX_DURATION sets it)"


@pytest.mark.parametrize("point", ["anticipators:clock:beat", "turn:turn:end"])
def test_duration_error_ignores_points_of_others(point: str) -> None:
    tied = f'<bml id="b"><wait id="w" start="0" end="{point}"/></bml>'
    late = Schedule("b", {"w": ("start", "end")}, {"w": np.array([0.0, 1e6])})
    assert duration_error(block(tied), late, Settings()) is None


def test_duration_error_accepts_the_longest_speech() -> None:
    settings = Settings()
    text = SPEECH.format("Hello there. " * (settings.max_speech // 13))
    assert duration_error(block(text), schedule(text, voice="silent"), settings) is None


def test_memory_error_works_with_and_without_proc(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    few, many = Settings(max_memory=64), Settings(max_memory=10**7)
    for file in (limits.MEMORY, tmp_path / "none"):
        monkeypatch.setattr(limits, "MEMORY", file)
        assert memory_error(many) is None
        assert memory_error(Settings()) is None
        assert "wanted at most 64 (REALIZER_MAX_MEMORY sets it)" in str(memory_error(few))


def test_pixel_rate_error_allows_large_pictures_at_a_low_rate() -> None:
    settings = Settings(max_pixels=1e6)
    assert pixel_rate_error((200, 200), 25.0, settings) is None
    words = pixel_rate_error((201, 200), 25.0, settings)
    assert words is not None
    assert "201x200 at 25 fps (REALIZER_MAX_PIXELS sets it)" in words
    assert pixel_rate_error((100, 100), 25.0, settings, 750_000) is None
    assert "beside 750001 of others" in str(pixel_rate_error((100, 100), 25.0, settings, 750_001))


def test_limits_have_different_descriptions_in_the_settings() -> None:
    descriptions = {f.name: f.metadata["description"] for f in fields(Settings) if f.name.startswith("max_")}
    assert len(descriptions) == len(set(descriptions.values())) == 15
