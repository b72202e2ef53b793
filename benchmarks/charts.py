"""Measures the time of timelines: `python benchmarks/charts.py` prints medians in milliseconds.

A block's data and JSON are made when it is planned or moved, while others play. A quiet tick is the time of
the stream `schedule` in a tick without changes. On 2 shared cores:

    blocks alive     quiet tick   whole state
         5             0.01          0.8
       100             0.2          30

    behaviours    data + JSON     layout      SVG      PNG
         5             0.4          1.2        1.3     250
        40             3           11          8      1900
       400            44          104        102      4000
"""

from __future__ import annotations

import json

from stopwatch import handle_help, median, noise

from realizer.charts.chart_data import charts_of
from realizer.charts.picture import timeline
from realizer.charts.svg import svg
from realizer.charts.write_chart import png
from realizer.core.options import PlayOptions
from realizer.pipeline import plan
from realizer.playback.player import Player
from realizer.server.streams.schedule_stream import ScheduleStream


def faces(count: int) -> str:
    body = "".join(
        f'<faceLexeme id="f{i}" lexeme="SMILE" start="{i * 0.05:.2f}" end="{i * 0.05 + 2:.2f}"/>'
        for i in range(count)
    )
    return f'<bml id="b">{body}</bml>'


def stream(count: int) -> None:
    player = Player(PlayOptions(idle=False))
    plan([f'<bml id="b{i}"><head id="n" lexeme="NOD" start="1"/></bml>' for i in range(count)], player)
    known = ScheduleStream(player.blocks)
    known.changes()
    quiet = median(known.has_changes, 30)
    whole = median(lambda: ScheduleStream(player.blocks).changes(), 5)
    print(f"{count:6} blocks alive   quiet tick {quiet:8.3f}   whole state {whole:8.1f}")


def picture(count: int) -> None:
    player = Player(PlayOptions(idle=False))
    schedules, _ = plan([faces(count)], player)
    blocks = charts_of(player.blocks, schedules)
    drawn = timeline(blocks)
    few = 20 if count < 100 else 3
    data = median(lambda: json.dumps(charts_of(player.blocks, schedules)[0].to_json()), few)
    layout = median(lambda: timeline(blocks), few)
    text = median(lambda: svg(drawn), few)
    pixels = median(lambda: png(drawn), 1)
    print(
        f"{count:6} behaviours   data + JSON {data:8.2f}   layout {layout:8.1f}   SVG {text:8.1f}"
        f"   PNG {pixels:8.0f}"
    )


def main() -> None:
    handle_help(__doc__)
    print(noise())
    for blocks_alive in (5, 100):
        stream(blocks_alive)
    for behaviours in (5, 40, 400):
        picture(behaviours)


if __name__ == "__main__":
    main()
