"""The waiters for blocks: which feedback is about which of them."""

from __future__ import annotations

import pytest

from bml_schema.feedback import (
    BlockPrediction,
    BlockProgress,
    Feedback,
    PredictionFeedback,
    WarningFeedback,
)
from realizer.client.block_waiters import NO_ID, BlockWaiter, BlockWaiters, waiters_of
from realizer.client.errors import ClientError


def planned(status: str, id: str = "b") -> PredictionFeedback:
    """A prediction without an end, as it is while a block waits for the end of an open speech."""
    return PredictionFeedback(blocks=(BlockPrediction(id=id, global_start=0.0, status=status),))


def block(id: str, time: float) -> BlockProgress:
    return BlockProgress(id=id, global_time=time)


def warning(id: str, in_use_for: int | None = None) -> WarningFeedback:
    return WarningFeedback(id=id, type="PARSING_FAILURE", in_use_for=in_use_for)


def ends(waiters: list[BlockWaiter], *messages: Feedback) -> list[str | None]:
    """Return the ids of the feedback that ends each waiter."""
    together = BlockWaiters(*waiters)
    together.connection = 1
    for message in messages:
        together.on_feedback(message)
    return [waiter.last.id if waiter.last else None for waiter in waiters]


@pytest.mark.parametrize(
    ("messages", "last"),
    [
        ([block("b:start", 1.0), block("b:end", 2.0)], "b:end"),
        ([block("a:end", 1.0), block("b:end", 2.0)], "b:end"),
        ([planned("IN_PREP"), warning("b")], "b"),
        ([planned("IN_PREP"), planned("LURKING"), warning("b"), block("b:end", 3.0)], "b:end"),
        ([warning("b:n"), warning(NO_ID), block("b:start", 1.0)], None),
    ],
)
def test_block_waiter_finishes_with_the_end_or_the_refusal(messages, last) -> None:
    until = BlockWaiter("b")
    assert ends([until], *messages) == [last]
    assert until.is_finished == (last is not None)
    if last == "b":
        with pytest.raises(ClientError):
            until.end()


@pytest.mark.parametrize(
    ("bml", "ids"),
    [
        ('<bml id="a"/><bml id="b"/>', ["a", "b"]),
        ('<bml id="a"/><!-- <bml id="b"/> -->', ["a"]),
        ('<bml id="a&amp;b"/>', ["a&b"]),
        ("<bml id=' b '/>", ["b"]),
        ("<bml id='b'><speech id='s'><text><![CDATA[<bml id='z'/>]]></text></speech></bml>", ["b"]),
        ("<bml id='b'><bml id='c'/></bml>", ["b"]),
        ("<bml/>", [NO_ID]),
        ("<bml id='a:b'/>", [NO_ID]),
        (f"<bml id='{'x' * 300}'/>", [NO_ID]),
        ("<bml xmlns='http://www.bml-initiative.org/bml/bml-2.0' id='b'/>", [NO_ID]),
        ("<bml id='b'/><bml id='c'", ["b", NO_ID]),
        ("<bml><head type='NOD'/></bml>", [None]),
        ("[1]", [NO_ID]),
        ("```xml\n<bml id='b'/>\n```", ["b"]),
        ('{"type":"foo"}', []),
        ("<!-- later -->", []),
        ("<act></act>", []),
    ],
)
def test_waiters_of_have_the_ids_that_feedback_will_have(bml, ids) -> None:
    assert [waiter.block for waiter in waiters_of(bml)] == ids


@pytest.mark.parametrize("bml", [3, b"<bml/>", None])
def test_waiters_of_refuses_what_is_no_text(bml: object) -> None:
    with pytest.raises(TypeError, match="bml: wanted a string, got"):
        waiters_of(bml)  # type: ignore[arg-type]


def test_waiters_learn_the_ids_that_the_service_makes() -> None:
    waiters = waiters_of("<bml><head type='NOD'/></bml><bml><head type='NOD'/></bml>")
    messages = [planned("IN_PREP", id) for id in ("other", "unnamed7", "unnamed8")]
    assert ends(waiters, *messages, block("unnamed8:end", 1.0)) == [None, "unnamed8:end"]
    assert [waiter.block for waiter in waiters] == ["unnamed7", "unnamed8"]


def test_waiters_of_dialects_end_if_the_service_reads_bml_1_0_only() -> None:
    assert ends(waiters_of("<bml><head type='NOD'/></bml>"), warning(NO_ID)) == [NO_ID]


def test_waiters_of_one_id_end_in_the_order_in_which_they_were_sent() -> None:
    replaced = [planned("IN_PREP"), planned("LURKING"), planned("IN_PREP"), block("b:end", 1.0)]
    assert ends([BlockWaiter("b"), BlockWaiter("b")], *replaced) == ["b:end", None]
    waiters = [BlockWaiter("b"), BlockWaiter("b")]
    ends(waiters, *replaced, block("b:start", 1.0), block("b:end", 2.0))
    assert [waiter.end().global_time for waiter in waiters] == [1.0, 2.0]


@pytest.mark.parametrize("first", [[], [planned("LURKING")]])
def test_waiter_of_an_id_in_use_ends_without_the_older_one(first) -> None:
    messages = [planned("IN_PREP"), *first, warning("b", in_use_for=1)]
    assert ends([BlockWaiter("b"), BlockWaiter("b")], *messages) == [None, "b"]
    assert ends([BlockWaiter("b")], *messages) == ["b"]  # acknowledged was the block of another client
    assert ends([BlockWaiter("b")], planned("IN_PREP"), *first, warning("b", in_use_for=2)) == [None]


def test_waiters_of_a_message_that_is_refused_as_a_whole_all_end() -> None:
    waiters = waiters_of("<bml id='a'/><bml id='b'/>")
    assert ends([BlockWaiter("a"), *waiters], warning("b")) == [None, "b", "b"]
