"""Tests of mutated documents; `python -m tests.fuzz` runs more of them."""

from __future__ import annotations

import asyncio
import json
from collections import Counter
from itertools import islice

import pytest
from websockets.asyncio.client import connect

from bml_schema import Block, BMLError, Feedback, read
from realizer.behaviours.registry import VOCABULARY
from realizer.core.settings import Settings
from realizer.server.serve import Server
from realizer.server.session.connections import FeedbackLog
from tests.fuzz import corpus, no_hang, plays, tried
from tests.mutants import mutants
from tests.waiting import LIMIT

OVER_THE_WIRE = 400


@pytest.fixture(scope="module")
def count(pytestconfig: pytest.Config) -> int:
    return int(pytestconfig.getoption("mutants"))


@pytest.fixture(scope="module")
def seed(pytestconfig: pytest.Config) -> int:
    return int(pytestconfig.getoption("seed"))


def test_fuzz_of_any_text_gives_errors_and_blocks_that_play_to_the_end(count: int, seed: int) -> None:
    results: Counter[str] = Counter()
    for n, mutant in enumerate(mutants(corpus(), count, seed)):
        with no_hang(mutant):
            items = list(read(mutant, VOCABULARY))
        assert all(isinstance(item, Block | BMLError) for item in items), mutant
        results.update(type(item).__name__ for item in items)
        try:
            with no_hang(mutant):
                plays(items, faces=n % 20 == 0)
        except Exception as wrong:
            raise AssertionError(f"mutant {n} of seed {seed}: {mutant!r}") from wrong
    assert results["Block"]
    assert results["BMLSyntaxError"]


@pytest.mark.parametrize(
    ("target", "part"),
    # The number of tries for as many seeds as mutants: one try costs as much as several mutants.
    [
        *(("faps", 10), ("tasks", 80), ("controls", 40), ("sessions", 300), ("urls", 10)),
        *(("heads", 30), ("clips", 20), ("settings", 5), ("expressions", 5), ("timelines", 10)),
        *(("profiles", 10), ("mappings", 10), ("scenes", 10), ("zones", 20), ("faceeditor", 20)),
        *(("recipes", 10), ("points", 20), ("faces", 150), ("models", 150), ("features", 150)),
        *(("meshes", 150), ("fields", 150), ("plots", 40)),
    ],
)
def test_fuzz_stands_every_kind_of_damage(target: str, part: int, count: int, seed: int) -> None:
    tried(target, range(seed, seed + max(1, count // part)))


def test_fuzz_reports_a_broken_law_with_its_seed(monkeypatch: pytest.MonkeyPatch) -> None:
    # One message in three is not numbered: clients of the session see the gap.
    real = FeedbackLog.add

    def forgetful(log: FeedbackLog, feedback: Feedback, now: float) -> str:
        log.newest += log.newest % 3 == 1
        return real(log, feedback, now)

    monkeypatch.setattr(FeedbackLog, "add", forgetful)
    with pytest.raises(AssertionError, match=r"--only sessions --seed \d+$") as caught:
        tried("sessions", range(10))
    assert "after" in str(caught.value.__cause__)


def test_fuzz_of_a_connection_never_ends_it(count: int, seed: int) -> None:
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
    """Check that the service still answers, and releases what plays."""
    await socket.send('{"type":"stop"}')
    await socket.send(json.dumps({"type": "ping", "id": f"ping {number}"}))
    async for message in socket:
        if isinstance(message, str) and message.startswith("{") and json.loads(message)["type"] == "pong":
            return
    raise AssertionError("the connection ended")
