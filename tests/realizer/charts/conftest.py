"""Documents played without a clock and without a voice, as the data of charts."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from realizer.charts.chart_data import lines_of
from realizer.charts.timeline import BlockLine
from realizer.pipeline import play
from realizer.playback.player import Player


@pytest.fixture
def lines() -> Callable[..., list[BlockLine]]:
    def of(*documents: str) -> list[BlockLine]:
        player = Player(idle=False)
        schedules, _ = play(documents, player, "silent")
        return lines_of(player.cast, schedules)

    return of
