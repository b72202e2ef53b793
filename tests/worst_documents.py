"""Documents that cost much: kinds of behaviours, timed in ways that conflict, overlap, wait or squeeze.

`python -m tests.worst_documents [PATTERN ...] [--size N] [--kind KIND]` prints what the schedule of each
costs at a size and at twice that size, in calls and in processor time. `--search SECONDS` makes documents at
random instead, and prints each that costs more than those before it.
"""

from __future__ import annotations

import argparse
import contextvars
import random
import sys
import time
from collections.abc import Callable
from types import FrameType
from typing import Any

from bml_schema.steps import on_element
from realizer import schedule
from realizer.core import work
from realizer.core.settings import Settings
from realizer.server.session.session import Session

HEADER = (
    '<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" xmlns:realizer="urn:bml-realizer:1"'
    ' xmlns:bmla="http://www.asap-project.org/bmla" id="worst">'
)

# Kind -> its tag, its other attributes, and its children.
KINDS = {
    "head": ("head", 'lexeme="NOD"', ""),
    "face": ("faceLexeme", 'lexeme="SMILE"', ""),
    "gaze": ("gaze", 'target="LEFT"', ""),
    "gaze shift": ("gazeShift", 'target="UP"', ""),
    "head shift": ("headDirectionShift", 'target="RIGHT"', ""),
    "emotion": ("realizer:emotion", 'name="joy"', ""),
    "mood": ("realizer:mood", 'name="joy"', ""),
    "faps": ("realizer:faps", "", '<realizer:fap number="3" value="100"/>'),
}
NAMES = list(KINDS)


def _linked(i: int, chance: random.Random) -> str:
    if i == 0:
        return ""
    start, end = (f"b{chance.randrange(i)}:{chance.choice(('start', 'end'))}" for _ in range(2))
    return f'start="{start}" end="{end}+3"'


def _later(i: int, chance: random.Random) -> str:
    """Refers to one that comes later, or to one that refers to it."""
    return f'start="b{i + 1 if i % 2 == 0 else i - 1}:end"'


# Pattern -> the timing of behaviour i.
PATTERNS: dict[str, Callable[[int, random.Random], str]] = {
    "free": lambda i, chance: "",
    "in a row": lambda i, chance: f'start="{i * 0.5:g}" end="{i * 0.5 + 0.5:g}"',
    "overlapping": lambda i, chance: f'start="{i * 0.01:.2f}" end="{100 + i * 0.01:.2f}"',
    "nested": lambda i, chance: f'start="{i * 0.01:.2f}" end="{500 - i * 0.01:.2f}"',
    "at once": lambda i, chance: f'start="0" end="1" bmla:priority="{chance.randrange(99)}"',
    "impossible": lambda i, chance: 'start="2" end="1"',
    "chained": lambda i, chance: f'start="b{i - 1}:end"' if i else "",
    "squeezed": lambda i, chance: f'start="b{i - 1}:end" end="{i * 0.2:.2f}"' if i else 'start="0" end="1"',
    "linked": _linked,
    "in circles": _later,
    "anywhere": lambda i, chance: f'start="{chance.uniform(0, 99):.2f}" end="{chance.uniform(0, 99):.2f}"',
}


def document(pattern: str, size: int, kind: str | None = None, seed: int = 0) -> str:
    """Return a document of so many behaviours of a kind, or of random kinds."""
    chance = random.Random(f"{pattern} {kind} {seed}")
    behaviours = []
    for i in range(size):
        tag, attributes, children = KINDS[kind or chance.choice(NAMES)]
        timing = PATTERNS[pattern](i, chance)
        behaviours.append(f'<{tag} id="b{i}" {attributes} {timing}>{children}</{tag}>')
    return f"{HEADER}{''.join(behaviours)}</bml>"


