"""What blocks say is ordered from voices; long texts part by part, heard while the rest is being made."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bml_schema.feedback import PredictionFeedback, SyncPointProgress, WarningFeedback
from realizer.core.errors import VoiceError
from realizer.server.documents.tts_requests import PATIENCE
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.espeak.voice import EspeakVoice
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import SpeechRequest
from tests.realizer.server.conftest import RATE, Client, Driver

SENTENCE = "Number {} is here, and it is late; nobody knows why we should have been there. "
TEXT = "".join(SENTENCE.format(n) for n in range(20)) + '<sync id="m"/>And so on. ' + SENTENCE.format(99)
BLOCK = '<bml id="{}"{}><speech id="s"><text>{}</text></speech>{}</bml>'
NOD = '<head id="n" lexeme="NOD" stroke="s:m"/>'


@pytest.fixture(scope="module")
def voice():
    voice = EspeakVoice()
    yield voice
    voice.close()


def answer(driver: Driver, voice=None) -> bool:
    """Answer the next order; False where there is none."""
    answered = getattr(driver, "answered", 0)
    if answered == len(driver.spoken):
        return False
    driver.answered = answered + 1
    order = driver.spoken[answered]
    driver.say(order.id, speak_to_length(voice or SilentVoice(), order.say))
    return True


def times(client: Client) -> dict[str, float]:
    return {f.id: f.global_time for f in client.feedback if hasattr(f, "global_time")}


def ends(client: Client, block: str) -> list[float]:
    told = [b for f in client.feedback if isinstance(f, PredictionFeedback) for b in f.blocks]
    return [b.global_end for b in told if b.id == block and b.global_end is not None]


def test_the_first_clause_sounds_before_the_rest_is_made_and_all_of_it_is_what_was_made(voice) -> None:
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


def test_marks_are_told_when_they_sound_and_behaviours_come_with_them(voice) -> None:
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


def test_the_end_is_told_anew_with_every_part_and_is_right_at_last() -> None:
    driver = Driver(mute=True)
    driver.send(BLOCK.format("b", "", TEXT, ""))
    parts = 0
    while answer(driver):
        parts += 1
    told = list(dict.fromkeys(ends(driver.clients[1], "b")))
    assert len(told) == parts > 3
    assert told[-1] == pytest.approx(driver.session.player.speech()[0].utterance.duration)
    assert times(driver.run(300))["b:end"] == pytest.approx(told[-1])


def test_lips_move_in_every_part_and_do_not_jump_where_the_next_one_comes() -> None:
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


def test_a_block_that_is_stopped_orders_no_more() -> None:
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


def test_a_voice_that_fails_in_the_middle_leaves_silence_there_and_the_block_ends() -> None:
    driver = Driver(mute=True)
    driver.send(BLOCK.format("b", "", TEXT, ""))
    answer(driver)
    driver.say(driver.spoken[1].id, VoiceError("it died"))
    driver.answered = 2
    while answer(driver):
        pass
    client = driver.run(300)
    assert client.feedback[-1].id == "b:end"
    told = [(f.id, f.text) for f in client.feedback if isinstance(f, WarningFeedback)]
    assert told == [("b:s", "speech: it died; the silent voice is used instead")]
    assert driver.send({"type": "state"}).of("state")[-1]["voice"]["fault"] == "it died"


def test_a_part_that_comes_too_late_is_heard_when_it_comes() -> None:
    driver = Driver(mute=True)
    driver.send(BLOCK.format("b", "", TEXT, ""))
    answer(driver)
    made = driver.session.player.speech()[0].utterance.sections[0][1].duration
    driver.run(made + 2.0)
    answer(driver)
    parts = driver.session.player.speech()[0].utterance.sections
    assert parts[1][0] == pytest.approx(made + 2.05, abs=0.01)


def test_the_text_of_a_block_that_waits_is_made_meanwhile() -> None:
    driver = Driver(mute=True)
    driver.send('<bml id="a"><wait id="w" duration="3"/></bml>')
    driver.send(BLOCK.format("b", ' composition="APPEND"', TEXT, NOD))
    while answer(driver):
        pass
    assert driver.session.player.speech()[0].start == pytest.approx(3.0)
    at = times(driver.run(300))
    assert at["b:n:stroke"] == pytest.approx(at["b:s:m"])


def test_the_text_of_a_block_that_is_activated_later_is_whole() -> None:
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


def test_a_text_that_has_to_last_longer_is_said_again_in_one(voice) -> None:
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


def test_a_voice_that_does_not_answer_at_first_is_taken_for_silent_part_by_part() -> None:
    driver = Driver(mute=True)
    driver.send(BLOCK.format("b", "", TEXT, ""))
    driver.run(PATIENCE + 1)
    assert len(driver.spoken) == 2, "and asked for the next part"
    assert "b:start" in times(driver.clients[1])


def test_each_sync_is_told_once_though_its_time_was_told_again_and_again() -> None:
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
def test_in_any_order_every_text_is_made_to_its_end_or_cut_off(acts) -> None:
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
    client = driver.run(driver.now + 600)
    faults = [f.text for f in client.feedback if isinstance(f, WarningFeedback)]
    assert not [text for text in faults if "internal" in text]
    assert driver.send({"type": "state"}).of("state")[-1]["blocks"] == []
