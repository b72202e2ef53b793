"""The queue of documents, and the limits of what it accepts."""

from __future__ import annotations

import pytest

from bml_schema import Block, BlockProgress, PredictionFeedback, SyncPointProgress, WarningFeedback
from realizer.core.settings import Settings
from realizer.scheduling.timing import Warning
from realizer.server.documents import document_queue
from realizer.server.documents.document_queue import DocumentQueue, block_id_of
from realizer.server.session.session_clock import STANDSTILL
from tests.realizer.server.conftest import Driver, spoken

WAIT = '<bml id="{}"><wait id="w" duration="1"/></bml>'


def read(queue: DocumentQueue) -> list[Block | Warning]:
    found = []
    while (item := queue.next()) is not None:
        found.append(item)
    return found


def test_document_queue_returns_blocks_and_warnings_in_order() -> None:
    queue = DocumentQueue(Settings())
    assert queue.put(WAIT.format("a") + "<bml id='x'><oops" + WAIT.format("b")) is None
    assert queue.put(WAIT.format("c")) is None
    items = read(queue)
    assert [i.id for i in items if isinstance(i, Block)] == ["a", "b", "c"]
    assert len([i for i in items if isinstance(i, Warning)]) == 1
    assert not queue


def test_document_queue_refuses_a_long_message_with_its_block_id() -> None:
    queue = DocumentQueue(Settings(max_document=40))
    refused = queue.put(WAIT.format("a"))
    assert refused is not None
    assert (refused.id, refused.type) == ("a", "PARSING_FAILURE")
    assert "at most 40 bytes" in refused.text
    assert not queue


@pytest.mark.parametrize(
    ("message", "block"),
    [
        (WAIT.format("a") + WAIT.format("b"), "b"),
        (WAIT.format("a") + 5000 * " ", "a"),
        ('<bml id="a"><bmla:interrupt target="x"/></bml>', "a"),
        ('<x:bml id="a"/>', "a"),
        ("<bml/>", "<no id>"),
    ],
    ids=["several", "long", "prefix behind", "prefix", "none"],
)
def test_block_id_of_is_that_of_the_last_block(message: str, block: str) -> None:
    assert block_id_of(message) == block


def names(queue: DocumentQueue) -> str:
    """Return the ids in order, those of cancelled blocks in brackets."""
    found = []
    while (item := queue.next()) is not None:
        cancelled = isinstance(item, Block) and queue.is_cancelled(item)
        found.append(f"({item.id})" if cancelled else item.id)
    return " ".join(found)


def test_document_queue_cancels_only_what_has_arrived() -> None:
    queue = DocumentQueue(Settings())
    queue.put(WAIT.format("a") + WAIT.format("b") + WAIT.format("c"))
    first = queue.next()
    assert isinstance(first, Block)
    assert first.id == "a"
    queue.put(WAIT.format("b"))
    queue.cancel(["b", "x"])
    queue.put(WAIT.format("b") + WAIT.format("x"))
    assert names(queue) == "(b) c (b) b x"
    queue.cancel(["b"])  # there is none
    queue.put(WAIT.format("b"))
    queue.put(WAIT.format("c"))
    queue.cancel(None)
    queue.put(WAIT.format("d"))
    assert names(queue) == "(b) (c) d"


def test_document_queue_refuses_too_many_messages() -> None:
    queue = DocumentQueue(Settings(max_blocks=1))
    assert queue.put(WAIT.format("a")) is None
    refused = queue.put(WAIT.format("b"))
    assert refused is not None
    assert "wanted fewer at a time (REALIZER_MAX_BLOCKS sets it)" in refused.text
    queue.clear()
    assert read(queue) == []


def test_document_queue_goes_on_after_a_block_of_too_many_behaviours() -> None:
    queue = DocumentQueue(Settings(max_behaviours=1))
    two = '<bml id="two"><wait id="a"/><wait id="b"/></bml>'
    assert queue.put(two + WAIT.format("one")) is None
    refused, read_on = read(queue)
    assert isinstance(refused, Warning)
    assert refused.id == "two"
    assert "wanted at most 1 behaviours" in refused.text
    assert refused.text.endswith("got 2 (REALIZER_MAX_BEHAVIOURS sets it)")
    assert isinstance(read_on, Block)


def test_document_queue_reads_all_that_the_limits_allow() -> None:
    waits = "".join(f'<wait id="w{k}"/>' for k in range(10_001))
    text = f'<bml id="b"><!--{"x" * 2**20}-->{waits}</bml>'
    queue = DocumentQueue(Settings(max_document=2 * 2**20, max_behaviours=20_000))
    assert queue.put(text) is None
    (block,) = read(queue)
    assert isinstance(block, Block)
    assert len(block.behaviours) == 10_001


def test_document_queue_loses_one_message_by_a_bug_of_the_reader(
    monkeypatch: pytest.MonkeyPatch, caplog
) -> None:
    queue = DocumentQueue(Settings())

    def broken(*_, **__):
        raise RuntimeError("a bug")
        yield

    monkeypatch.setattr(document_queue, "read", broken)
    queue.put("<bml/>")
    monkeypatch.undo()
    queue.put(WAIT.format("b"))
    first, second = read(queue)
    assert isinstance(first, Warning)
    assert "internal error" in first.text
    assert isinstance(second, Block)