def mixed_document(size: int, seed: int) -> str:
    """Return a document of random kinds whose timings follow some of the patterns, chosen at random."""
    chance = random.Random(seed)
    patterns = chance.sample(list(PATTERNS), chance.randint(1, 4))
    behaviours = []
    for i in range(size):
        tag, attributes, children = KINDS[chance.choice(NAMES)]
        timing = PATTERNS[chance.choice(patterns)](i, chance)
        behaviours.append(f'<{tag} id="b{i}" {attributes} {timing}>{children}</{tag}>')
    return f"{HEADER}{''.join(behaviours)}</bml>"


def calls(function: Callable[[], Any]) -> int:
    """Return how many functions of Python and C are called: work that does not depend on the machine."""
    number = 0

    def count(frame: FrameType, event: str, value: object) -> None:
        nonlocal number
        number += event in ("call", "c_call")

    sys.setprofile(count)
    try:
        function()
    finally:
        sys.setprofile(None)
    return number


def growth(pattern: str, size: int, kind: str | None = None, seed: int = 0) -> tuple[int, float]:
    """Return the calls that a document costs, and how many times as many one of twice the size costs."""
    small, large = (calls(lambda n=n: schedule(document(pattern, n, kind, seed))) for n in (size, 2 * size))
    return small, large / small


class _Stretches:
    """A pauser that counts calls of functions between pauses.

    Attributes:
        longest: number of calls, and the function that was paused after them.
    """

    def __init__(self) -> None:
        self.longest = (0, "")
        self._calls = 0

    def count(self, frame: FrameType, event: str, value: object) -> None:
        self._calls += event in ("call", "c_call")

    def pause(self) -> None:
        """Note the calls since the last pause."""
        if self._calls > self.longest[0]:
            stack = sys._getframe(1)
            while stack.f_back is not None and stack.f_code.co_filename.endswith(("work.py", "steps.py")):
                stack = stack.f_back
            self.longest = self._calls, f"{stack.f_code.co_filename}:{stack.f_lineno}"
        self._calls = 0

    def wait_for(self, function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
        """Call a function here."""
        return function(*args, **kwargs)


def longest_stretch(text: str) -> tuple[int, str]:
    """Return the most calls between two pauses while a session plays a document, and where they ended."""
    stretches = _Stretches()

    def play() -> None:
        session = Session("worst", Settings(voice="silent", max_duration=1e9), 0.0)
        session.connect(1, 0.0)
        session.receive(1, '{"type": "subscribe", "stream": "fap", "fps": 25}', 0.0)
        work.pause_with(stretches)
        on_element.set(stretches.pause)
        sys.setprofile(stretches.count)
        try:
            session.receive(1, text, 0.0)
            for step in range(100):
                session.tick(step / 25)
                stretches.pause()
        finally:
            sys.setprofile(None)

    contextvars.copy_context().run(play)
    return stretches.longest


def search(seconds: float, size: int) -> None:
    """Print the documents that cost most among random ones."""
    worst, end, seed = 0.0, time.monotonic() + seconds, 0
    while time.monotonic() < end:
        text, began = mixed_document(size, seed), time.process_time()
        schedule(text)
        if (spent := time.process_time() - began) > worst:
            worst = spent
            print(f"seed {seed:6}: {spent:.3f} s for {size} behaviours, {len(text)} bytes", flush=True)
        seed += 1


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("pattern", nargs="*", default=list(PATTERNS))
    parser.add_argument("--size", type=int, default=500)
    parser.add_argument("--kind", choices=NAMES, help="default: all in turn")
    parser.add_argument("--search", type=float, metavar="SECONDS")
    given = parser.parse_args()
    schedule(document("linked", 100))  # imports and caches
    if given.search is not None:
        search(given.search, given.size)
        return
    print("pattern       kind        calls  twice the size:  calls   seconds")
    for pattern in given.pattern:
        for kind in [given.kind] if given.kind else NAMES:
            number, times = growth(pattern, given.size, kind)
            text, began = document(pattern, 2 * given.size, kind), time.process_time()
            schedule(text)
            spent = time.process_time() - began
            print(f"{pattern:13} {kind:11} {number:6}  {'':15}  x{times:5.2f}  {spent:7.2f}", flush=True)


if __name__ == "__main__":
    main()
