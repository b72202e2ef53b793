"""Sessions without sockets: order of feedback, limits, voices, connections, and laws."""

from __future__ import annotations

import gc
import json
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema.feedback import BlockProgress, WarningFeedback
from realizer.animation.channel import Channel
from realizer.core.errors import VoiceError
from realizer.offline import realize
from realizer.playback.active_block import ActiveBlock
from realizer.playback.scheduled_speech import ScheduledSpeech
from realizer.protocol.wire import unpack
from realizer.speech.utterance import Phoneme, Utterance, Word
from tests.realizer.server.conftest import NOD, RATE, TALK, Driver, spoken
from tests.worst_documents import document

FAP = {"type": "subscribe", "stream": "fap"}
POINTS = ["start", "ready", "strokeStart", "stroke", "strokeEnd", "relax", "end"]


def warnings(client):
    return [f for f in client.feedback if isinstance(f, WarningFeedback)]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_session_reads_bml_and_control_messages_in_binary_messages(driver: Driver, encoding: str) -> None:
    client = driver.send(NOD.format("b").encode(encoding))
    assert [f.id for f in client.feedback if isinstance(f, BlockProgress)][:1] == ["b:start"]
    client = driver.send(json.dumps({"type": "ping"}).encode(encoding))
    assert client.of("pong")


# feedback ---------------------------------------------------------------------------------------


def test_session_reports_every_default_sync_point_once(driver) -> None:
    driver.send(NOD.format("b"))
    client = driver.run(10)
    progress = [id for id in client.ids if id != "prediction"]
    assert progress == ["b:start", *(f"b:n:{p}" for p in POINTS), "b:end"]
    assert [f.seq for f in client.feedback] == list(range(1, len(client.feedback) + 1))


def test_session_sends_feedback_at_its_time(driver) -> None:
    driver.run(1.25)
    driver.send(NOD.format("b"))
    client = driver.run(10)
    for message, time in zip(client.feedback, client.times, strict=True):
        if hasattr(message, "global_time"):
            assert time == pytest.approx(message.global_time, abs=1e-4)


def test_session_acknowledges_a_block_before_its_voice_answers() -> None:
    driver = Driver(mute=True)
    client = driver.send(TALK.format("b"))
    (acknowledged,) = client.feedback
    assert acknowledged.blocks[0].id == "b"
    assert acknowledged.blocks[0].global_end is None
    driver.say(driver.spoken[0].id, spoken())
    assert client.feedback[1].blocks[0].global_end == pytest.approx(1.0, abs=0.3)


def test_session_sends_only_feedback_without_subscriptions(driver) -> None:
    driver.send(TALK.format("b"))
    client = driver.run(10)
    assert all(isinstance(m, str) and m.startswith("<") for m in client.messages)


def test_session_accepts_an_id_again_after_the_end_of_its_block(driver) -> None:
    driver.send(NOD.format("b"))
    driver.run(10)
    driver.send(NOD.format("b"))
    client = driver.run(20)
    assert client.ids.count("b:end") == 2
    assert not warnings(client)


def test_session_plays_all_documents_of_a_message(driver) -> None:
    driver.send("\ufeff<?xml version='1.0'?><!-- two -->" + NOD.format("a") + NOD.format("b"))
    client = driver.run(10)
    assert {"a:end", "b:end"} <= set(client.ids)


@pytest.mark.parametrize(
    "broken", ["<bml id='x'><head", "hello", "<bml><head/></bml>", "<html/>", "<bml id='x'>\x00</bml>"]
)
def test_session_answers_a_broken_document_with_one_warning(driver, broken) -> None:
    client = driver.send(broken)
    assert len(warnings(client)) == 1
    assert warnings(client)[0].type == "PARSING_FAILURE"
    driver.send(NOD.format("b"))
    assert "b:end" in driver.run(10).ids
    assert not driver.closed


def test_session_reads_on_after_a_broken_document(driver) -> None:
    driver.send("<bml id='x'><head </bml>" + NOD.format("b"))
    client = driver.run(10)
    assert len(warnings(client)) == 1
    assert "b:end" in client.ids


