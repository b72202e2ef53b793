"""Similar names, for messages about unknown ones."""

from __future__ import annotations

import pytest

from realizer.core.similar import did_you_mean, similar

MOODS = ("happy", "sad", "surprised", "sadly")


@pytest.mark.parametrize(
    ("name", "found"),
    [("hapy", ["happy"]), ("sady", ["sadly", "sad"]), ("surfing", ["surprised"]), ("xyz", []), ("su", [])],
)
def test_similar_returns_the_nearest_or_what_begins_alike(name: str, found: list[str]) -> None:
    assert similar(name, MOODS) == found


def test_similar_returns_at_most_what_is_asked() -> None:
    assert similar("sady", MOODS, 1) == ["sadly"]
    assert similar("surfing", MOODS, cutoff=0.85) == [], "what only begins alike is not so similar"


def test_similar_compares_the_beginning_of_very_long_names() -> None:
    assert similar("x" * 100_000, [*MOODS, "x" * 99]) == ["x" * 99]


def test_did_you_mean_lists_names_or_is_empty() -> None:
    assert did_you_mean(["a", "b"]) == ", did you mean a or b?"
    assert did_you_mean([]) == ""
