"""Blocks in preparation, and requests to voices; long texts are synthesized part by part."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bml_schema import Block, parse
from bml_schema.feedback import PredictionFeedback, SyncPointProgress, WarningFeedback
from realizer.behaviours.registry import VOCABULARY
from realizer.core.errors import VoiceError
from realizer.server.documents.pending_blocks import (
    PATIENCE,
    SHORT,
    PendingBlock,
    PendingBlocks,
    is_long,
)
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.espeak.voice import EspeakVoice
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import Recording, SpeechRequest
from tests.realizer.server.conftest import RATE, Client, Driver, spoken

SENTENCE = "Number {} is here, and it is late; nobody knows why we should have been there. "
TEXT = "".join(SENTENCE.format(n) for n in range(20)) + '<sync id="m"/>And so on. ' + SENTENCE.format(99)
BLOCK = '<bml id="{}"{}><speech id="s"><text>{}</text></speech>{}</bml>'
NOD = '<head id="n" lexeme="NOD" stroke="s:m"/>'


def block(text: str) -> Block:
    return parse(text, VOCABULARY)


@pytest.fixture
def speaking() -> PendingBlock:
    return PendingBlock(block('<bml id="a"><speech id="s"><text>Hi</text></speech></bml>'), 0, 0.0)


@pytest.fixture
def pending(speaking: PendingBlock) -> PendingBlocks:
    """A block "a" that waits for the answer to request 1."""
    blocks = PendingBlocks()
    blocks.add(speaking)
    speaking.requests.add(1)
    return blocks


@pytest.mark.parametrize(
    ("later", "character", "waits"),
    [
        ('<bml id="b"><wait id="w"/></bml>', 0, False),
        ('<bml id="a"><wait id="w"/></bml>', 0, True),
        ('<bml id="b" composition="APPEND"><wait id="w"/></bml>', 0, True),
        ('<bml id="b" composition="APPEND"><wait id="w"/></bml>', 1, False),
        ('<bml id="b" composition="REPLACE"><wait id="w"/></bml>', 0, False),
        ('<bml id="b" composition="REPLACE"><wait id="w"/></bml>', 1, False),
        ('<bml id="b" composition="REPLACE"><wait id="w" start="a:s:end"/></bml>', 0, False),
        ('<bml id="b" composition="REPLACE"><wait id="w" start="a:s:end"/></bml>', 1, True),
        (
            '<bml id="b"><bmla:parametervaluechange xmlns:bmla="http://www.asap-project.org/bmla" id="p" '
            'target="a:s" paramId="volume"><bmla:trajectory type="instant" targetValue="50"/>'
            "</bmla:parametervaluechange></bml>",
            0,
            True,
        ),
        ('<bml id="b"><wait id="w" start="a:s:end"/></bml>', 1, True),
        (
            '<bml id="b"><wait id="w"/><constraint><after ref="a:s:end"><sync ref="w:start"/></after>'
            "</constraint></bml>",
            0,
            True,
        ),
    ],
)
def test_add_finds_the_blocks_that_a_block_depends_on(pending, later, character, waits) -> None:
    added = PendingBlock(block(later), character, 1.0)
    pending.add(added)
    assert bool(added.predecessors) is waits
    assert (pending.first_ready() is None) is waits


def test_first_ready_returns_a_block_after_its_speech_and_predecessors(pending, speaking) -> None:
    pending.add(PendingBlock(block('<bml id="b" composition="APPEND"><wait id="w"/></bml>'), 0, 1.0))
    speaking.add_utterance(1, "s", spoken())
    order = []
    while (ready := pending.first_ready()) is not None:
        order.append(ready.block.id)
        pending.remove([ready])
    assert order == ["a", "b"]
    assert speaking.utterances["s"].duration == 1.0


def test_remove_drops_the_requests_of_a_block(pending, speaking) -> None:
    pending.remove([speaking])
    assert not speaking.requests
    assert len(pending) == 0


@pytest.mark.parametrize(
    ("request_", "expected"),
    [
        (SpeechRequest("x" * SHORT), False),
        (SpeechRequest("x" * (SHORT + 1)), True),
        (SpeechRequest("x" * 1000, seconds=3.0), False),
        (SpeechRequest("x" * 1000, recording=Recording(8000, np.zeros(8, np.int16))), False),
    ],
)
def test_is_long_excludes_requests_of_given_length_and_recordings(request_, expected) -> None:
    assert is_long(request_) is expected


def test_is_long_counts_no_tags() -> None:
    marked = f'<mark name="{"m" * SHORT}"/>' + 'x<mark name="m"/>' * SHORT
    assert not is_long(SpeechRequest(marked))
    assert is_long(SpeechRequest(f"{marked}x"))


@pytest.fixture(scope="module")
def voice():
    voice = EspeakVoice()
    yield voice
    voice.close()


def answer(driver: Driver, voice=None) -> bool:
    """Answer the next request; return False if there is none."""
    answered = getattr(driver, "answered", 0)
    if answered == len(driver.spoken):
        return False
    driver.answered = answered + 1
    speak = driver.spoken[answered]
    driver.say(speak.id, speak_to_length(voice or SilentVoice(), speak.request))
    return True


def times(client: Client) -> dict[str, float]:
    return {f.id: f.global_time for f in client.feedback if hasattr(f, "global_time")}


def ends(client: Client, block: str) -> list[float]:
    predicted = [b for f in client.feedback if isinstance(f, PredictionFeedback) for b in f.blocks]
    return [b.global_end for b in predicted if b.id == block and b.global_end is not None]


def test_tts_requests_play_the_first_clause_before_the_rest_is_made(voice) -> None:
    driver = Driver(mute=True)
    driver.send({"type": "subscribe", "stream": "audio", "rate": RATE})
    driver.send(BLOCK.format("b", "", TEXT, NOD))
    assert [len(o.request.ssml) < 160 for o in driver.spoken] == [True]
    assert answer(driver, voice)
    first = driver.run(0.1)
    assert [f.stream for f in first.frames] == ["audio"] * len(first.frames)
    assert first.frames, "it sounds"
    while answer(driver, voice):
        driver.run(driver.now + 0.2)
    speaking = driver.session.player.speech()[0]
    client = driver.run(200)
    heard = np.concatenate([f.values for f in client.frames if not f.flush])
    start = round((speaking.start - client.frames[0].time) * RATE)
    assert np.array_equal(heard[start:][: len(speaking.utterance.pcm)], speaking.utterance.pcm)
    assert not [f for f in client.frames if f.flush], "what was sent ahead stays true"
    frames = [f.frame for f in client.frames]
    assert frames == list(range(frames[0], frames[-1] + 1)), "no gap"


def test_tts_requests_report_marks_when_they_sound(voice) -> None:
    driver = Driver(mute=True)
    driver.send(BLOCK.format("b", "", TEXT, NOD))
    while answer(driver, voice):
        driver.run(driver.now + 0.3)
    speaking = driver.session.player.speech()[0]
    at = times(driver.run(200))
    mark = speaking.start + speaking.utterance.marks["m"]
    assert at["b:s:m"] == pytest.approx(mark, abs=1e-6)
    assert at["b:n:stroke"] == pytest.approx(mark, abs=1e-6)
    word = next(w for w in speaking.utterance.words if w.text.lower() == "and" and w.start >= mark - 0.005)
    assert speaking.start + word.start == pytest.approx(mark, abs=0.06)


def test_tts_requests_predict_the_end_again_with_every_part() -> None:
    driver = Driver(mute=True)
    driver.send(BLOCK.format("b", "", TEXT, ""))
    parts = 0
    while answer(driver):
        parts += 1
    predicted = list(dict.fromkeys(ends(driver.clients[1], "b")))
    assert len(predicted) == parts > 3
    assert predicted[-1] == pytest.approx(driver.session.player.speech()[0].utterance.duration)
    assert times(driver.run(300))["b:end"] == pytest.approx(predicted[-1])


def test_tts_requests_move_lips_smoothly_across_parts() -> None:
    driver = Driver(mute=True, idle=False)
    driver.send({"type": "subscribe", "stream": "fap", "fps": 25})
    driver.send(BLOCK.format("b", "", TEXT, ""))
    while answer(driver):
        driver.run(driver.now + 0.31)
    lasts = driver.session.player.speech()[0].utterance
    client = driver.run(lasts.duration + 1)
    mouth = np.array([f.values[3:5] for f in client.frames if f.stream == "fap"])
    for start, part in lasts.sections:
        own = mouth[round(start * 25) : round((start + part.duration) * 25)]
        assert np.abs(own).max() > 100
    one = Driver(idle=False, mute=True)
    one.send({"type": "subscribe", "stream": "fap", "fps": 25})
    one.send(BLOCK.format("b", "", SENTENCE.format(1), ""))
    one.say(1, SilentVoice().say(one.spoken[0].request))
    usual = np.array([f.values[3:5] for f in one.run(10).frames if f.stream == "fap"])
    assert np.abs(np.diff(mouth, axis=0)).max() < 1.5 * np.abs(np.diff(usual, axis=0)).max()


def test_tts_requests_end_when_the_block_is_stopped() -> None:
    driver = Driver(mute=True)
    driver.send(BLOCK.format("b", "", TEXT, ""))
    answer(driver)
    driver.run(1.0)
    driver.send({"type": "stop"})
    answer(driver)
    assert not answer(driver)
    assert driver.run(5).feedback[-1].status == "INTERRUPTED"
    driver.send(BLOCK.format("b", "", "Hello.", ""))
    answer(driver)
    assert times(driver.run(9))["b:end"] < 8, "nothing of the first text is in the second"


def test_tts_requests_fill_a_part_that_failed_with_silence() -> None:
    driver = Driver(mute=True)
    driver.send(BLOCK.format("b", "", TEXT, ""))
    answer(driver)
    driver.say(driver.spoken[1].id, VoiceError("it died"))
    driver.answered = 2
    while answer(driver):
        pass
    client = driver.run(300)
    assert client.feedback[-1].id == "b:end"
    warnings = [(f.id, f.text) for f in client.feedback if isinstance(f, WarningFeedback)]
    assert warnings == [("b:s", "speech: it died; the silent voice is used instead")]
    assert driver.send({"type": "state"}).of("state")[-1]["voice"]["fault"] == "it died"


def test_tts_requests_play_a_late_part_when_it_arrives() -> None:
    driver = Driver(mute=True)
    driver.send(BLOCK.format("b", "", TEXT, ""))
    answer(driver)
    made = driver.session.player.speech()[0].utterance.sections[0][1].duration
    driver.run(made + 2.0)
    answer(driver)
    parts = driver.session.player.speech()[0].utterance.sections
    assert parts[1][0] == pytest.approx(made + 2.05, abs=0.01)


def test_tts_requests_continue_while_the_block_waits() -> None:
    driver = Driver(mute=True)
    driver.send('<bml id="a"><wait id="w" duration="3"/></bml>')
    driver.send(BLOCK.format("b", ' composition="APPEND"', TEXT, NOD))
    while answer(driver):
        pass
    assert driver.session.player.speech()[0].start == pytest.approx(3.0)
    at = times(driver.run(300))
    assert at["b:n:stroke"] == pytest.approx(at["b:s:m"])


def test_tts_requests_complete_the_text_before_a_late_activation() -> None:
    driver = Driver(mute=True)
    bmla = ' xmlns:bmla="http://www.asap-project.org/bmla" bmla:preplan="true"'
    driver.send(BLOCK.format("b", bmla, TEXT, NOD))
    while answer(driver):
        pass
    bmla = ' xmlns:bmla="http://www.asap-project.org/bmla" bmla:onStart="b"'
    driver.send(f'<bml id="a"{bmla}><wait id="w" duration="1"/></bml>')
    last = driver.session.player.speech()[0]
    at = times(driver.run(300))
    assert at["b:end"] - at["b:start"] == pytest.approx(last.utterance.duration)
    assert at["b:n:stroke"] == pytest.approx(at["b:s:m"])
    assert at["b:s:m"] - at["b:start"] == pytest.approx(last.utterance.marks["m"])


def test_tts_requests_speak_a_stretched_text_again_as_a_whole(voice) -> None:
    text = "".join(SENTENCE.format(n) for n in range(4))
    asked = 1.1 * voice.say(SpeechRequest(text)).duration
    driver = Driver(mute=True)
    timed = f'<bml id="b"><speech id="s" start="0" end="{asked}"><text>{text}</text></speech></bml>'
    driver.send(timed)
    while answer(driver, voice):
        pass
    whole = [o for o in driver.spoken if o.request.seconds is not None]
    assert [o.request.ssml.strip() for o in whole] == [text.strip()]
    assert times(driver.run(60))["b:s:end"] == pytest.approx(asked, abs=0.01)


def test_expire_replaces_a_voice_that_does_not_answer_part_by_part() -> None:
    driver = Driver(mute=True)
    driver.send(BLOCK.format("b", "", TEXT, ""))
    driver.run(PATIENCE + 1)
    assert len(driver.spoken) == 2, "and asked for the next part"
    assert "b:start" in times(driver.clients[1])


def test_tts_requests_report_each_sync_once() -> None:
    driver = Driver(mute=True)
    driver.send(BLOCK.format("b", "", TEXT, NOD))
    while answer(driver):
        driver.run(driver.now + 0.3)
    ids = [f.id for f in driver.run(300).feedback if isinstance(f, SyncPointProgress)]
    assert len(ids) == len(set(ids))
    assert {"b:s:start", "b:s:m", "b:s:end"} <= set(ids)


ACTS = st.lists(
    st.one_of(
        st.tuples(st.just("say"), st.sampled_from(["", ' composition="APPEND"', ' composition="REPLACE"'])),
        st.tuples(st.just("answer"), st.sampled_from([0, 1])),
        st.tuples(st.just("fail"), st.just(0)),
        st.tuples(st.just("stop"), st.sampled_from(["b", "tie"])),
        st.tuples(st.just("tie"), st.sampled_from(["b:s:m", "b:s:end", "b:s:start"])),
        st.tuples(st.just("run"), st.sampled_from([0.1, 3.0, 30.0])),
    ),
    max_size=16,
)


@settings(max_examples=25, deadline=None)
@given(ACTS)
def test_tts_requests_finish_or_cut_off_every_text_in_any_order(acts) -> None:
    driver = Driver(mute=True, idle=False)
    driver.send({"type": "subscribe", "stream": "fap", "fps": 1})
    for act, what in acts:
        match act:
            case "say":
                driver.send(BLOCK.format("b", what, TEXT, NOD))
            case "answer":
                answer(driver)
            case "fail" if getattr(driver, "answered", 0) < len(driver.spoken):
                driver.answered = getattr(driver, "answered", 0) + 1
                driver.say(driver.spoken[driver.answered - 1].id, VoiceError("no"))
            case "stop":
                driver.send({"type": "stop", "blocks": [what]})
            case "tie":
                driver.send(f'<bml id="tie"><head id="n" lexeme="NOD" start="{what}"/></bml>')
            case "run":
                driver.run(driver.now + float(what))
    while answer(driver):
        driver.run(driver.now + 0.1)
    client = driver.run(driver.now + 100)
    faults = [f.text for f in client.feedback if isinstance(f, WarningFeedback)]
    assert not [text for text in faults if "internal" in text]
    assert driver.send({"type": "state"}).of("state")[-1]["blocks"] == []


def test_add_waits_for_an_earlier_block_that_needs_the_same(pending, speaking) -> None:
    speaking.resources = frozenset({"voice", "gaze"})

    def waits(text: str, needs: str, character: int = 0) -> bool:
        added = PendingBlock(block(text), character, 1.0, resources_of=lambda block: frozenset({needs}))
        pending.add(added)
        pending.remove([added])
        return speaking in added.predecessors

    assert waits('<bml id="b"/>', "gaze")
    assert not waits('<bml id="b"/>', "head")
    assert not waits('<bml id="b"/>', "gaze", character=1)
    bmla = 'xmlns:bmla="http://www.asap-project.org/bmla"'
    assert not waits(f'<bml id="b" {bmla} bmla:interrupt="a"/>', "gaze")
    speaking.is_incomplete = lambda block: True
    assert not waits('<bml id="b"/>', "gaze")


def test_add_makes_no_circle_of_blocks_that_wait_for_each_other(pending) -> None:
    bmla = 'xmlns:bmla="http://www.asap-project.org/bmla"'
    pending.add(PendingBlock(block('<bml id="b"><wait id="w" start="a:s:end"/></bml>'), 0, 1.0))
    text = f'<bml id="c" {bmla} bmla:prependBefore="a"><wait id="w" start="b:w:end"/></bml>'
    pending.add(PendingBlock(block(text), 0, 1.0))
    pending.blocks[0].requests.clear()
    order = []
    while (ready := pending.first_ready()) is not None:
        order.append(ready.block.id)
        pending.remove([ready])
    assert order == ["a", "b", "c"]


def test_add_waits_for_an_earlier_block_that_names_it(pending) -> None:
    pending.remove(pending.blocks)
    first = PendingBlock(block('<bml id="first"><wait id="w" start="later:w:end"/></bml>'), 0, 1.0)
    pending.add(first)
    pending.add(later := PendingBlock(block('<bml id="later"><wait id="w"/></bml>'), 1, 1.0))
    assert later.predecessors == {first}
    assert not first.predecessors


def test_replaced_by_returns_the_blocks_that_arrived_before(pending) -> None:
    pending.add(PendingBlock(block('<bml id="other"/>'), 1, 1.0))
    pending.add(new := PendingBlock(block('<bml id="r" composition="REPLACE"/>'), 0, 1.0))
    pending.add(PendingBlock(block('<bml id="later"/>'), 0, 1.0))
    assert [w.block.id for w in pending.replaced_by(new)] == ["a"]
