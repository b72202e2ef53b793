"""The feedback a session keeps: numbered from 1, the oldest forgotten first."""

from __future__ import annotations

from bml_schema import BlockProgress, SyncPointProgress, parse_feedback
from realizer.server.feedback_log import FeedbackLog


def filled(keep: int, count: int) -> FeedbackLog:
    log = FeedbackLog(keep)
    for n in range(count):
        log.add(BlockProgress(id=f"b{n}:end", global_time=n))
    return log


def test_messages_are_numbered_from_1() -> None:
    log = filled(10, 3)
    assert [parse_feedback(text).seq for _, text in log.since(1)] == [1, 2, 3]
    assert (log.first, log.newest) == (1, 3)


def test_since_gives_what_follows() -> None:
    log = filled(10, 5)
    assert [parse_feedback(text).seq for _, text in log.since(4)] == [4, 5]
    assert log.since(6) == []


def test_the_oldest_are_forgotten() -> None:
    log = filled(2, 5)
    assert (log.first, log.newest) == (4, 5)
    assert [parse_feedback(text).seq for _, text in log.since(1)] == [4, 5]


def test_with_an_epoch_every_time_comes_in_posix_milliseconds_too() -> None:
    log = FeedbackLog(5, epoch=1_700_000_000.25)
    log.add(SyncPointProgress(id="b:h:end", time=1.0, global_time=2.5))
    ((_, text),) = log.since(1)
    assert 'globalTime="2.5"' in text
    assert parse_feedback(text).posix_time == 1_700_000_002_750
