"""Tests of scene files."""

from __future__ import annotations

import pytest

from realizer.playback.scene_file import parse_scene


def test_parse_scene_reads_lines_or_json() -> None:
    scene = {"cup": (0.1, -0.2, 0.5)}
    assert parse_scene("# what she sees\ncup 0.1 -0.2 0.5\n") == scene
    assert parse_scene('{"cup": [0.1, -0.2, 0.5]}') == scene
    with pytest.raises(ValueError, match="cup: wanted three numbers"):
        parse_scene("cup 1 2")


def test_parse_scene_reads_named_axes() -> None:
    assert parse_scene('{"cup": {"x": 1, "y": 2, "z": 3}}') == {"cup": (1.0, 2.0, 3.0)}
    assert parse_scene("cup 1, 2, 3") == {"cup": (1.0, 2.0, 3.0)}


@pytest.mark.parametrize("number", ["10001", "nan", "-inf"])
def test_parse_scene_refuses_positions_beyond_10_km(number: str) -> None:
    with pytest.raises(ValueError, match="cup: wanted metres within 10 km, got"):
        parse_scene(f"cup 0 {number} 0")
