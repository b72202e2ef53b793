"""Documents played without a clock and without a voice, as the data of charts."""

from collections.abc import Callable

import pytest

from realizer.charts.chart_data import charts_of
from realizer.charts.timeline import BlockChart
from realizer.core.options import PlayOptions
from realizer.pipeline import plan
from realizer.playback.player import Player


@pytest.fixture
def lines() -> Callable[..., list[BlockChart]]:
    def of(*documents: str) -> list[BlockChart]:
        player = Player(PlayOptions(idle=False))
        schedules, _ = plan(documents, player, "silent")
        return charts_of(player.blocks, schedules)

    return of
