"""How many examples hypothesis tries."""

from __future__ import annotations

from hypothesis import settings

__all__ = ["examples"]


def examples(factor: float) -> settings:
    """Return the settings of a test that needs so many times as many examples as the profile has."""
    return settings(max_examples=round(factor * settings().max_examples))
