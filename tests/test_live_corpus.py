"""The corpus in real time: one service plays its cases at once, each in a session of its own.

Offline, messages arrive at their times exactly, and voices answer at once. Here they come milliseconds later,
on a busy machine more. So each block is compared by itself: what comes, and when after its start. Times of a
case with several blocks depend on when each of them came, to `ARRIVAL`. Cases that differ are played again: a
pause of the machine does not repeat, a fault of the service does.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Iterable

import pytest
from websockets.asyncio.client import ClientConnection, connect

from bml_schema import BlockProgress, Feedback, SyncPointProgress, parse_feedback
from realizer.behaviours.registry import VOCABULARY
from tests.case_player import MEDIA, Played, play
from tests.cases import CASES, Case, LogLine, log_lines
from tests.programs import serving

EXACT, ARRIVAL = 1e-3, 0.02  # s
LONGEST = 40.0  # s; longer cases are left out
BETWEEN = 0.025  # s from the start of a case to that of the next: the service plans them one after the other
PATIENCE = 5.0  # s that feedback may be late, before what has come counts
TRIES = 4

Blocks = dict[str, list[LogLine]]


def by_block(messages: Iterable[Feedback]) -> Blocks:
    """Return the sorted lines of each block without predictions, with times in seconds since its start."""
    blocks: Blocks = {}
    started: dict[str, float] = {}
    for feedback in messages:
        for line in log_lines(feedback):
            if line.kind == "prediction":
                continue
            block = line.id.partition(":")[0]
            times: tuple[float, ...] = ()
            if isinstance(feedback, SyncPointProgress):
                times = (feedback.time,)
            elif isinstance(feedback, BlockProgress) and line.kind == "start":
                started[block] = feedback.global_time
            elif isinstance(feedback, BlockProgress) and block in started:
                times = (feedback.global_time - started.pop(block),)
            blocks.setdefault(block, []).append(line._replace(times=times))
    return {block: sorted(lines) for block, lines in blocks.items()}


def differs(case: Case, played: Played, live: list[Feedback]) -> bool:
    within = EXACT if len(played.blocks) <= 1 else ARRIVAL
    here, there = by_block(played.feedback), by_block(live)
    return here.keys() != there.keys() or any(
        len(lines) != len(there[block])
        or not all(map(lambda got, wanted: got.matches(wanted, within), there[block], lines))
        for block, lines in here.items()
    )


def is_in_order(live: list[Feedback]) -> bool:
    times = [f.global_time for f in live if isinstance(f, BlockProgress | SyncPointProgress)]
    return times == sorted(times)


async def send(case: Case, socket: ClientConnection, after: float) -> None:
    clock = asyncio.get_running_loop().time
    began = clock() + after
    for time, message in case.messages:
        await asyncio.sleep(began + time - clock())
        await socket.send(message)


async def play_live(
    case: Case, played: Played, address: str, after: float, together: asyncio.Barrier
) -> list[Feedback]:
    """Play a case in a session of its own and return its feedback, to the end of all the others."""
    heard: list[Feedback] = []
    missing = sum(map(len, by_block(played.feedback).values()))

    def hear(message: str | bytes) -> int:
        if not isinstance(message, str) or not message.startswith("<"):
            return 0
        heard.append(parse_feedback(message, VOCABULARY))
        return sum(map(len, by_block(heard[-1:]).values()))

    async with connect(address, max_size=None) as socket:
        await together.wait()
        sender = asyncio.create_task(send(case, socket, after))
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(after + played.end + PATIENCE):
                while missing > 0:
                    missing -= hear(await socket.recv())
        await sender
        await together.wait()
        await socket.send('{"type":"ping"}')
        while '"pong"' not in str(message := await socket.recv()):
            hear(message)
    return heard


async def play_all(cases: dict[Case, Played], address: str) -> list[list[Feedback]]:
    together = asyncio.Barrier(len(cases))
    return await asyncio.gather(
        *(
            play_live(case, played, address, number * BETWEEN, together)
            for number, (case, played) in enumerate(cases.items())
        )
    )


@pytest.mark.slow
def test_service_plays_the_corpus_in_real_time_as_it_is_played_offline() -> None:
    # In the first, voices take long; in the others, the text is not what a message may be.
    cases = {case: play(case) for case in CASES if "ready" not in case.wanted and not case.is_bytes}
    cases = {case: played for case, played in cases.items() if played.end <= LONGEST}
    assert len(cases) >= 400
    with serving("--media", str(MEDIA), "--no-idle") as (address, _):
        for _ in range(TRIES):
            live = asyncio.run(play_all(cases, address.rstrip(",")))
            assert all(map(is_in_order, live))
            cases = {
                case: played
                for (case, played), heard in zip(cases.items(), live, strict=True)
                if differs(case, played, heard)
            }
            if not cases:
                return
    raise AssertionError(f"these differ each time: {', '.join(case.name for case in cases)}")
