"""The corpus in a running host of sessions, all cases at once, each in a session of its own.

The clock of the event loop jumps to what is due next. So each message arrives at its time exactly, and what a
case gives must be what it gives offline.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable

import pytest

from bml_schema import BlockProgress, Feedback, SyncPointProgress, parse_feedback
from realizer.behaviours.registry import VOCABULARY
from realizer.core.settings import Settings
from realizer.server.runtime.session_host import SessionHost
from tests import virtual_time
from tests.case_player import MEDIA, Played, play
from tests.cases import CASES, Case, LogLine, log_lines

EXACT = 1e-3  # s; feedback is rounded to that
AFTER = 1.0  # s after the last message of all cases

Blocks = dict[str, list[LogLine]]


class Client:
    """A client that keeps its feedback."""

    unsent_bytes = 0

    def __init__(self) -> None:
        self.feedback: list[Feedback] = []

    def send(self, data: str | bytes) -> None:
        if isinstance(data, str) and data.startswith("<"):
            self.feedback.append(parse_feedback(data, VOCABULARY))

    def disconnect(self, code: int, reason: str) -> None:
        raise AssertionError(f"{code} {reason}")


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


def agree(played: Played, live: list[Feedback]) -> bool:
    offline, there = by_block(played.feedback), by_block(live)
    return offline.keys() == there.keys() and all(
        len(lines) == len(there[block])
        and all(got.matches(wanted, EXACT) for got, wanted in zip(there[block], lines, strict=True))
        for block, lines in offline.items()
    )


def is_in_order(live: list[Feedback]) -> bool:
    times = [f.global_time for f in live if isinstance(f, BlockProgress | SyncPointProgress)]
    return times == sorted(times)


async def play_live(cases: dict[Case, Played]) -> list[list[Feedback]]:
    host, loop = SessionHost(Settings(voice="silent", media=MEDIA, idle=False)), asyncio.get_running_loop()
    await host.start()
    clients = [Client() for _ in cases]
    for case, client in zip(cases, clients, strict=True):
        number = host.join(client, None)
        for time, message in case.messages:
            loop.call_at(loop.time() + time, host.receive, number, message)
    await asyncio.sleep(max(played.end for played in cases.values()) + AFTER)
    await host.close()
    return [client.feedback for client in clients]


@pytest.mark.slow
def test_host_plays_the_corpus_as_it_is_played_offline() -> None:
    # In the first, voices take long; in the others, the text is not what a message may be.
    cases = {case: play(case) for case in CASES if "ready" not in case.wanted and not case.is_bytes}
    assert len(cases) >= 400
    live = virtual_time.run(play_live(cases))
    assert all(map(is_in_order, live))
    agreed = map(agree, cases.values(), live)
    assert [case.name for case, same in zip(cases, agreed, strict=True) if not same] == []
