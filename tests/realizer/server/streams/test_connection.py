"""Tests of the limits of a connection."""

from __future__ import annotations

import pytest

from tests.realizer.server.conftest import Driver


@pytest.mark.parametrize(("unsent", "closes"), [(32 * 2**20, False), (32 * 2**20 + 1, True)])
def test_connection_closes_with_more_than_32_mib_unsent(driver: Driver, unsent: int, closes: bool) -> None:
    driver.session.update_backlog(1, unsent)
    driver.collect()
    assert bool(driver.closed) is closes
