"""Documents are read one by one, in the order in which they came, and what is too much is said."""

from __future__ import annotations

import pytest

from bml_schema import Block
from realizer.core.settings import Settings
from realizer.scheduling.timing import Warning
from realizer.server.documents import document_queue
from realizer.server.documents.document_queue import CancelledBlock, DocumentQueue

WAIT = '<bml id="{}"><wait id="w" duration="1"/></bml>'


def read(box: DocumentQueue) -> list[Block | CancelledBlock | Warning]:
    found = []
    while (item := box.next()) is not None:
        found.append(item)
    return found


def test_documents_come_out_in_order_with_faults_where_they_stand() -> None:
    box = DocumentQueue(Settings())
    assert box.put(WAIT.format("a") + "<bml id='x'><oops" + WAIT.format("b")) is None
    assert box.put(WAIT.format("c")) is None
    items = read(box)
    assert [i.id for i in items if isinstance(i, Block)] == ["a", "b", "c"]
    assert len([i for i in items if isinstance(i, Warning)]) == 1
    assert not box


def test_a_message_that_is_too_long_is_refused_by_name() -> None:
    box = DocumentQueue(Settings(max_document=40))
    refused = box.put(WAIT.format("a"))
    assert refused is not None
    assert (refused.id, refused.type) == ("a", "PARSING_FAILURE")
    assert "at most 40 bytes" in refused.text
    assert not box


def names(box: DocumentQueue) -> str:
    """Ids in order, those that are stopped in brackets."""
    return " ".join(f"({i.block.id})" if isinstance(i, CancelledBlock) else i.id for i in read(box))


def test_what_is_stopped_before_it_is_read_comes_out_as_such_and_what_comes_later_does_not() -> None:
    box = DocumentQueue(Settings())
    box.put(WAIT.format("a") + WAIT.format("b") + WAIT.format("c"))
    first = box.next()
    assert isinstance(first, Block)
    assert first.id == "a"
    box.put(WAIT.format("b"))
    box.cancel(["b", "x"])
    box.put(WAIT.format("b") + WAIT.format("x"))
    assert names(box) == "(b) c (b) b x"
    box.cancel(["b"])  # there is none
    box.put(WAIT.format("b"))
    box.put(WAIT.format("c"))
    box.cancel(None)
    box.put(WAIT.format("d"))
    assert names(box) == "(b) (c) d"


def test_too_many_messages_are_refused() -> None:
    box = DocumentQueue(Settings(max_blocks=1))
    assert box.put(WAIT.format("a")) is None
    refused = box.put(WAIT.format("b"))
    assert refused is not None
    assert "wanted fewer at a time (REALIZER_MAX_BLOCKS sets it)" in refused.text
    box.clear()
    assert read(box) == []


def test_too_many_behaviours_are_refused_where_they_stand_and_reading_goes_on() -> None:
    box = DocumentQueue(Settings(max_behaviours=1))
    two = '<bml id="two"><wait id="a"/><wait id="b"/></bml>'
    assert box.put(two + WAIT.format("one")) is None
    refused, read_on = read(box)
    assert isinstance(refused, Warning)
    assert refused.id == "two"
    assert "wanted at most 1 behaviours" in refused.text
    assert refused.text.endswith("got 2 (REALIZER_MAX_BEHAVIOURS sets it)")
    assert isinstance(read_on, Block)


def test_what_the_limits_let_in_is_read_however_large() -> None:
    waits = "".join(f'<wait id="w{k}"/>' for k in range(10_001))
    text = f'<bml id="b"><!--{"x" * 2**20}-->{waits}</bml>'
    box = DocumentQueue(Settings(max_document=2 * 2**20, max_behaviours=20_000))
    assert box.put(text) is None
    (block,) = read(box)
    assert isinstance(block, Block)
    assert len(block.behaviours) == 10_001


def test_a_bug_of_the_reader_costs_one_message(monkeypatch: pytest.MonkeyPatch, caplog) -> None:
    box = DocumentQueue(Settings())

    def broken(*_, **__):
        raise RuntimeError("a bug")
        yield

    monkeypatch.setattr(document_queue, "read", broken)
    box.put("<bml/>")
    monkeypatch.undo()
    box.put(WAIT.format("b"))
    first, second = read(box)
    assert isinstance(first, Warning)
    assert "internal error" in first.text
    assert isinstance(second, Block)
