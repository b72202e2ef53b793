"""Documents are read one by one, in the order in which they came, and what is too much is said."""

from __future__ import annotations

import pytest

from bml_schema import Block
from realizer.scheduling.timing import Warning
from realizer.server import inbox
from realizer.server.inbox import Inbox

WAIT = '<bml id="{}"><wait id="w" duration="1"/></bml>'


def read(box: Inbox) -> list[Block | Warning]:
    found = []
    while (item := box.next()) is not None:
        found.append(item)
    return found


def test_documents_come_out_in_order_with_faults_where_they_stand() -> None:
    box = Inbox(1000)
    assert box.put(WAIT.format("a") + "<bml id='x'><oops" + WAIT.format("b")) is None
    assert box.put(WAIT.format("c")) is None
    items = read(box)
    assert [i.id for i in items if isinstance(i, Block)] == ["a", "b", "c"]
    assert len([i for i in items if isinstance(i, Warning)]) == 1
    assert not box


def test_a_message_that_is_too_long_is_refused_by_name() -> None:
    box = Inbox(40)
    refused = box.put(WAIT.format("a"))
    assert refused is not None
    assert (refused.id, refused.type) == ("a", "PARSING_FAILURE")
    assert "at most 40 bytes" in refused.text
    assert not box


def test_too_many_messages_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inbox, "MOST", 1)
    box = Inbox(1000)
    assert box.put(WAIT.format("a")) is None
    assert "wanted fewer" in str(getattr(box.put(WAIT.format("b")), "text", ""))
    box.clear()
    assert read(box) == []


def test_a_bug_of_the_reader_costs_one_message(monkeypatch: pytest.MonkeyPatch, caplog) -> None:
    box = Inbox(1000)

    def broken(*_):
        raise RuntimeError("a bug")
        yield

    monkeypatch.setattr(inbox, "read", broken)
    box.put("<bml/>")
    monkeypatch.undo()
    box.put(WAIT.format("b"))
    first, second = read(box)
    assert isinstance(first, Warning)
    assert "internal error" in first.text
    assert isinstance(second, Block)
