"""Blocks in preparation: who waits for whom."""

from __future__ import annotations

import pytest

from bml_schema import parse
from realizer.behaviours.registry import VOCABULARY
from realizer.server.documents.pending_blocks import PendingBlocks
from realizer.speech.utterance import SpeechRequest
from tests.realizer.server.conftest import spoken


def block(text: str):
    return parse(text, VOCABULARY)


@pytest.fixture
def talking() -> PendingBlocks:
    """A block "a" whose speech 1 is still to be spoken."""
    preparation = PendingBlocks()
    preparation.add(
        block('<bml id="a"><speech id="s"><text>Hi</text></speech></bml>'),
        0,
        {1: ("s", SpeechRequest("Hi"))},
        0.0,
    )
    return preparation


@pytest.mark.parametrize(
    ("later", "character", "waits"),
    [
        ('<bml id="b"><wait id="w"/></bml>', 0, False),
        ('<bml id="a"><wait id="w"/></bml>', 0, True),
        ('<bml id="b" composition="APPEND"><wait id="w"/></bml>', 0, True),
        ('<bml id="b" composition="APPEND"><wait id="w"/></bml>', 1, False),
        ('<bml id="b" composition="REPLACE"><wait id="w"/></bml>', 0, False),
        ('<bml id="b"><wait id="w" start="a:s:end"/></bml>', 1, True),
        (
            '<bml id="b"><wait id="w"/><constraint><after ref="a:s:end"><sync ref="w:start"/></after>'
            "</constraint></bml>",
            0,
            True,
        ),
    ],
)
def test_a_block_waits_only_for_what_it_depends_on(talking, later, character, waits) -> None:
    waiting = talking.add(block(later), character, {}, 1.0)
    assert bool(waiting.predecessors) is waits
    assert (talking.first_ready() is None) is waits


def test_a_spoken_block_is_ready_and_lets_the_next_one_go(talking) -> None:
    talking.add(block('<bml id="b" composition="APPEND"><wait id="w"/></bml>'), 0, {}, 1.0)
    talking.add_utterance(1, spoken())
    order = []
    while (ready := talking.first_ready()) is not None:
        order.append(ready)
        talking.remove([ready])
    assert [w.block.id for w in order] == ["a", "b"]
    assert order[0].utterances["s"].duration == 1.0


def test_an_answer_nobody_waits_for_is_dropped(talking) -> None:
    talking.add_utterance(99, spoken())
    assert talking.request_of(99) is None
    assert talking.request_of(1).ssml == "Hi"


def test_what_takes_too_long_is_told(talking) -> None:
    assert talking.deadline(20.0) == 20.0
    assert list(talking.overdue(-0.1)) == []
    assert list(talking.overdue(0.1)) == [1]
