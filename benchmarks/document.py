"""Measures the time of a document in a live session: `python benchmarks/document.py` prints its parts.

Each document is a block of linked behaviours (nod, shake, smile, brows, gaze, emotion) that replaces the
previous block:

    read      text -> Block
    plan      Block -> Schedule: checks, preferred timings, solution
    expand    behaviours -> channels
    add       the plan -> channels, events and predictions on the session clock
    feedback  all feedback of the block, as numbered text
    total     all of these
    longest   the longest step that cannot be interrupted: read, or plan to add

The program prints medians over many documents of one session in milliseconds, and the least total. `noise` is
how much longer than its median the slowest 5 % of a fixed piece of work take between the documents. `growth`
is the exponent of the time in the number of behaviours, from 6 to 60: 1 is linear.
"""

from __future__ import annotations

import gc
import math
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from stopwatch import handle_help

from bml_schema import Block, read
from realizer.behaviours.registry import KINDS, VOCABULARY
from realizer.core.options import PlayOptions
from realizer.playback.block_planner import plan
from realizer.playback.player import Player
from realizer.server.session.connections import FeedbackLog

COUNTS = (1, 6, 20, 60)
PARTS = ("read", "plan", "expand", "add", "feedback", "total", "longest")
REPEATS = 200
SCENE = {"cup": (0.2, -0.1, 0.5)}


def document(id: str, count: int) -> str:
    """Return a block of `count` behaviours in consecutive groups of six."""
    parts = []
    for n in range(count):
        k = n // 6
        begin = f"e{k - 1}:end + 0.5" if k else "0.5"
        parts.append(
            (
                f'<head id="n{k}" lexeme="NOD" start="{begin}"/>',
                f'<head id="m{k}" lexeme="SHAKE" start="n{k}:end + 2"/>',
                f'<faceLexeme id="f{k}" lexeme="SMILE" start="n{k}:start - 0.3" end="n{k}:start + 5.5"/>',
                f'<faceLexeme id="w{k}" lexeme="RAISE_BROWS" start="n{k}:stroke" end="n{k}:end + 1"/>',
                f'<gaze id="g{k}" target="cup" start="n{k}:start + 0.5" end="n{k}:start + 2.5"/>',
                f'<realizer:emotion id="e{k}" name="joy" start="m{k}:start" end="m{k}:end + 1"/>',
            )[n % 6]
        )
    start = f'<bml id="{id}" composition="REPLACE" xmlns:realizer="urn:bml-realizer:1">'
    return f"{start}{''.join(parts)}</bml>"


class Costs:
    """Milliseconds of each part of each document."""

    def __init__(self) -> None:
        self.spent: dict[str, list[float]] = {}

    @contextmanager
    def of(self, part: str) -> Iterator[None]:
        """Measure the time of the statements within `with`."""
        begin_time = time.perf_counter()
        yield
        self.spent.setdefault(part, []).append(1e3 * (time.perf_counter() - begin_time))

    def combine(self, part: str, of: Callable[..., float], *parts: str) -> None:
        """Compute the values of a part from those of others."""
        self.spent[part] = [of(*row) for row in zip(*(self.spent[p] for p in parts), strict=True)]

    def median(self, part: str) -> float:
        return statistics.median(self.spent[part])


def play(count: int) -> tuple[Costs, int]:
    """Return the times of documents of a size, and the number of feedback messages of one document."""
    player, log, costs = Player(PlayOptions(scene=SCENE)), FeedbackLog(epoch=1e9), Costs()
    now, message_count = 0.0, 0
    gc.collect()
    gc.disable()  # as in a service, which does not collect garbage while it plans
    for number in range(REPEATS + 10):
        if number == 10:
            costs.spent.clear()  # the first documents load tables
        text = document(f"b{number}", count)
        with costs.of("read"):
            (block,) = read(text, VOCABULARY)
        assert isinstance(block, Block)
        with costs.of("planning"):
            planned = plan(block, KINDS, player.context, start=now)
        times = planned.schedule.times
        if len(times) != count:
            raise SystemExit(f"the benchmark's own document is wrong: {planned.schedule.warnings}")
        with costs.of("expand"):
            for node in block.behaviours:
                KINDS[node.tag].expand(node, times[node.id], player.context)
        with costs.of("submit"):
            player.submit(block, now)
        before = log.newest
        with costs.of("feedback"):
            while True:
                messages = player.due(now)
                for message in messages:
                    log.add(message, now)
                if messages:
                    log.since(log.newest - len(messages) + 1)
                elif (due := player.next_deadline()) is None:
                    break
                else:
                    now = due
        message_count = log.newest - before
        now += 3.0
        with costs.of("noise"):
            sum(map(math.sqrt, range(10_000)))
    gc.enable()
    costs.combine("total", lambda *parts: sum(parts), "read", "submit", "feedback")
    costs.combine("add", lambda submit, planning: submit - planning, "submit", "planning")
    costs.combine("plan", lambda planning, expand: planning - expand, "planning", "expand")
    costs.combine("longest", max, "read", "submit")
    return costs, message_count


def main() -> None:
    handle_help(__doc__)
    print("".join((f"{'behaviours':>10}", *(f"{part:>10}" for part in PARTS), "     least  messages  noise")))
    medians: dict[int, dict[str, float]] = {}
    for count in COUNTS:
        costs, message_count = play(count)
        medians[count] = {part: costs.median(part) for part in PARTS}
        slowest = statistics.quantiles(costs.spent["noise"], n=20)[-1] / costs.median("noise")
        row = "".join(f"{medians[count][part]:>10.3f}" for part in PARTS)
        print(f"{count:>10}{row}{min(costs.spent['total']):>10.3f}{message_count:>10}{slowest - 1:>7.0%}")
    growth = {part: math.log10(medians[60][part] / medians[6][part]) for part in PARTS}
    print(f"{'growth':>10}{''.join(f'{growth[part]:>10.2f}' for part in PARTS)}")


if __name__ == "__main__":
    main()