def test_session_reports_a_bug_in_planning_with_the_id_of_the_block(driver, monkeypatch, caplog) -> None:
    def bug(*_):
        raise ZeroDivisionError("secret")

    monkeypatch.setattr(driver.session.player, "submit", bug)
    logged: list[str] = []
    monkeypatch.setattr(driver.session.journal, "note", lambda t, kind: logged.append(kind) or True)
    client = driver.send(NOD.format("b"))
    (warning,) = warnings(client)
    assert logged == ["tick", "tick"], "one reads it, one refuses it, and so does a replay"
    assert (warning.id, "internal error" in warning.text, "secret" in warning.text) == ("b", True, False)
    assert "ZeroDivisionError" in caplog.text


# limits -----------------------------------------------------------------------------------------


def test_session_refuses_a_document_over_the_limit(driver) -> None:
    driver.send(f'<bml id="big"><!--{"x" * 2**20}--></bml>')
    (warning,) = warnings(driver.clients[1])
    assert warning.id == "big"
    assert "1048576" in warning.text


def test_session_refuses_a_block_with_too_many_behaviours() -> None:
    driver = Driver(max_behaviours=2)
    waits = "".join(f'<wait id="w{i}"/>' for i in range(3))
    (warning,) = warnings(driver.send(f'<bml id="b">{waits}</bml>'))
    assert (warning.id, "at most 2" in warning.text) == ("b", True)


def test_session_refuses_a_block_that_lasts_too_long() -> None:
    driver = Driver(max_duration=60)
    driver.send('<bml id="a"><wait id="w" duration="50"/></bml>')
    client = driver.send('<bml id="b" composition="REPLACE"><wait id="w" duration="60.1"/></bml>')
    (warning,) = warnings(client)
    assert (warning.id, warning.type) == ("b", "CANNOT_CREATE_BEHAVIOR")
    assert "REALIZER_MAX_DURATION" in warning.text
    assert "a:end" not in client.ids
    driver.send('<bml id="b"><wait id="w" duration="60"/></bml>')  # whose id is free
    driver.run(61.0)
    assert {"a:end", "b:end"} <= set(client.ids)


def test_session_refuses_a_block_that_takes_too_many_steps() -> None:
    """With one warning, as offline; the next block plays."""
    text = document("linked", 30)
    driver = Driver(max_planning=2_000)
    client = driver.send(text)
    (warning,) = warnings(client)
    (offline,) = realize(text, max_planning=2_000).schedules[0].warnings
    assert (warning.id, warning.type, warning.text) == (offline.id, offline.type, offline.text)
    assert "REALIZER_MAX_PLANNING" in warning.text
    assert driver.session.submission.counts["over_limit"] == 1
    driver.send('<bml id="b"><head id="h" lexeme="NOD"/></bml>')
    driver.run(5.0)
    assert "b:end" in client.ids


@pytest.mark.parametrize(
    "holds",
    [
        '<faceShift id="f" end="1"><lexeme lexeme="SMILE"/></faceShift>',
        '<gazeShift id="g" target="left" end="1"/>',
        '<realizer:mood xmlns:realizer="urn:bml-realizer:1" id="m" name="joy"/>',
    ],
)
def test_session_holds_base_states_longer_than_blocks(holds: str) -> None:
    driver = Driver(max_duration=2)
    client = driver.send(f'<bml id="b">{holds}</bml>')
    driver.run(10.0)
    assert "b:end" in client.ids
    assert not [w for w in warnings(client) if "MAX_DURATION" in w.text]


def test_session_does_not_limit_the_duration_of_an_open_speech() -> None:
    driver = Driver(max_duration=2)
    client = driver.send({"type": "speech", "id": "turn", "append": "Hello. "})
    driver.run(10.0)
    driver.send({"type": "speech", "id": "turn", "append": "There. ", "close": True})
    driver.run(20.0)
    assert not warnings(client)
    assert "turn:end" in client.ids


