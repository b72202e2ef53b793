"""Fixtures and settings that all tests share."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Iterator
from functools import cache
from typing import Any

import pytest
from hypothesis import HealthCheck, Phase, settings

# Tests run beside each other: one thread of linear algebra each. numpy reads it once, when it is loaded.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# The same examples each run, so that a failure is a change; `HYPOTHESIS_PROFILE=thorough` looks for new ones.
# Shrinking a failing example can take minutes, so it is left to `HYPOTHESIS_PROFILE=small`, which tries more.
settings.register_profile(
    "small", derandomize=True, deadline=None, max_examples=40, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile(
    "default",
    settings.get_profile("small"),
    max_examples=25,
    phases=[Phase.explicit, Phase.reuse, Phase.generate],
)
settings.register_profile("thorough", deadline=None, max_examples=2000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "default"))


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-golden", action="store_true", help="write tests/golden anew, then review the diff"
    )
    parser.addoption("--documents", type=int, help="how many random documents test_grammar plays (125)")
    parser.addoption("--mutants", type=int, default=300, help="how many broken documents test_fuzz reads")
    parser.addoption(
        "--sessions", type=int, default=100, help="how many random sessions test_composition plays"
    )
    parser.addoption(
        "--pipecat", action="store_true", help="install Pipecat for tests/examples/test_pipecat.py"
    )
    parser.addoption("--seed", type=int, default=0, help="of the mutants of test_fuzz")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Run all tests that draw in one process of pytest-xdist: each would find out anew what it can draw with.

    CI finds modules with slow tests by a word, so that thousands of other tests are not collected again.
    """
    found = cache(
        lambda path: re.search(r"/browser/|\b(slow|shipped)\b", f"{path}\n{path.read_text('utf-8')}")
    )
    for item in items:
        if item.get_closest_marker("slow") and not found(item.path):
            raise pytest.UsageError(
                f"{item.path}: wanted the word slow or shipped, by which .ci/run finds it"
            )
        if item.get_closest_marker("gl") and not item.get_closest_marker("xdist_group"):
            item.add_marker(pytest.mark.xdist_group("render"))


@pytest.fixture(autouse=True)
def log_levels() -> Iterator[None]:
    """Restore the levels of the loggers that commands set, so that no test depends on the one before."""
    loggers = [logging.getLogger(name) for name in (None, "realizer", "realizer.outputs")]
    before = [logger.level for logger in loggers]
    yield
    for logger, level in zip(loggers, before, strict=True):
        logger.setLevel(level)


@pytest.fixture(autouse=True)
def _skip_without_gl(request: pytest.FixtureRequest) -> None:
    if not (mark := request.node.get_closest_marker("gl")):
        return
    from realizer.render.drawing_process import unavailable_reason

    if missing := unavailable_reason(*mark.args):
        assert not re.match(r"\w*Error: ", missing), missing  # it lies with the project, not with the machine
        pytest.skip(missing)


@pytest.fixture(scope="session")
def balls() -> tuple[Any, Any]:
    """A head of three balls, and its normals, as `tests.balls` has it."""
    from tests.balls import face_of_balls

    return face_of_balls()
