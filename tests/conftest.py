"""Fixtures and settings that all tests share."""

from __future__ import annotations

import os

import pytest
from hypothesis import HealthCheck, settings

# The same examples each run, so that a failure is a change; `HYPOTHESIS_PROFILE=thorough` looks for new ones.
settings.register_profile(
    "default", derandomize=True, deadline=None, max_examples=60, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("thorough", deadline=None, max_examples=2000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "default"))


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden", action="store_true", help="write tests/golden anew, then review the diff"
    )
    parser.addoption("--documents", type=int, help="how many random documents test_grammar plays")
    parser.addoption("--mutants", type=int, default=10_000, help="how many broken documents test_fuzz reads")
    parser.addoption("--seed", type=int, default=0, help="of the mutants of test_fuzz")