def test_session_refuses_too_many_blocks() -> None:
    driver = Driver(max_blocks=2)
    for name in "abc":
        driver.send(NOD.format(name))
    assert [w.id for w in warnings(driver.clients[1])] == ["c"]


def test_session_refuses_too_many_characters(driver) -> None:
    for k in range(20):
        driver.send(f'<bml id="b{k}" characterId="c{k}"><wait id="w"/></bml>')
    assert {w.id for w in warnings(driver.clients[1])} == {f"b{k}" for k in range(16, 20)}


# voices -----------------------------------------------------------------------------------------


def test_session_does_not_delay_a_block_by_the_voice_of_another() -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("talk"))
    driver.send(NOD.format("nod"))
    assert "nod:start" in driver.clients[1].ids
    assert "talk:start" not in driver.clients[1].ids


@pytest.mark.parametrize(
    "later",
    [
        '<bml id="later" composition="APPEND"><head id="n" lexeme="NOD"/></bml>',
        '<bml id="later"><head id="n" lexeme="NOD" start="talk:s:end"/></bml>',
    ],
)
def test_session_delays_a_block_by_the_voice_of_its_predecessor(later) -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("talk"))
    driver.send(later)
    assert "later:start" not in driver.run(0.5).ids
    driver.say(driver.spoken[0].id, spoken(2.0))
    client = driver.run(10)
    assert not warnings(client)
    nod = next(f for f in client.feedback if getattr(f, "id", "") == "later:n:start")
    assert nod.global_time == pytest.approx(2.5, abs=0.2)


def test_session_replaces_blocks_that_wait_for_their_voice() -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("talk"))
    client = driver.send('<bml id="now" composition="REPLACE"><head id="n" lexeme="NOD"/></bml>')
    assert client.ids.index("talk:end") < client.ids.index("now:start")
    driver.say(driver.spoken[0].id, spoken())
    assert "talk:start" not in driver.run(10).ids


def test_on_speech_replaces_a_failed_voice_and_reports_it_once() -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("b"))
    driver.say(driver.spoken[0].id, VoiceError("no engine"))
    client = driver.run(10)
    assert "b:end" in client.ids
    assert [(w.id, "no engine" in w.text) for w in warnings(client)] == [("b:s", True)]
    driver.send({"type": "state"})
    assert client.of("state")[0]["voice"]["fault"] == "no engine"


def test_tick_replaces_a_voice_that_never_answers() -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("b"))
    assert "b:end" in driver.run(60).ids


# sound ------------------------------------------------------------------------------------------


def words(*timed: tuple[float, float, str]) -> Utterance:
    """Return the utterance of `spoken` with words."""
    return replace(spoken(timed[-1][1]), words=tuple(Word(*one) for one in timed))


HELLO = ((0.0, 0.3, "Hello"), (0.3, 0.6, "there"), (0.6, 1.0, "friend"))


@pytest.mark.parametrize(
    ("when", "said", "last"), [(0.1, "", None), (0.45, "Hello", "Hello"), (0.7, "Hello there", "there")]
)
def test_session_reports_the_spoken_words_of_an_interrupted_block(when, said, last) -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("b"))
    driver.say(driver.spoken[0].id, words(*HELLO))
    driver.run(when)
    driver.send({"type": "stop"})
    end = driver.clients[1].feedback[-1]
    assert (end.id, end.status, end.said, end.last_word) == ("b:end", "INTERRUPTED", said, last)


