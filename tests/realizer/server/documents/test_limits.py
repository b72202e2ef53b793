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
    MAX_CHARACTERS,
    block_limit_error,
    duration_error,
    memory_error,
    pixel_rate_error,
    size_error,
)

ONE = '<bml id="b"><speech id="s"><text>{}</text></speech></bml>'
SSML = (
    '<bml id="b"><speech id="s"><text>Oh</text>'
    '<description priority="1" type="application/ssml+xml"><speak>{}</speak></description></speech></bml>'
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


def test_size_error_counts_bytes_and_elements() -> None:
    text = '<bml id="b"><!-- é --><wait id="w"/></bml>'
    size = len(text.encode())
    assert size_error(text, Settings(max_document=size, max_elements=3)) is None  # a comment counts
    words = size_error(text, Settings(max_document=size - 1))
    assert words == (
        f"wanted at most {size - 1} bytes of BML in a message, got {size} (REALIZER_MAX_DOCUMENT sets it)"
    )
    words = size_error(text, Settings(max_elements=2))
    assert words == "wanted at most 2 elements in a message, got 3 (REALIZER_MAX_ELEMENTS sets it)"


@pytest.mark.parametrize(
    ("most", "text", "busy", "says"),
    [
        (
            {"max_speech": 20},
            ONE.format("Hello " * 4),
            0,
            "at most 20 characters in one speech, got 24",
        ),
        ({"max_speech": 60}, SSML.format("Hello " * 20), 0, "at most 60 characters in one speech"),
        ({"max_blocks": 2}, '<bml id="b"/>', 2, "2 blocks play or wait: wanted fewer at a time"),
    ],
)
def test_block_limit_error_names_the_limit_and_its_setting(
    most: dict[str, int], text: str, busy: int, says: str
) -> None:
    words = block_limit_error(block(text), Settings(**most), busy, ())
    assert words is not None
    assert says in words
    (name,) = most
    assert words.endswith(f"(REALIZER_{name.upper()} sets it)")
    assert block_limit_error(block(text), Settings(), busy, ()) is None


def test_block_limit_error_bounds_the_number_of_characters() -> None:
    crowd = [f"c{k}" for k in range(MAX_CHARACTERS)]
    known, new = (block(f'<bml id="b" characterId="{name}"/>') for name in ("c3", "another"))
    assert block_limit_error(new, Settings(), 0, crowd[:-1]) is None
    assert block_limit_error(known, Settings(), 0, crowd) is None
    assert (
        block_limit_error(new, Settings(), 0, crowd)
        == f"wanted at most {MAX_CHARACTERS} characters in a session"
    )
