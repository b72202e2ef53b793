"""Measures the time of frames: `python benchmarks/compile.py [--chart PATH]` prints milliseconds.

A live session computes frames ahead of time. Here these are 10 s at 25 frames a second of a block of nods,
expressions, gazes and brows with idle motion, as integers of FAPs. The steps are: collect the channels, blend
them, apply the rules of co-occurrence, convert to FAPs. Further rows show the growth with the number of
behaviours and with the length, and the time during speech and after an interrupt.

The program prints medians, minima, and the noise of the machine.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path
from typing import NamedTuple

os.environ.update({"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"})

import numpy as np
from plot import bars, exponent
from stopwatch import noise

from realizer.animation.blend import blend
from realizer.animation.fap.conversion import to_fap
from realizer.charts.diverging_scale import FAINT, INK, PAPER
from realizer.charts.shapes import Box, Picture, Text
from realizer.charts.write_chart import writer_for
from realizer.core.array_types import Float64
from realizer.core.options import PlayOptions
from realizer.pipeline import plan
from realizer.playback.player import Player

FPS = 25
SECONDS = 10.0
REPEATS = 300
STEPS = ("channels", "blend", "rules", "FAPs")
COLOURS = ("#9aa0aa", "#2156a0", "#7c6bb0", "#0f766e")
TARGETS = {6: 1.0, 20: 2.0}  # ms

KINDS = (
    '<head id="b{k}" lexeme="NOD" start="{at}"/>',
    '<faceLexeme id="b{k}" lexeme="SMILE" start="{at}" end="{end}"/>',
    '<gaze id="b{k}" target="cup" start="{at}" end="{end}"/>',
    '<faceLexeme id="b{k}" lexeme="RAISE_BROWS" start="{at}" end="{end}"/>',
)
SPEECH = (
    '<speech id="s"><text>Well, this is a rather long sentence with <sync id="m"/> a mark in it, and then it '
    'goes on for some time.</text></speech><head id="n" lexeme="NOD" stroke="s:m"/>'
)


class Times(NamedTuple):
    """(runs, steps) milliseconds."""

    steps: Float64

    @property
    def median(self) -> Float64:
        middle: Float64 = np.median(self.steps, axis=0)
        return middle

    @property
    def whole(self) -> float:
        return float(np.median(self.steps.sum(axis=1)))

    @property
    def least(self) -> float:
        return float(self.steps.sum(axis=1).min())


def block(count: int, seconds: float = SECONDS) -> str:
    """Return a block of `count` behaviours of 1.5 s that begin one after the other."""
    starts = [0.9 * seconds * k / count for k in range(count)]
    body = "".join(
        KINDS[k % 4].format(k=k, at=f"{at:.2f}", end=f"{at + 1.5:.2f}") for k, at in enumerate(starts)
    )
    return f'<bml id="b">{body}</bml>'


def player(text: str) -> Player:
    made = Player(PlayOptions(scene={"cup": (0.2, -0.1, 0.5)}))
    plan([text], made, "silent")
    return made


def measure(one: Player, seconds: float = SECONDS, repeats: int = REPEATS) -> Times:
    """Measure windows that begin at different times, as those of many sessions do."""
    runs = []
    for k in range(repeats + 10):
        times = np.arange(int(seconds * FPS)) / FPS + k * 0.7 / repeats
        at = [time.perf_counter()]
        channels, idle = one.motion(times)
        at.append(time.perf_counter())
        frames = blend(channels, times, one.rules, idle)
        at.append(time.perf_counter())
        _ = frames.moving
        at.append(time.perf_counter())
        to_fap(frames).integers()
        at.append(time.perf_counter())
        runs.append(np.diff(at) * 1e3)
    return Times(np.array(runs[10:]))


def chart(rows: dict[int, Times]) -> Picture:
    """Draw a bar for each number of behaviours, divided into the steps."""
    left, scale, high = 120.0, 480.0 / max(spent.whole for spent in rows.values()), 34.0
    title = f"{SECONDS:g} s of frames: milliseconds by step"
    picture = Picture(left + 580.0, 92.0 + high * len(rows), title, PAPER)
    picture.add(Text(20.0, 28.0, title, 14.0, INK))
    for k, (step, colour) in enumerate(zip(STEPS, COLOURS, strict=True)):
        x = left + 110.0 * k
        picture.add(Box(x, 44.0, 12.0, 12.0, colour), Text(x + 18.0, 54.0, step, 12.0, INK))
    for n, (count, spent) in enumerate(rows.items()):
        top, at = 72.0 + high * n, left
        picture.add(Text(left - 12.0, top + 16.0, f"{count} behaviours", 12.0, FAINT, "end"))
        for value, colour in zip(spent.median.tolist(), COLOURS, strict=True):
            picture.add(Box(at, top, value * scale, 22.0, colour))
            at += value * scale
        picture.add(Text(at + 8.0, top + 16.0, f"{spent.whole:.2f}", 12.0, INK))
    return picture


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--chart", metavar="PATH", help="also as a picture: .svg or .png")
    path = parser.parse_args().chart
    writer = writer_for(path) if path else None

    print(f"{noise()}\n")
    print(f"{'':24}" + "".join(f"{step:>10}" for step in STEPS) + f"{'all':>10}{'least':>10}{'wanted':>10}")

    def row(name: str, spent: Times, wanted: float | None = None) -> Times:
        limit = "" if wanted is None else f"< {wanted:g}"
        cells = "".join(f"{value:10.3f}" for value in (*spent.median, spent.whole, spent.least))
        print(f"{name:24}{cells}{limit:>10}")
        return spent

    rows = {n: row(f"{n} behaviours", measure(player(block(n))), TARGETS.get(n)) for n in (1, 6, 20, 60)}
    speaker = player(f'<bml id="b">{SPEECH}</bml>')
    row("a sentence and a nod", measure(speaker))
    speaker.stop(1.0)
    row("stopped after 1 s", measure(speaker))
    one = player(block(6, 60.0))
    lengths = {s: row(f"6, in all {s:g} s", measure(one, s)) for s in (1.0, 4.0, 10.0, 30.0)}
    a, b = lengths[1.0], lengths[30.0]
    print(f"\na frame more: {1e3 * (b.whole - a.whole) / (29 * FPS):.2f} microseconds")
    for name, found in (("behaviours", rows), ("seconds", lengths)):
        sizes, values = list(found), [spent.whole for spent in found.values()]
        print(f"\nms, grows as {name} ^ {exponent(sizes, values):.2f}")
        print(bars(sizes, values))
    if writer:
        Path(path).write_bytes(writer(chart(rows)))


if __name__ == "__main__":
    main()