@pytest.mark.parametrize(
    "how",
    [
        '<bml id="i"><bmla:interrupt xmlns:bmla="http://www.asap-project.org/bmla" id="x" target="b"/></bml>',
        '<bml id="i" composition="REPLACE"><head id="n" lexeme="NOD"/></bml>',
        {"type": "stop", "blocks": ["b"]},
    ],
)
def test_session_silences_an_interrupted_block_within_50_ms(how) -> None:
    driver = Driver(mute=True, idle=False)
    driver.send({"type": "subscribe", "stream": "audio", "rate": RATE})
    driver.send(TALK.format("b"))
    driver.say(driver.spoken[0].id, replace(words(*HELLO), phonemes=(Phoneme(0.0, 1.0, "a"),)))
    driver.run(0.5)
    assert driver.session.player.frames(np.array([0.5])).faps.any()
    driver.send(how)
    client = driver.run(2.0)
    heard = heard_of(client)
    assert heard[round(0.48 * RATE) : round(0.5 * RATE)].any()
    assert not heard[round(0.55 * RATE) :].any()
    end = next(f for f in client.feedback if getattr(f, "id", "") == "b:end")
    assert end.global_time == pytest.approx(0.5, abs=1e-3)
    assert end.said == "Hello"
    frames = driver.session.player.frames(np.arange(0.5, 1.5, 0.04))
    assert not frames.faps[-1].any()


def heard_of(client, seconds: float = 3.0):
    """Return the sound that a client plays: packets at their times, flushed by the flag."""
    heard = np.zeros(round(seconds * RATE), np.int16)
    for frame in (f for f in client.frames if f.stream == "audio"):
        first = round(frame.time * RATE)
        if frame.flush:
            heard[first:] = 0
        heard[first : first + len(frame.values)] = frame.values
    return heard


def test_session_reports_no_words_of_a_complete_block() -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("b"))
    driver.say(driver.spoken[0].id, words(*HELLO))
    assert driver.run(3.0).feedback[-1].said is None


# sessions ---------------------------------------------------------------------------------------


def test_disconnect_closes_an_unnamed_session(driver) -> None:
    driver.leave(1)
    assert driver.session.closed


def test_is_expired_keeps_a_named_session_for_a_while() -> None:
    driver = Driver(named=True, keep=60.0)
    driver.leave(1)
    assert not driver.session.closed
    assert not driver.session.is_expired(driver.opened + 59)
    assert driver.session.is_expired(driver.opened + 60)


# laws -------------------------------------------------------------------------------------------

ACTIONS = st.one_of(
    st.tuples(st.just("wait"), st.floats(0, 1.5)),
    st.tuples(st.just("stall"), st.floats(0, 1.5)),
    st.tuples(st.just("nod"), st.sampled_from("abc")),
    st.tuples(st.just("talk"), st.sampled_from("abc")),
    st.tuples(st.just("replace"), st.sampled_from("abc")),
    st.tuples(st.just("answer"), st.integers(0, 3)),
    st.tuples(st.just("subscribe"), st.sampled_from(["fap", "au", "audio"])),
    st.tuples(st.just("slow"), st.sampled_from([0, 10**6])),
    st.tuples(st.just("broken"), st.just("<bml")),
    st.tuples(st.just("stop"), st.none()),
    st.tuples(st.just("close"), st.none()),
)


def act(driver: Driver, kind: str, value) -> None:
    match kind:
        case "wait":
            driver.run(driver.now + value)
        case "stall":
            driver.now += value
        case "nod":
            driver.send(NOD.format(value))
        case "talk":
            driver.send(TALK.format(value))
        case "replace":
            driver.send(NOD.format(value).replace("<bml", '<bml composition="REPLACE"'))
        case "answer" if value < len(driver.spoken):
            driver.say(driver.spoken[value].id, spoken())
        case "subscribe":
            driver.send({"type": "subscribe", "stream": value, "fps": 25})
        case "slow":
            driver.session.update_backlog(1, value)
        case "broken":
            driver.send(value)
        case "stop":
            driver.send({"type": "stop"})
        case "close":
            driver.session.close()


