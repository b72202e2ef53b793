"""What a document costs a live session: `python tests/benchmarks/document.py` prints it part by part.

Blocks of cross-linked behaviours (nod, shake, smile, brows, gaze, emotion), each replacing the one before:

    read      text -> Block
    plan      Block -> Schedule: what its behaviours have against them and want of time, solved
    expand    its behaviours -> channels
    take in   the plan laid on the session clock: channels, events, predictions
    feedback  all that is told of it until it has ended, each message as numbered text
    together  all of these
    stretch   the longest of what nobody can interrupt: reading, or planning to taking in

Medians over many documents of a session that goes on, in milliseconds; then the least of `couple_lips`, which
other work on the machine disturbs less. `noise` is how much longer than usual the slowest twentieth took of
the runs of one piece of work that does nothing else, between the documents. `growth` is the exponent of the
time in the number of behaviours, from 6 to 60: 1 is linear. Measures only; nothing asserts a time.
"""

from __future__ import annotations

import gc
import math
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from stopwatch import helped

from bml_schema import Block, read
from realizer.behaviours.registry import KINDS, VOCABULARY
from realizer.core.options import PlayOptions
from realizer.playback.block_planner import plan
from realizer.playback.player import Player
from realizer.server.session.feedback_log import FeedbackLog

COUNTS = (1, 6, 20, 60)
PARTS = ("read", "plan", "expand", "take in", "feedback", "together", "stretch")
REPEATS = 200
SCENE = {"cup": (0.2, -0.1, 0.5)}


def document(id: str, count: int) -> str:
    """A block of so many behaviours, in groups of six that follow each other."""
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
    """Milliseconds of each part, a number a document."""

    def __init__(self) -> None:
        self.spent: dict[str, list[float]] = {}

    @contextmanager
    def of(self, part: str) -> Iterator[None]:
        """Measure what is done within."""
        began = time.perf_counter()
        yield
        self.spent.setdefault(part, []).append(1e3 * (time.perf_counter() - began))

    def combine(self, part: str, of: Callable[..., float], *parts: str) -> None:
        """A part that is made of others."""
        self.spent[part] = [of(*row) for row in zip(*(self.spent[p] for p in parts), strict=True)]

    def median(self, part: str) -> float:
        return statistics.median(self.spent[part])


def play(count: int) -> tuple[Costs, int]:
    """What documents of a size cost, and how many messages tell of one."""
    player, log, costs = Player(PlayOptions(scene=SCENE)), FeedbackLog(epoch=1e9), Costs()
    now, told = 0.0, 0
    gc.collect()
    gc.disable()  # a service looks for cycles seldom, and not while it plans
    for number in range(REPEATS + 10):
        if number == 10:
            costs.spent.clear()  # now tables are read
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
        told = log.newest - before
        now += 3.0
        with costs.of("noise"):
            sum(map(math.sqrt, range(10_000)))
    gc.enable()
    costs.combine("together", lambda *parts: sum(parts), "read", "submit", "feedback")
    costs.combine("take in", lambda submit, planning: submit - planning, "submit", "planning")
    costs.combine("plan", lambda planning, expand: planning - expand, "planning", "expand")
    costs.combine("stretch", max, "read", "submit")
    return costs, told


def main() -> None:
    helped(__doc__)
    print("".join((f"{'behaviours':>10}", *(f"{part:>10}" for part in PARTS), "     least  messages  noise")))
    medians: dict[int, dict[str, float]] = {}
    for count in COUNTS:
        costs, told = play(count)
        medians[count] = {part: costs.median(part) for part in PARTS}
        slowest = statistics.quantiles(costs.spent["noise"], n=20)[-1] / costs.median("noise")
        row = "".join(f"{medians[count][part]:>10.3f}" for part in PARTS)
        print(f"{count:>10}{row}{min(costs.spent['together']):>10.3f}{told:>10}{slowest - 1:>7.0%}")
    growth = {part: math.log10(medians[60][part] / medians[6][part]) for part in PARTS}
    print(f"{'growth':>10}{''.join(f'{growth[part]:>10.2f}' for part in PARTS)}")


if __name__ == "__main__":
    main()
