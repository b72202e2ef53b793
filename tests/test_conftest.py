"""How the tests themselves are run."""

from __future__ import annotations

import os

import pytest


@pytest.mark.skipif("PYTEST_XDIST_WORKER" not in os.environ, reason="needs pytest -n 2 --dist loadgroup")
@pytest.mark.xdist_group("one")
def test_groups_of_tests_reach_one_worker(request: pytest.FixtureRequest) -> None:
    """A pytest that pytest-xdist does not know runs tests of a group beside each other, and they time out."""
    assert request.config.getoption("loadgroup")
    assert request.node.nodeid.endswith("@one")