@given(st.lists(ACTIONS, max_size=14))
def test_session_numbers_frames_and_feedback_in_any_order_of_events(actions) -> None:
    driver, twin = Driver(mute=True), Driver(mute=True)
    closed = None
    for kind, value in actions:
        act(driver, kind, value)
        act(twin, kind, value)
        if driver.session.closed and closed is None:
            closed = len(driver.clients[1].messages)
    driver.run(driver.now + 1)
    twin.run(twin.now + 1)
    client = driver.clients[1]
    assert client.messages == twin.clients[1].messages, "the same inputs give the same bytes"
    if closed is not None:
        assert len(client.messages) == closed, "nothing comes after close"
    assert [f.seq for f in client.feedback] == list(range(1, len(client.feedback) + 1))
    for stream in ("fap", "au"):
        numbers = [f.frame for f in client.frames if f.stream == stream]
        assert numbers == sorted(set(numbers))
    for name in "abc":
        progress = [f.id for f in client.feedback if isinstance(f, BlockProgress) and f.id.startswith(name)]
        # A block may end without having started (it waited), never the other way round.
        running = 0
        for id in progress:
            running = running + 1 if id.endswith("start") else max(0, running - 1)
            assert running <= 1


def test_disconnect_ends_the_open_speech_of_the_client() -> None:
    driver = Driver(named=True)
    viewer = driver.join(2)
    driver.send({"type": "speech", "id": "turn", "append": "All that there is. "})
    driver.run(30)
    assert "turn.1:end" in viewer.ids
    assert "turn:end" not in viewer.ids
    driver.leave(1)
    driver.run(31)
    assert "turn:end" in viewer.ids


BMLA = 'xmlns:bmla="http://www.asap-project.org/bmla"'


def test_session_appends_a_block_after_one_in_preparation() -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("a"))
    driver.send(f'<bml id="b" {BMLA} bmla:appendAfter="a"/>')
    assert not any(id.endswith(":start") for id in driver.run(1).ids)
    driver.say(driver.spoken[0].id, spoken(2.0))
    times = {f.id: f.global_time for f in driver.run(9).feedback if isinstance(f, BlockProgress)}
    assert times["b:start"] == times["a:end"] == pytest.approx(3.0)


def test_session_prepends_a_block_before_one_in_preparation() -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("a"))
    driver.send(f'<bml id="b" {BMLA} bmla:prependBefore="a"><wait id="w" duration="1"/></bml>')
    driver.say(driver.spoken[0].id, spoken(2.0))
    times = {f.id: f.global_time for f in driver.run(9).feedback if isinstance(f, BlockProgress)}
    assert times["a:start"] == times["b:end"] == pytest.approx(1.0)


def test_session_interrupts_a_block_in_preparation() -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("a"))
    driver.send(f'<bml id="b" {BMLA}><bmla:interrupt id="i" target="a"/></bml>')
    driver.say(driver.spoken[0].id, spoken(2.0))
    progress = [f for f in driver.run(9).feedback if isinstance(f, BlockProgress) and f.id.startswith("a:")]
    assert [(f.id, f.status) for f in progress] == [("a:end", "REVOKED")]


def test_session_requests_a_stretched_speech_again() -> None:
    driver = Driver(mute=True)
    driver.send('<bml id="a"><speech id="s" start="0" end="3"><text>Hello there</text></speech></bml>')
    driver.send('<bml id="b" composition="APPEND"/>')
    driver.say(driver.spoken[0].id, replace(spoken(2.0), stretch=(0.6, 1.8)))
    assert [order.request.seconds for order in driver.spoken] == [None, pytest.approx(3.0)]
    assert not any(id.endswith(":start") for id in driver.run(1).ids)
    driver.say(driver.spoken[1].id, spoken(3.0))
    times = {f.id: f.global_time for f in driver.run(9).feedback if isinstance(f, BlockProgress)}
    assert times == {"a:start": 1.0, "a:end": 4.0, "b:start": 4.0, "b:end": 4.0}


def test_session_does_not_request_a_speech_a_third_time() -> None:
    driver = Driver(mute=True)
    driver.send('<bml id="a"><speech id="s" start="0" end="3"><text>Hello there</text></speech></bml>')
    driver.say(driver.spoken[0].id, replace(spoken(2.0), stretch=(0.6, 1.8)))
    driver.say(driver.spoken[1].id, replace(spoken(2.5), stretch=(0.6, 1.8)))
    client = driver.run(9)
    assert len(driver.spoken) == 2
    assert [w.id for w in client.feedback if isinstance(w, WarningFeedback)] == ["a:s"]
    assert "a:end" in client.ids


