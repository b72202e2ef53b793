"""The feedback a session keeps: numbered from 1, the oldest forgotten first."""

from __future__ import annotations

from bml_schema import BlockProgress, parse_feedback
from realizer.server.feedback_log import FeedbackLog


def filled(keep: int, count: int) -> FeedbackLog:
    log = FeedbackLog(keep)
    for n in range(count):
        log.add(BlockProgress(id=f"b{n}:end", global_time=n))
    return log


def test_messages_are_numbered_from_1() -> None:
    log = filled(10, 3)
    assert [parse_feedback(text).seq for text in log.since(1)] == [1, 2, 3]
    assert (log.first, log.newest) == (1, 3)


def test_since_gives_what_follows() -> None:
    log = filled(10, 5)
    assert [parse_feedback(text).seq for text in log.since(4)] == [4, 5]
    assert log.since(6) == []


def test_the_oldest_are_forgotten() -> None:
    log = filled(2, 5)
    assert (log.first, log.newest) == (4, 5)
    assert [parse_feedback(text).seq for text in log.since(1)] == [4, 5]