def test_submission_plans_all_documents_of_a_message_for_one_instant() -> None:
    driver = Driver()
    driver.now = 1.0
    first = '<bml id="a"><head id="n" lexeme="NOD"/></bml>'
    second = '<bml id="b"><head id="m" lexeme="SHAKE" start="a:n:start"/></bml>'
    driver.session.receive(1, first + second, driver.opened + driver.now)
    while driver.session.has_documents:
        driver.now += 0.01
        driver.wake()
    client = driver.run(5.0)
    starts = {f.id: f.global_time for f in client.feedback if isinstance(f, BlockProgress)}
    assert starts["a:start"] == starts["b:start"]
    assert "late" not in "".join(text for text in client.messages if isinstance(text, str))


def test_submission_plans_blocks_that_waited_for_another_for_its_instant() -> None:
    driver = Driver(mute=True)
    driver.send('<bml id="a"><speech id="s"><text>Hi</text></speech></bml>')
    driver.send('<bml id="b"><head id="n" lexeme="NOD" start="a:s:start"/></bml>')
    driver.now = 1.0
    driver.session.on_speech(driver.spoken[0].id, spoken(), driver.opened + driver.now)
    while driver.session.has_documents:
        driver.now += 0.01
        driver.wake()
    feedback = driver.run(5.0).feedback
    times = {f.id: f.global_time for f in feedback if isinstance(f, BlockProgress | SyncPointProgress)}
    assert times["a:s:start"] == times["b:start"] == times["b:n:start"]


def test_submission_goes_on_after_a_standstill() -> None:
    driver = Driver()
    nod = '<bml id="{}"><head id="n" lexeme="NOD"/></bml>'
    driver.session.receive(1, nod.format("a") + nod.format("b"), driver.opened)
    while driver.session.has_documents:
        driver.now += 2 * STANDSTILL
        driver.wake()
    starts = {f.id: f.global_time for f in driver.run(5.0).feedback if isinstance(f, BlockProgress)}
    assert starts["b:start"] - starts["a:start"] > STANDSTILL


def test_submission_drops_the_gaze_of_a_newer_block_after_a_slow_voice() -> None:
    driver = Driver(mute=True)
    driver.send('<bml id="a"><speech id="s"><text>Hi</text></speech><gaze id="g" target="x"/></bml>')
    driver.send('<bml id="b"><gaze id="g" target="y"/><wait id="w" duration="1"/></bml>')
    driver.run(0.3)
    driver.say(driver.spoken[0].id, spoken())
    warnings = [f.id for f in driver.run(5.0).feedback if isinstance(f, WarningFeedback)]
    assert warnings == ["b:g"]


@pytest.mark.parametrize("answers_early", [True, False])
def test_submission_reads_a_message_before_it_plans_its_speech(answers_early: bool) -> None:
    driver = Driver(mute=True)
    nod = '<bml id="b"><head id="n" lexeme="NOD" stroke="a:s:start + 0.5"/></bml>'
    driver.session.receive(
        1, f'<bml id="a"><speech id="s"><text>Hi</text></speech></bml>{nod}', driver.opened
    )
    driver.collect()
    if not answers_early:
        driver.run(0.0)
    driver.say(driver.spoken[0].id, spoken())
    predicted = [f for f in driver.run(0.2).feedback if isinstance(f, PredictionFeedback)]
    named = [(f.blocks[0].id, len(f.behaviours)) for f in predicted]
    assert named[:4] == [("a", 0), ("b", 0), ("a", 1), ("b", 1)]


BMLA = 'xmlns:bmla="http://www.asap-project.org/bmla"'
TALK = '<speech id="s"><text>Hello</text></speech>'
LATER = f'<bml id="later" characterId="Ann"><wait id="w" duration="3"/>{TALK}</bml>'


@pytest.mark.parametrize(
    ("head", "body", "warns"),
    [
        ("", '<head id="n" lexeme="NOD" start="later:w:end"/>', ["first:n"]),
        ('bmla:appendAfter="later"', "", ["first"]),
        ('bmla:chunkAfter="later"', "", []),
        ('bmla:interrupt="later"', "", ["first"]),
        ('bmla:prependBefore="later"', "", ["first"]),
    ],
)
@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_submission_does_not_link_a_block_to_a_later_one(head, body, warns, order) -> None:
    driver = Driver(mute=True)
    driver.send(f'<bml id="first" characterId="Bea" {BMLA} {head}>{TALK}{body}</bml>')
    driver.send(LATER)
    voices = list(driver.spoken)
    for number in order:
        driver.say(voices[number].id, spoken(0.5))
    client = driver.run(10)
    assert [f.id for f in client.feedback if isinstance(f, WarningFeedback)] == warns
    starts = {f.id: f.global_time for f in client.feedback if isinstance(f, BlockProgress)}
    assert starts["later:end"] == 3
    if "prependBefore" not in head:
        assert (starts["first:start"], starts["first:end"]) == (0, 0.5)


def test_document_queue_gives_ids_to_blocks_of_dialects_that_no_other_has() -> None:
    documents = DocumentQueue(Settings())
    for _ in range(2):
        documents.put('<act><bml><head type="NOD"/></bml></act>')
    found = [documents.next(), documents.next()]
    assert [block.id for block in found if isinstance(block, Block)] == ["unnamed1", "unnamed2"]


def test_document_queue_reads_bml_1_0_only_in_strict_bml() -> None:
    documents = DocumentQueue(Settings(strict_bml=True))
    documents.put('<act><bml><head type="NOD"/></bml></act>')
    refused = documents.next()
    assert isinstance(refused, Warning)
    assert "id: wanted one, got none" in refused.text
