"""Mutants of the corpus: what comes of them is a block or a BMLError, it plays to its end, none hangs up."""

from __future__ import annotations

import asyncio
import json
import signal
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path

import numpy as np
import pytest
from websockets.asyncio.client import connect

from bml_schema import Block, BMLError, read
from realizer.behaviours import VOCABULARY
from realizer.pipeline import submitted
from realizer.player import Player
from realizer.server.serve import Server
from realizer.settings import Settings
from realizer.speech import SilentVoice
from tests.mutants import mutants

CORPUS = Path(__file__).parent / "corpus"
HANG = (
    5.0  # s of CPU for one mutant: far above the 0.1 s that is aimed at, so that a busy machine is no fault
)
LIMIT = 120  # s; a hung service ends
OVER_THE_WIRE = 400


def corpus() -> list[bytes]:
    return [path.read_bytes() for path in sorted(CORPUS.rglob("*.xml"))]


@pytest.fixture(scope="module")
def count(pytestconfig: pytest.Config) -> int:
    return int(pytestconfig.getoption("mutants"))


@pytest.fixture(scope="module")
def seed(pytestconfig: pytest.Config) -> int:
    return int(pytestconfig.getoption("seed"))


class HangError(Exception):
    """More CPU than anything may take."""


@contextmanager
def no_hang(mutant: bytes) -> Iterator[list[float]]:
    """Ends what takes too long; the list then holds the CPU seconds it took."""

    def ring(*_: object) -> None:
        raise HangError(mutant)

    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, HANG)
    took: list[float] = []
    start = time.process_time()
    try:
        yield took
    finally:
        took.append(time.process_time() - start)
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def test_whatever_is_read_gives_blocks_and_errors_and_blocks_play_to_their_end(
    count: int, seed: int, capsys: pytest.CaptureFixture[str]
) -> None:
    results: Counter[str] = Counter()
    slowest: dict[str, tuple[float, int]] = {"read": (0.0, -1), "played": (0.0, -1)}
    for n, mutant in enumerate(mutants(corpus(), count, seed)):
        with no_hang(mutant) as took:
            items = list(read(mutant, VOCABULARY))
        slowest["read"] = max(slowest["read"], (took[0], n))
        assert all(isinstance(item, Block | BMLError) for item in items), mutant
        results.update(type(item).__name__ for item in items)
        with no_hang(mutant) as took:
            try:
                plays(items, faces=n % 20 == 0)
            except Exception as wrong:
                raise AssertionError(f"mutant {n} of seed {seed}: {mutant!r}") from wrong
        slowest["played"] = max(slowest["played"], (took[0], n))
    assert results["Block"]
    assert results["BMLSyntaxError"]
    with capsys.disabled():
        times = ", ".join(
            f"{what} in at most {s * 1e3:.0f} ms (number {n})" for what, (s, n) in slowest.items()
        )
        print(f"\n{count} mutants of seed {seed}: {dict(results)}, {times}")


def plays(items: list[Block | BMLError], *, faces: bool) -> None:
    """Submit what is a block, and let time jump from deadline to deadline until nothing moves any more."""
    player = Player(idle=False)
    for item in items:
        if isinstance(item, Block):
            schedule = submitted(player, item, SilentVoice())
            for points in schedule.times.values():
                assert np.isfinite(points).all()
                assert (np.diff(points) >= 0).all()
    if faces:
        frames = player.frames(np.linspace(0, min(player.end, 1e5), 5))
        assert np.isfinite(frames.values).all()
    for _ in range(100_000):
        deadline = player.next_deadline()
        if deadline is None:
            break
        for feedback in player.due(max(deadline, 0.0)):
            assert feedback.to_xml()
    else:
        raise AssertionError("it goes on for ever")
    waiting = [b for b in player.state(1e6)["blocks"] if b["status"] not in ("PENDING", "LURKING")]
    assert not waiting


def test_no_mutant_ends_a_connection(count: int, seed: int) -> None:
    some = islice(mutants(corpus(), count, seed + 1), min(count, OVER_THE_WIRE))

    async def run() -> None:
        settings = Settings(port=0, voice="silent")
        async with asyncio.timeout(LIMIT), Server(settings) as server, connect(server.url) as socket:
            await socket.send(json.dumps({"type": "subscribe", "stream": "fap", "fps": 5}))
            for n, mutant in enumerate(some):
                await socket.send(mutant.decode("utf-8", "replace") if n % 5 else mutant)
                if n % 20 == 0:
                    await answers(socket, n)
            await answers(socket, -1)
            last = '<bml id="the last" composition="REPLACE"><wait id="w" duration="0.05"/></bml>'
            await socket.send(last)
            async for message in socket:
                if isinstance(message, str) and 'id="the last:end"' in message:
                    return
            raise AssertionError("the connection ended")

    asyncio.run(run())


async def answers(socket, number: int) -> None:
    """The service still hears, and lets go of what plays."""
    await socket.send('{"type":"stop"}')
    await socket.send(json.dumps({"type": "ping", "id": f"ping {number}"}))
    async for message in socket:
        if isinstance(message, str) and message.startswith("{") and json.loads(message)["type"] == "pong":
            return
    raise AssertionError("the connection ended")
