"""The feedback log: numbered from 1, bounded, resumable."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bml_schema import BlockProgress, SyncPointProgress, parse_feedback
from realizer.server.session.connections import FRESH, MOST, PACK, ROOM, FeedbackLog


def filled(count: int, step: float = 1.0) -> FeedbackLog:
    log = FeedbackLog()
    for n in range(count):
        log.add(BlockProgress(id=f"b{n}:end", global_time=n * step), n * step)
    return log


def numbers(log: FeedbackLog, seq: int) -> list[int | None]:
    return [parse_feedback(text).seq for text in log.since(seq)]


def test_add_numbers_messages_from_1() -> None:
    log = filled(3)
    assert numbers(log, 1) == [1, 2, 3]
    assert (log.first, log.newest) == (1, 3)


def test_since_returns_later_messages() -> None:
    log = filled(5)
    assert numbers(log, 4) == [4, 5]
    assert log.since(6) == []


def test_add_keeps_the_last_minute_and_a_bounded_size() -> None:
    log = filled(6000, step=0.05)
    texts = log.since(1)
    assert len(texts) == log.newest - log.first + 1
    assert FRESH / 0.05 <= len(texts) < 6000
    assert sum(map(len, texts)) > ROOM  # the last minute alone is larger here
    slow = filled(6000, step=10.0)
    assert ROOM - 1.1 * PACK < sum(map(len, slow.since(1))) <= ROOM
    assert numbers(slow, 1) == list(range(slow.first, 6001))


def test_add_limits_the_number_of_recent_messages() -> None:
    log = filled(MOST + 5, step=0.0)
    assert log.newest == MOST + 5
    assert MOST - PACK / 100 < len(log.since(1)) == log.newest - log.first + 1 <= MOST


@given(seq=st.integers(-5, 700))
def test_since_unpacks_compressed_messages(seq: int) -> None:
    log = FeedbackLog()
    texts = [log.add(BlockProgress(id=f"b{n}:end", global_time=n * 0.1), n * 0.1) for n in range(600)]
    assert sum(map(len, texts)) > 4 * PACK
    assert log.since(seq) == texts[max(seq - 1, 0) :]


def test_restore_continues_the_numbers() -> None:
    log = filled(5)
    again = FeedbackLog()
    again.restore(log.newest, log.since(3), now=7.0)
    assert (again.first, again.newest) == (3, 5)
    assert again.since(4) == log.since(4)


def test_add_writes_posix_times_with_an_epoch() -> None:
    log = FeedbackLog(epoch=1_700_000_000.25)
    log.add(SyncPointProgress(id="b:h:end", time=1.0, global_time=2.5), 2.5)
    (text,) = log.since(1)
    assert 'globalTime="2.5"' in text
    assert parse_feedback(text).posix_time == 1_700_000_002_750
