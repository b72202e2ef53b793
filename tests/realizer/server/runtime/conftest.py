"""A fixture of tests that count cycles."""

from __future__ import annotations

import gc
from collections.abc import Iterator

import pytest


@pytest.fixture
def no_automatic_gc() -> Iterator[None]:
    """Python looks for no cycles while a test counts them."""
    was = gc.isenabled()
    gc.collect()
    gc.disable()
    yield
    if was:
        gc.enable()
