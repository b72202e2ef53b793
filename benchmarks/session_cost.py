"""Measures what a session costs without sockets, and what the garbage collection policy saves.

Run: python benchmarks/session_cost.py [--sessions 50] [--cycles 4] [--ahead 0.2]

Each session has one subscriber of 25 FAP frames a second and plays the document of `listeners.py` every ten
seconds. Time is simulated; costs are processor time. Three rounds alternate between the session as it is
and with Python's automatic garbage collection instead of `GcPolicy`.
"""

from __future__ import annotations

import argparse
import gc
import json
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from listeners import BODY, FPS, SCENE

from realizer.core.settings import Settings
from realizer.server.session.session import Session

CYCLE = 10.0  # s
ROUNDS = 3


@dataclass
class Cost:
    """Seconds of processor time by kind of step, and the longest step."""

    seconds: dict[str, float] = field(default_factory=lambda: {"documents": 0.0, "frames": 0.0})
    longest: float = 0.0

    def measure(self, kind: str, function: Callable[[], float]) -> float:
        """Call a function and return its result."""
        began = time.process_time()
        result = function()
        taken = time.process_time() - began
        self.seconds[kind] += taken
        self.longest = max(self.longest, taken)
        return result


def new_session(number: int, ahead: float) -> Session:
    session = Session(f"s{number}", Settings(voice="silent"), 0.0)
    session.connect(1, 0.0)
    for message in (SCENE, {"type": "subscribe", "stream": "fap", "fps": FPS, "ahead": ahead}):
        session.receive(1, json.dumps(message), 0.0)
    return session


def tick(session: Session, now: float) -> float:
    """Do what the host does at a deadline. Return the next one."""
    due = session.ticker.send_ready(now)
    if due is None:
        session.tick(now, read_documents=False)
        due = session.next_due()
    session.take_effects()
    return due


def play(session: Session, now: float) -> float:
    session.receive(1, f'<bml id="b{now}" composition="REPLACE">{BODY}</bml>', now)
    while session.has_documents:
        session.tick(now)
    session.take_effects()
    return session.next_due()


def cost(sessions: int, cycles: int, ahead: float) -> Cost:
    """Simulate sessions one step at a time, in turn; the first cycle is not measured."""
    alive = [new_session(number, ahead) for number in range(sessions)]
    due = [session.next_due() for session in alive]
    total = Cost()
    for cycle in range(cycles + 1):
        if cycle == 1:
            total = Cost()
        for step in range(round(CYCLE * FPS)):
            now = cycle * CYCLE + step / FPS
            for number, session in enumerate(alive):
                if number * CYCLE * FPS // sessions == step:
                    due[number] = total.measure("documents", lambda s=session, t=now: play(s, t))
                while (at := max(due[number], now)) <= now + 1 / FPS / 2:
                    due[number] = total.measure("frames", lambda s=session, t=at: tick(s, t))
    return total


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--sessions", type=int, default=50)
    parser.add_argument("--cycles", type=int, default=4, help="of ten seconds")
    parser.add_argument("--ahead", type=float, default=0.0, help="seconds that frames are sent ahead")
    options = parser.parse_args()
    frames = options.sessions * options.cycles * CYCLE * FPS
    rows: dict[str, list[Cost]] = {"as it is": [], "automatic gc": []}
    for _ in range(ROUNDS):
        for name, costs in rows.items():
            gc.collect()
            gc.freeze()
            gc.enable() if name == "automatic gc" else gc.disable()
            costs.append(cost(options.sessions, options.cycles, options.ahead))
    print(f"{options.sessions} sessions, microseconds a frame:  documents  frames    both   longest step ms")
    for name, costs in rows.items():
        documents, sending = (
            1e6 / frames * statistics.median(c.seconds[k] for c in costs) for k in ("documents", "frames")
        )
        longest = 1e3 * statistics.median(c.longest for c in costs)
        print(
            f"{name:42}{documents:9.1f} {sending:7.1f} {documents + sending:7.1f} {longest:11.1f}", flush=True
        )


if __name__ == "__main__":
    main()