def test_session_stretches_a_late_speech_to_its_end() -> None:
    driver = Driver(mute=True)
    driver.send('<bml id="a"><faceLexeme id="f" lexeme="SMILE" start="0" end="4"/></bml>')
    driver.run(0.5)
    driver.send('<bml id="b"><speech id="s" start="0" end="a:f:end"><text>Hello</text></speech></bml>')
    driver.say(driver.spoken[0].id, replace(spoken(2.5), stretch=(0.6, 1.8)))
    driver.run(0.6)
    driver.say(driver.spoken[1].id, spoken(3.5))
    client = driver.run(9)
    assert not [f for f in client.feedback if isinstance(f, WarningFeedback)]
    times = {f.id: f.global_time for f in client.feedback if hasattr(f, "global_time")}
    assert times["b:s:end"] == pytest.approx(4.0)
    assert times["b:start"] == times["b:s:start"] == pytest.approx(0.6)


# messages ---------------------------------------------------------------------------------------


def test_session_answers_an_invalid_binary_message_with_an_error(driver) -> None:
    client = driver.send(b"\x04\x01 sound")
    assert client.of("error")[0]["code"] == "unsupported"


def test_session_refuses_documents_while_the_service_ends(driver) -> None:
    driver.session.is_ending = True
    (warning,) = warnings(driver.send(NOD.format("b")))
    assert "ending" in warning.text
    assert warning.seq is None, "another service, that goes on with the session, would not count it"


@pytest.mark.parametrize("message", ["ping", "state", "stop", "unsubscribe"])
def test_receive_sends_what_is_due_before_it_handles_a_late_message(driver, message) -> None:
    driver.send(FAP | {"fps": 25})
    driver.send('<bml id="b"><wait id="w" duration="0.5"/></bml>')
    client = driver.run(0.49)
    before, driver.now = len(client.messages), 0.53  # nobody has woken it at 0.5 and at 0.52
    driver.send({"type": message, "stream": "fap"} if message == "unsubscribe" else {"type": message})
    point, end, frame = client.messages[before : before + 3]
    assert 'id="b:w:end"' in point
    assert 'status="DONE"' in end
    assert unpack(frame).frame == 13


# memory -----------------------------------------------------------------------------------------

SPOKEN = """<bml id="b{}"><speech id="told"><text>Hello there</text></speech>
<head id="h" lexeme="NOD" start="told:start"/><faceLexeme id="f" lexeme="SMILE" end="told:end"/></bml>"""


def alive_of_speeches() -> Counter[type]:
    gc.collect()
    found = [
        o for o in gc.get_objects() if isinstance(o, Channel | ActiveBlock | ScheduledSpeech | Utterance)
    ]
    return Counter(type(o) for o in found if not isinstance(o, Channel) or str(o.source).endswith("told"))


def play_spoken(driver: Driver, number: int) -> None:
    sound = spoken()
    phonemes = tuple(Phoneme(k / 5, (k + 1) / 5, ipa) for k, ipa in enumerate("hɛloʊ"))
    driver.send(SPOKEN.format(number))
    driver.say(number, Utterance(1.0, (Word(0.0, 1.0, "Hello"),), phonemes, {}, RATE, sound.pcm))
    driver.run(driver.now + 8.0)


def test_session_keeps_nothing_of_documents_that_have_ended() -> None:
    driver = Driver(mute=True)
    driver.send({"type": "subscribe", "stream": "fap", "fps": 25})
    driver.send({"type": "subscribe", "stream": "audio"})
    for number in range(1, 4):
        play_spoken(driver, number)
    before = alive_of_speeches()
    for number in range(4, 9):
        play_spoken(driver, number)
    assert "b8:end" in driver.clients[1].ids
    assert not alive_of_speeches() - before
