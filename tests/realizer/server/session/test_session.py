"""The laws of a session, without sockets: order, once each, nothing after close, faults kept small."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bml_schema.feedback import BlockProgress, WarningFeedback
from realizer.core.errors import RenderError, VoiceError
from realizer.protocol.wire import unpack
from realizer.server.journal.entry import Entry, JournalError, TakenOver
from realizer.server.journal.journal_writer import JournalWriter
from realizer.server.journal.sqlite_journal import SqliteJournal
from realizer.server.session import feedback_log
from realizer.server.session.effects import Close
from realizer.speech.utterance import Phoneme, Utterance, Word
from tests.realizer.server.conftest import NOD, RATE, TALK, Driver, spoken

FAP = {"type": "subscribe", "stream": "fap"}
POINTS = ["start", "ready", "strokeStart", "stroke", "strokeEnd", "relax", "end"]


def warnings(client):
    return [f for f in client.feedback if isinstance(f, WarningFeedback)]


# feedback ---------------------------------------------------------------------------------------


def test_every_default_sync_point_is_reported_once_between_start_and_end(driver) -> None:
    driver.send(NOD.format("b"))
    client = driver.run(10)
    progress = [id for id in client.ids if id != "prediction"]
    assert progress == ["b:start", *(f"b:n:{p}" for p in POINTS), "b:end"]
    assert [f.seq for f in client.feedback] == list(range(1, len(client.feedback) + 1))


def test_feedback_comes_at_its_time(driver) -> None:
    driver.run(1.25)
    driver.send(NOD.format("b"))
    client = driver.run(10)
    for message, time in zip(client.feedback, client.times, strict=True):
        if hasattr(message, "global_time"):
            assert time == pytest.approx(message.global_time, abs=1e-4)


def test_the_first_prediction_is_the_acknowledgement_and_comes_before_the_voice() -> None:
    driver = Driver(mute=True)
    client = driver.send(TALK.format("b"))
    (acknowledged,) = client.feedback
    assert acknowledged.blocks[0].id == "b"
    assert acknowledged.blocks[0].global_end is None
    driver.say(driver.spoken[0].id, spoken())
    assert client.feedback[1].blocks[0].global_end == pytest.approx(1.0, abs=0.3)


def test_a_client_that_only_sends_bml_gets_feedback_and_nothing_else(driver) -> None:
    driver.send(TALK.format("b"))
    client = driver.run(10)
    assert all(isinstance(m, str) and m.startswith("<") for m in client.messages)


def test_an_id_is_free_again_after_the_end(driver) -> None:
    driver.send(NOD.format("b"))
    driver.run(10)
    driver.send(NOD.format("b"))
    client = driver.run(20)
    assert client.ids.count("b:end") == 2
    assert not warnings(client)


def test_several_documents_in_one_message_are_all_played(driver) -> None:
    driver.send("\ufeff<?xml version='1.0'?><!-- two -->" + NOD.format("a") + NOD.format("b"))
    client = driver.run(10)
    assert {"a:end", "b:end"} <= set(client.ids)


@pytest.mark.parametrize(
    "broken", ["<bml id='x'><head", "hello", "<bml><head/></bml>", "<html/>", "<bml id='x'>\x00</bml>"]
)
def test_a_broken_document_gives_one_warning_and_the_connection_lives(driver, broken) -> None:
    client = driver.send(broken)
    assert len(warnings(client)) == 1
    assert warnings(client)[0].type == "PARSING_FAILURE"
    driver.send(NOD.format("b"))
    assert "b:end" in driver.run(10).ids
    assert not driver.closed


def test_reading_goes_on_after_a_broken_stretch(driver) -> None:
    driver.send("<bml id='x'><head </bml>" + NOD.format("b"))
    client = driver.run(10)
    assert len(warnings(client)) == 1
    assert "b:end" in client.ids


def test_a_bug_while_planning_is_told_with_the_blocks_id(driver, monkeypatch, caplog) -> None:
    def bug(*_):
        raise ZeroDivisionError("secret")

    monkeypatch.setattr(driver.session.player, "submit", bug)
    client = driver.send(NOD.format("b"))
    (warning,) = warnings(client)
    assert (warning.id, "internal error" in warning.text, "secret" in warning.text) == ("b", True, False)
    assert "ZeroDivisionError" in caplog.text


# limits -----------------------------------------------------------------------------------------


def test_a_document_over_the_limit_is_a_warning_with_its_id(driver) -> None:
    driver.send(f'<bml id="big"><!--{"x" * 2**20}--></bml>')
    (warning,) = warnings(driver.clients[1])
    assert warning.id == "big"
    assert "1048576" in warning.text


def test_a_block_with_too_many_behaviours_is_refused() -> None:
    driver = Driver(max_behaviours=2)
    waits = "".join(f'<wait id="w{i}"/>' for i in range(3))
    (warning,) = warnings(driver.send(f'<bml id="b">{waits}</bml>'))
    assert (warning.id, "at most 2" in warning.text) == ("b", True)


def test_a_block_that_would_last_too_long_is_refused_and_ends_nobody() -> None:
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


@pytest.mark.parametrize(
    "holds",
    [
        '<faceShift id="f" end="1"><lexeme lexeme="SMILE"/></faceShift>',
        '<gazeShift id="g" target="left" end="1"/>',
        '<realizer:mood xmlns:realizer="urn:bml-realizer:1" id="m" name="joy"/>',
    ],
)
def test_a_base_state_holds_for_longer_than_any_block_may_last(holds: str) -> None:
    driver = Driver(max_duration=2)
    client = driver.send(f'<bml id="b">{holds}</bml>')
    driver.run(10.0)
    assert "b:end" in client.ids
    assert not [w for w in warnings(client) if "MAX_DURATION" in w.text]


def test_a_speech_that_is_left_open_is_no_block_that_lasts_too_long() -> None:
    driver = Driver(max_duration=2)
    client = driver.send({"type": "speech", "id": "turn", "append": "Hello. "})
    driver.run(10.0)
    driver.send({"type": "speech", "id": "turn", "append": "There. ", "close": True})
    driver.run(20.0)
    assert not warnings(client)
    assert "turn:end" in client.ids


def test_too_many_blocks_at_a_time_are_refused() -> None:
    driver = Driver(max_blocks=2)
    for name in "abc":
        driver.send(NOD.format(name))
    assert [w.id for w in warnings(driver.clients[1])] == ["c"]


def test_too_many_characters_are_refused(driver) -> None:
    for k in range(20):
        driver.send(f'<bml id="b{k}" characterId="c{k}"><wait id="w"/></bml>')
    assert {w.id for w in warnings(driver.clients[1])} == {f"b{k}" for k in range(16, 20)}


def test_binary_in_is_answered_with_an_error(driver) -> None:
    client = driver.send(b"\x04\x01 sound")
    assert client.of("error")[0]["code"] == "unsupported"


def test_no_documents_are_taken_while_the_service_ends(driver) -> None:
    driver.session.ending = True
    (warning,) = warnings(driver.send(NOD.format("b")))
    assert "ending" in warning.text
    assert warning.seq is None, "another service, that goes on with the session, would not count it"


def test_what_is_not_kept_has_no_number_and_leaves_what_is_told_as_it_was() -> None:
    class Full(SqliteJournal):
        full = False

        def add(self, session: str, entry: Entry) -> None:
            if self.full:
                raise JournalError("no room")
            super().add(session, entry)

    driver, journal = Driver(named=True), Full(":memory:")
    driver.session.journal = JournalWriter("test", journal)
    driver.session.journal.begin(0.0)
    client = driver.send({"type": "speech", "id": "turn", "append": "One. "})
    journal.full = True
    driver.send('<bml id="turn"><wait id="w"/></bml>')
    journal.full = False
    driver.send({"type": "speech", "id": "turn", "append": "Two.", "close": True})
    driver.run(10)
    (warning,) = warnings(client)
    assert (warning.id, warning.seq) == ("turn", None)
    assert "no room" in warning.text
    told = sorted(f.seq for f in client.feedback if f.seq is not None)
    assert len(told) == len(client.feedback) - 1
    assert told == list(range(1, len(told) + 1))
    assert "turn.2:end" in client.ids, "the speech of that name goes on"


# voices -----------------------------------------------------------------------------------------


def test_a_later_block_does_not_wait_for_the_voice_of_an_earlier_one() -> None:
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
def test_a_block_that_depends_on_one_waits_for_its_voice(later) -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("talk"))
    driver.send(later)
    assert "later:start" not in driver.run(0.5).ids
    driver.say(driver.spoken[0].id, spoken(2.0))
    client = driver.run(10)
    assert not warnings(client)
    nod = next(f for f in client.feedback if getattr(f, "id", "") == "later:n:start")
    assert nod.global_time == pytest.approx(2.5, abs=0.2)


def test_a_replacing_block_ends_those_that_still_wait_for_their_voice() -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("talk"))
    client = driver.send('<bml id="now" composition="REPLACE"><head id="n" lexeme="NOD"/></bml>')
    assert client.ids.index("talk:end") < client.ids.index("now:start")
    driver.say(driver.spoken[0].id, spoken())
    assert "talk:start" not in driver.run(10).ids


def test_stop_ends_what_plays_and_what_waits() -> None:
    driver = Driver(mute=True)
    driver.send(NOD.format("nod"))
    driver.send(TALK.format("talk"))
    driver.run(0.1)
    client = driver.send({"type": "stop"})
    assert {"nod:end", "talk:end"} <= set(client.ids)
    driver.say(driver.spoken[0].id, spoken())
    assert client.ids == driver.run(10).ids


def test_stop_by_name_leaves_the_others() -> None:
    driver = Driver()
    driver.send(NOD.format("a"))
    driver.send(NOD.format("b"))
    client = driver.send({"type": "stop", "blocks": ["a"]})
    assert "a:end" in client.ids
    assert "b:end" not in client.ids


def test_a_voice_that_fails_is_replaced_by_silence_and_told_in_one_warning_and_in_state() -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("b"))
    driver.say(driver.spoken[0].id, VoiceError("no engine"))
    client = driver.run(10)
    assert "b:end" in client.ids
    assert [(w.id, "no engine" in w.text) for w in warnings(client)] == [("b:s", True)]
    driver.send({"type": "state"})
    assert client.of("state")[0]["voice"]["fault"] == "no engine"


def test_a_voice_that_never_answers_is_replaced_by_silence() -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("b"))
    assert "b:end" in driver.run(60).ids


def test_a_character_speaks_with_the_voice_it_was_given() -> None:
    driver = Driver(mute=True)
    driver.send({"type": "character", "id": "Ada", "voice": "silent"})
    driver.send(TALK.format("b").replace("<bml", '<bml characterId="Ada"'))
    assert driver.spoken[0].request.voice == "silent"


# streams ----------------------------------------------------------------------------------------


def test_frames_are_numbered_by_the_clock_and_sent_at_their_time(driver) -> None:
    driver.run(0.5)
    driver.send({**FAP, "fps": 25})
    client = driver.run(2.0)
    frames = client.frames
    assert [f.frame for f in frames] == list(range(13, 51))
    sent = client.times[-len(frames) :]
    assert [f.time for f in frames] == pytest.approx(sent, abs=1e-4)
    assert all(len(f.values) == 68 for f in frames)


def test_json_and_binary_say_the_same(driver) -> None:
    driver.join(2)
    driver.send({**FAP, "encoding": "json"}, 1)
    driver.send(FAP, 2)
    driver.send(NOD.format("b"))
    driver.run(1.0)
    texts, frames = driver.clients[1].of("fap"), driver.clients[2].frames
    assert [t["values"] for t in texts] == [f.values.tolist() for f in frames]
    assert [t["time"] for t in texts] == pytest.approx([f.time for f in frames])


def test_the_stream_shows_what_was_sent(driver) -> None:
    names = driver.send({**FAP, "encoding": "json"}).of("subscribed")[0]["names"]
    pitch = names.index("head_pitch")
    driver.run(0.5)
    driver.send(NOD.format("b"))
    client = driver.run(2.0)
    rows = [t["values"][pitch] for t in client.of("fap")]
    assert max(map(abs, rows)) > 3 * max(map(abs, rows[:12])) + 100


def test_idle_frames_come_without_any_document(driver) -> None:
    driver.send({"type": "subscribe", "stream": "au", "fps": 10})
    values = np.stack([f.values for f in driver.run(20).frames])
    assert values.shape[0] >= 200
    assert values.max() > 0.5, "an idle face blinks"


def test_action_units_come_as_shown_or_as_asked_for(driver) -> None:
    def jaw_and_lips(asked: bool) -> list[float]:
        told = driver.send({"type": "subscribe", "stream": "au", "encoding": "json", "asked": asked})
        names = told.of("subscribed")[-1]["names"]
        values = driver.run(driver.now + 1.0).of("au")[-1]["values"]
        return [values[names.index("25")], values[names.index("26")]]

    driver.send({"type": "set", "aus": {"25": 1.0, "26": 1.0}})
    assert jaw_and_lips(asked=False) == [0.0, 1.0]
    assert jaw_and_lips(asked=True) == [1.0, 1.0]


def test_unsubscribe_ends_a_stream(driver) -> None:
    driver.send(FAP)
    driver.run(0.2)
    count = len(driver.send({"type": "unsubscribe", "stream": "fap"}).frames)
    assert len(driver.run(1.0).frames) == count


def test_a_viewer_can_switch_feedback_off(driver) -> None:
    viewer = driver.join(2)
    driver.send({"type": "unsubscribe", "stream": "feedback"}, 2)
    driver.send(NOD.format("b"))
    driver.run(10)
    assert not viewer.feedback
    assert driver.clients[1].feedback


def test_a_slow_client_loses_frames_counted_and_never_feedback(driver) -> None:
    driver.session.update_backlog(1, 10**6)
    driver.send(FAP)
    driver.send(NOD.format("b"))
    client = driver.run(10)
    assert not client.frames
    assert "b:end" in client.ids
    driver.session.update_backlog(1, 0)
    driver.run(11)
    assert [f.frame for f in client.frames] == list(range(251, 276))
    driver.send({"type": "state"})
    assert client.of("state")[0]["dropped"] == 251


def test_a_client_that_never_reads_is_closed(driver) -> None:
    driver.session.update_backlog(1, 10**9)
    driver.collect()
    assert [c.connection for c in driver.closed] == [1]


def test_a_stalled_process_does_not_catch_up_with_seconds_of_frames(driver) -> None:
    driver.send({**FAP, "fps": 25})
    driver.now = 5.0
    driver.session.tick(driver.opened + 5.0)
    driver.collect()
    numbers = [f.frame for f in driver.clients[1].frames]
    assert numbers[-1] == 125
    assert len(numbers) < 20


def test_two_characters_have_their_own_index(driver) -> None:
    driver.send('<bml id="a" characterId="Ada"><wait id="w"/></bml>')
    driver.send('<bml id="b" characterId="Bob"><faceLexeme id="f" lexeme="SMILE" end="3"/></bml>')
    client = driver.send({"type": "subscribe", "stream": "au", "character": "Bob"})
    assert client.of("subscribed")[0]["index"] == 1
    assert {f.character for f in driver.run(1.0).frames} == {1}


# sound ------------------------------------------------------------------------------------------


def sound_of(client):
    return [f for f in client.frames if f.stream == "audio"]


def test_sound_comes_in_packets_at_most_a_tenth_ahead_and_not_in_silence(driver) -> None:
    driver.send({"type": "subscribe", "stream": "audio"})
    driver.run(0.5)
    assert not sound_of(driver.clients[1])
    driver.send(TALK.format("b"))
    client = driver.run(5)
    packets = sound_of(client)
    assert len(packets) in (50, 51)
    assert all(len(p.values) == RATE // 50 for p in packets)
    assert [p.time for p in packets] == pytest.approx([p.frame * 0.02 for p in packets])
    sent = [t for t, m in zip(client.times, client.messages, strict=True) if isinstance(m, bytes)]
    assert all(p.time - t <= 0.1 + 1e-6 for p, t in zip(packets, sent, strict=True))


def test_the_packets_together_are_what_was_spoken(driver) -> None:
    driver.send({"type": "subscribe", "stream": "audio"})
    client = driver.send(TALK.format("b"))
    packets = sound_of(driver.run(5))
    start = next(f for f in client.feedback if getattr(f, "id", "") == "b:s:start").global_time
    heard = np.concatenate([p.values for p in packets])
    first = round((start - packets[0].time) * RATE)
    pcm = spoken().pcm
    assert np.array_equal(heard[first : first + len(pcm)], pcm)


def test_stop_takes_back_the_sound_that_was_sent_ahead(driver) -> None:
    driver.send({"type": "subscribe", "stream": "audio"})
    driver.send(TALK.format("b"))
    driver.run(0.5)
    before = len(sound_of(driver.clients[1]))
    driver.send({"type": "stop"})
    after = sound_of(driver.run(5))[before:]
    assert after[0].flush
    assert after[0].time == pytest.approx(0.5, abs=0.021)
    assert after[-1].time < 0.6
    assert abs(int(after[-1].values[-1])) < 2000, "it fades out"


def words(*timed: tuple[float, float, str]) -> Utterance:
    """What `spoken` gives, as long as its last word, with words."""
    return replace(spoken(timed[-1][1]), words=tuple(Word(*one) for one in timed))


HELLO = ((0.0, 0.3, "Hello"), (0.3, 0.6, "there"), (0.6, 1.0, "friend"))


@pytest.mark.parametrize(
    ("when", "said", "last"), [(0.1, "", None), (0.45, "Hello", "Hello"), (0.7, "Hello there", "there")]
)
def test_the_end_of_an_interrupted_block_says_the_last_word(when, said, last) -> None:
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
def test_sound_stops_within_50_ms_of_any_interruption_and_the_face_relaxes(how) -> None:
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
    """What a client plays: packets by their time; from one with the flag on everything is forgotten."""
    heard = np.zeros(round(seconds * RATE), np.int16)
    for frame in (f for f in client.frames if f.stream == "audio"):
        first = round(frame.time * RATE)
        if frame.flush:
            heard[first:] = 0
        heard[first : first + len(frame.values)] = frame.values
    return heard


def test_a_block_that_was_heard_to_its_end_says_nothing_of_it() -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("b"))
    driver.say(driver.spoken[0].id, words(*HELLO))
    assert driver.run(3.0).feedback[-1].said is None


# pictures ---------------------------------------------------------------------------------------


def test_the_newest_frame_is_drawn_and_late_ones_are_skipped(driver) -> None:
    client = driver.send({"type": "subscribe", "stream": "video", "size": [64, 64], "fps": 10})
    driver.run(1.0)
    (first,) = driver.draws
    assert first.options.size == (64, 64)
    assert first.pose.shape == (68,)
    driver.session.on_picture(first.id, b"jpeg", driver.opened + 1.0)
    driver.collect()
    assert [(f.frame, f.payload) for f in client.frames] == [(0, b"jpeg")]
    assert len(driver.draws) == 2
    driver.session.on_picture(driver.draws[1].id, b"next", driver.opened + 1.05)
    driver.collect()
    assert client.frames[-1].frame == 10
    driver.send({"type": "state"})
    assert client.of("state")[0]["dropped"] == 9


def test_a_picture_is_drawn_once_for_all_who_look_at_it(driver) -> None:
    driver.join(2)
    for connection in (1, 2):
        driver.send({"type": "subscribe", "stream": "video", "fps": 10}, connection)
    driver.run(0.05)
    assert len(driver.draws) == 1
    driver.session.on_picture(driver.draws[0].id, b"jpeg", driver.opened + 0.05)
    driver.collect()
    assert [len(driver.clients[c].frames) for c in (1, 2)] == [1, 1]


def test_pictures_that_cannot_be_drawn_end_with_one_error(driver) -> None:
    client = driver.send({"type": "subscribe", "stream": "video"})
    driver.run(0.1)
    driver.session.on_picture(driver.draws[0].id, RenderError("install EGL"), driver.opened + 0.1)
    driver.collect()
    driver.run(2.0)
    assert [e["message"] for e in client.of("error")] == ["install EGL"]
    assert len(driver.draws) == 1


def test_a_picture_of_absurd_size_is_refused(driver) -> None:
    client = driver.send({"type": "subscribe", "stream": "video", "size": [100000, 100000]})
    assert client.of("error")[0]["where"] == "subscribe.size"


def test_who_asks_for_another_light_gets_pictures_of_its_own(driver) -> None:
    driver.join(2)
    driver.send({"type": "subscribe", "stream": "video"}, 1)
    look = {"camera": "profile", "light": "evening", "background": "#102030"}
    driver.send({"type": "subscribe", "stream": "video", **look}, 2)
    driver.run(0.05)
    plain, own = (draw.options for draw in driver.draws)
    assert (plain.camera, plain.light, plain.background) == ("front", None, None)
    assert (own.camera, own.light, own.background) == ("profile", "evening", "#102030")


def test_a_light_that_is_not_there_is_refused_with_those_that_are(driver) -> None:
    client = driver.send({"type": "subscribe", "stream": "video", "light": "noon"})
    (error,) = client.of("error")
    assert error["where"] == "subscribe.light"
    assert "portrait, daylight, evening" in error["message"]


# sessions ---------------------------------------------------------------------------------------


def test_a_client_that_comes_back_gets_what_it_missed() -> None:
    driver = Driver(named=True)
    driver.send(NOD.format("b"))
    driver.run(0.2)
    driver.leave(1)
    driver.run(10)
    whole = driver.session.feedback_log.newest
    again = driver.join(2, seen=2)
    assert [f.seq for f in again.feedback] == list(range(3, whole + 1))
    assert again.ids[-1] == "b:end"


def test_hello_with_seen_sends_what_followed(driver) -> None:
    driver.send(NOD.format("b"))
    driver.run(10)
    viewer = driver.join(2)
    assert not viewer.feedback
    driver.send({"type": "hello", "session": "test", "seen": 1}, 2)
    assert viewer.of("welcome")[0]["session"] == "test"
    assert [f.seq for f in viewer.feedback] == list(range(2, 14))


def test_what_is_no_longer_there_is_a_gap(driver, monkeypatch) -> None:
    monkeypatch.setattr(feedback_log, "MOST", 5)
    monkeypatch.setattr(feedback_log, "PACK", 1)  # whole packs go
    driver.send(NOD.format("b"))
    driver.run(10)
    viewer = driver.join(2, seen=2)
    assert viewer.of("gap") == [{"type": "gap", "seen": 2, "first": 9}]
    assert [f.seq for f in viewer.feedback] == [9, 10, 11, 12, 13]


def test_seen_of_another_life_is_a_gap(driver) -> None:
    viewer = driver.join(2, seen=500)
    assert viewer.of("gap") == [{"type": "gap", "seen": 500, "first": 1}]


def test_all_connections_of_a_session_get_its_feedback(driver) -> None:
    viewer = driver.join(2)
    driver.send(NOD.format("b"), 1)
    driver.run(10)
    assert viewer.messages == driver.clients[1].messages


def test_a_session_nobody_named_ends_with_its_connection(driver) -> None:
    driver.leave(1)
    assert driver.session.closed


def test_a_named_session_is_kept_for_a_while() -> None:
    driver = Driver(named=True, keep=60.0)
    driver.leave(1)
    assert not driver.session.closed
    assert not driver.session.is_expired(driver.opened + 59)
    assert driver.session.is_expired(driver.opened + 60)


# control ----------------------------------------------------------------------------------------


def test_another_version_is_refused(driver) -> None:
    (error,) = driver.send({"type": "hello", "version": 7}).of("error")
    assert (error["where"], "got 7" in error["message"]) == ("hello.version", True)


def test_ping_tells_the_time_of_the_session(driver) -> None:
    driver.run(2.5)
    assert driver.send({"type": "ping", "id": 9}).of("pong") == [{"type": "pong", "id": 9, "time": 2.5}]


def test_a_scene_makes_unknown_targets_a_warning_and_known_ones_not(driver) -> None:
    gaze = '<bml id="{}"><gaze id="g" target="{}" start="0" end="0.5"/></bml>'
    driver.send(gaze.format("a", "cup"))
    driver.run(1)
    driver.send({"type": "scene", "objects": {"cup": {"x": 0.3, "y": 0, "z": 1}}})
    driver.send(gaze.format("b", "cup"))
    driver.run(2)
    driver.send(gaze.format("c", "moon"))
    found = warnings(driver.run(5))
    assert [(w.id, w.type) for w in found] == [("c:g", "NO_SUCH_TARGET")]
    assert "c:end" in driver.clients[1].ids


def test_set_holds_an_au_until_it_is_let_go(driver) -> None:
    names = driver.send({"type": "subscribe", "stream": "au", "fps": 25}).of("subscribed")[0]["names"]
    driver.send({"type": "set", "aus": {"12L": 0.8}})
    client = driver.run(1)
    left, right = names.index("12L"), names.index("12R")
    assert client.frames[-1].values[left] == pytest.approx(0.8, abs=0.05)
    assert client.frames[-1].values[right] < 0.1
    driver.send({"type": "set", "aus": {"12L": None}})
    assert driver.run(2).frames[-1].values[left] < 0.1


@pytest.mark.parametrize(
    ("message", "where"),
    [
        ({"type": "set", "aus": {"99": 0.5}}, "set.aus"),
        ({"type": "set", "faps": {"nose_hair": 5}}, "set.faps"),
        ({"type": "set", "faps": {"1": 5}}, "set.faps"),
        ({"type": "subscribe", "stream": "mesh", "encoding": "json"}, "subscribe.encoding"),
        ({"type": "character", "id": "Ada", "face": "nobody"}, "character.face"),
    ],
)
def test_a_control_message_that_cannot_be_followed_says_where(driver, message, where) -> None:
    (error,) = driver.send(message).of("error")
    assert error["where"] == where


def test_state_says_what_plays_and_what_waits() -> None:
    driver = Driver(mute=True)
    driver.send(NOD.format("nod"))
    driver.send(TALK.format("talk"))
    driver.run(0.2)
    (state,) = driver.send({"type": "state"}).of("state")
    assert {b["id"]: b["status"] for b in state["blocks"]} == {"nod": "IN_EXEC", "talk": "IN_PREP"}
    assert state["connections"] == 1


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


@settings(max_examples=40, deadline=None)
@given(st.lists(ACTIONS, max_size=14))
def test_in_any_order_of_events_frames_rise_and_feedback_is_whole(actions) -> None:
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


def test_one_who_joins_a_session_that_another_process_has_is_sent_there_with_all_others() -> None:
    class Taken(SqliteJournal):
        def add(self, session: str, entry: Entry) -> None:
            raise TakenOver("another process has it")

    driver = Driver(named=True)
    driver.session.journal = JournalWriter("test", Taken(":memory:"))
    driver.join(2)
    assert driver.closed == [Close(k, 1012, "another process has it") for k in (1, 2)]


def test_the_speech_of_one_who_leaves_ends_though_nothing_else_is_due() -> None:
    driver = Driver(named=True)
    viewer = driver.join(2)
    driver.send({"type": "speech", "id": "turn", "append": "All that there is. "})
    driver.run(30)
    assert "turn.1:end" in viewer.ids
    assert "turn:end" not in viewer.ids
    driver.leave(1)
    driver.run(31)
    assert "turn:end" in viewer.ids


def test_a_feedback_stream_that_is_asked_for_again_begins_with_what_follows(driver) -> None:
    driver.send({"type": "unsubscribe", "stream": "feedback"})
    driver.send(NOD.format("a"))
    client = driver.run(10)
    assert not client.feedback
    told = driver.session.feedback_log.newest
    driver.send({"type": "subscribe", "stream": "feedback"})
    assert not client.feedback
    driver.send(NOD.format("b"))
    driver.run(20)
    assert [f.seq for f in client.feedback] == list(range(told + 1, driver.session.feedback_log.newest + 1))


def test_a_feedback_stream_can_be_narrowed_to_some_elements(driver) -> None:
    viewer = driver.join(2)
    asked = {"type": "subscribe", "stream": "feedback", "elements": ["blockProgress"]}
    assert driver.send(asked, 2).of("subscribed")[0]["elements"] == ["blockProgress"]
    driver.send(NOD.format("b"))
    driver.run(5)
    assert viewer.ids == ["b:start", "b:end"]
    assert len(driver.clients[1].ids) > 2
    numbers = [f.seq for f in viewer.feedback]
    assert numbers == sorted(numbers)
    assert numbers != list(range(1, len(numbers) + 1)), "what was left out keeps its number"


def test_a_feedback_stream_can_be_narrowed_to_a_character(driver) -> None:
    viewer = driver.join(2)
    driver.send({"type": "subscribe", "stream": "feedback", "character": "Ann"}, 2)
    driver.send('<bml id="a" characterId="Ann"/>')
    driver.send('<bml id="b" characterId="Bob"/>')
    driver.send("<bml/>")
    driver.run(1)
    assert {f.character_id for f in viewer.feedback} == {"Ann", None}
    assert not any("b:" in id for id in viewer.ids)


def test_all_feedback_comes_back_when_no_element_is_named(driver) -> None:
    driver.send({"type": "subscribe", "stream": "feedback", "elements": ["warningFeedback"]})
    driver.send({"type": "subscribe", "stream": "feedback"})
    driver.send(NOD.format("b"))
    driver.run(5)
    assert "b:end" in driver.clients[1].ids


def test_an_unknown_feedback_element_is_an_error(driver) -> None:
    told = driver.send({"type": "subscribe", "stream": "feedback", "elements": ["blockprogress"]})
    assert told.of("error")[0]["code"] == "invalid"


BMLA = 'xmlns:bmla="http://www.asap-project.org/bmla"'


def test_a_block_that_is_to_follow_waits_for_the_one_before_it_in_preparation() -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("a"))
    driver.send(f'<bml id="b" {BMLA} bmla:appendAfter="a"/>')
    assert not any(id.endswith(":start") for id in driver.run(1).ids)
    driver.say(driver.spoken[0].id, spoken(2.0))
    times = {f.id: f.global_time for f in driver.run(9).feedback if isinstance(f, BlockProgress)}
    assert times["b:start"] == times["a:end"] == pytest.approx(3.0)


def test_a_block_in_preparation_waits_for_one_that_is_to_come_before_it() -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("a"))
    driver.send(f'<bml id="b" {BMLA} bmla:prependBefore="a"><wait id="w" duration="1"/></bml>')
    driver.say(driver.spoken[0].id, spoken(2.0))
    times = {f.id: f.global_time for f in driver.run(9).feedback if isinstance(f, BlockProgress)}
    assert times["a:start"] == times["b:end"] == pytest.approx(1.0)


def test_a_block_in_preparation_can_be_interrupted() -> None:
    driver = Driver(mute=True)
    driver.send(TALK.format("a"))
    driver.send(f'<bml id="b" {BMLA}><bmla:interrupt id="i" target="a"/></bml>')
    driver.say(driver.spoken[0].id, spoken(2.0))
    told = [f for f in driver.run(9).feedback if isinstance(f, BlockProgress) and f.id.startswith("a:")]
    assert [(f.id, f.status) for f in told] == [("a:end", "REVOKED")]


def test_an_anticipated_point_moves_what_is_tied_to_it(driver) -> None:
    driver.send({"type": "anticipate", "id": "clock", "syncs": {"beat": 3.0}})
    driver.send('<bml id="b"><head id="n" lexeme="NOD" stroke="anticipators:clock:beat"/></bml>')
    driver.run(1)
    driver.send({"type": "anticipate", "id": "clock", "syncs": {"beat": 2.0}})
    driver.run(9)
    strokes = [f for f in driver.clients[1].feedback if getattr(f, "id", "") == "b:n:stroke"]
    assert [f.global_time for f in strokes] == [pytest.approx(2.0)]
    predicted = [
        b.syncs["stroke"].offset for f in driver.clients[1].feedback for b in getattr(f, "behaviours", ())
    ]
    assert predicted == [pytest.approx(3.0), pytest.approx(2.0)]


def test_a_speech_that_has_to_last_longer_is_spoken_again_and_later_blocks_wait_for_it() -> None:
    driver = Driver(mute=True)
    driver.send('<bml id="a"><speech id="s" start="0" end="3"><text>Hello there</text></speech></bml>')
    driver.send('<bml id="b" composition="APPEND"/>')
    driver.say(driver.spoken[0].id, replace(spoken(2.0), stretch=(0.6, 1.8)))
    assert [order.request.seconds for order in driver.spoken] == [None, pytest.approx(3.0)]
    assert not any(id.endswith(":start") for id in driver.run(1).ids)
    driver.say(driver.spoken[1].id, spoken(3.0))
    times = {f.id: f.global_time for f in driver.run(9).feedback if isinstance(f, BlockProgress)}
    assert times == {"a:start": 1.0, "a:end": 4.0, "b:start": 4.0, "b:end": 4.0}


def test_a_voice_that_comes_back_with_another_length_is_not_asked_a_third_time() -> None:
    driver = Driver(mute=True)
    driver.send('<bml id="a"><speech id="s" start="0" end="3"><text>Hello there</text></speech></bml>')
    driver.say(driver.spoken[0].id, replace(spoken(2.0), stretch=(0.6, 1.8)))
    driver.say(driver.spoken[1].id, replace(spoken(2.5), stretch=(0.6, 1.8)))
    told = driver.run(9)
    assert len(driver.spoken) == 2
    assert [w.id for w in told.feedback if isinstance(w, WarningFeedback)] == ["a:s"]
    assert "a:end" in told.ids


def test_a_voice_that_is_not_there_is_an_error_at_once(driver) -> None:
    told = driver.send({"type": "character", "id": "Z", "voice": "nope"})
    (error,) = told.of("error")
    assert (error["code"], error["where"]) == ("voice", "character.voice")
    assert "nope" in error["message"]


def test_time_that_passes_while_a_voice_speaks_again_is_made_up_for() -> None:
    driver = Driver(mute=True)
    driver.send('<bml id="a"><faceLexeme id="f" lexeme="SMILE" start="0" end="4"/></bml>')
    driver.run(0.5)
    driver.send('<bml id="b"><speech id="s" start="0" end="a:f:end"><text>Hello</text></speech></bml>')
    driver.say(driver.spoken[0].id, replace(spoken(2.5), stretch=(0.6, 1.8)))
    driver.run(0.6)
    driver.say(driver.spoken[1].id, spoken(3.5))
    told = driver.run(9)
    assert not [f for f in told.feedback if isinstance(f, WarningFeedback)]
    times = {f.id: f.global_time for f in told.feedback if hasattr(f, "global_time")}
    assert times["b:s:end"] == pytest.approx(4.0)
    assert times["b:start"] == times["b:s:start"] == pytest.approx(0.6)


CALM = """<bml id="{id}" composition="REPLACE"><head id="n" lexeme="NOD" start="0.3"/>
<faceLexeme id="f" lexeme="SMILE" start="n:stroke" end="1.1"/><gaze id="g" target="cup" end="0.9"/></bml>"""


def test_a_session_that_is_woken_at_its_deadlines_tells_what_one_does_that_always_looks(drive) -> None:
    def play(step: float | None) -> list[str | bytes]:
        driver = drive()
        for message in (
            {"type": "scene", "objects": {"cup": {"x": 0.2, "y": -0.1, "z": 0.5}}},
            {"type": "subscribe", "stream": "fap", "fps": 30},
            {"type": "subscribe", "stream": "au", "fps": 12.5, "encoding": "json"},
        ):
            driver.send(message)
        for k, at in enumerate((0.2, 0.9, 4.0)):
            while step is not None and driver.now + step < at:
                driver.run(driver.now + step)
                driver.session.tick(driver.opened + driver.now)
                driver.collect()
            driver.run(at)
            driver.send(CALM.format(id=f"b{k}"))
        driver.run(9.0)
        return driver.clients[1].messages

    assert play(None) == play(0.007)


def test_frames_go_on_while_documents_wait_to_be_read(driver) -> None:
    driver.send({"type": "subscribe", "stream": "fap", "fps": 25})
    now = driver.opened
    for k in range(3):
        driver.session.receive(1, CALM.format(id=f"b{k}"), now)
    driver.collect()
    assert driver.session.has_documents
    for frame in range(1, 6):
        assert driver.session.next_due() == pytest.approx(now + frame / 25)
        driver.session.tick(now + frame / 25, read_documents=False)
        driver.collect()
    assert [frame.frame for frame in driver.clients[1].frames] == list(range(6))
    assert driver.session.has_documents
    driver.run(0.3)
    assert not driver.session.has_documents
    assert driver.clients[1].ids[-1] != "prediction"
    assert {"b0:end", "b1:end", "b2:start"} <= set(driver.clients[1].ids)


@pytest.mark.parametrize("message", ["ping", "state", "stop", "unsubscribe"])
def test_what_is_due_goes_out_before_a_late_message_is_followed(driver, message) -> None:
    driver.send(FAP | {"fps": 25})
    driver.send('<bml id="b"><wait id="w" duration="0.5"/></bml>')
    client = driver.run(0.49)
    before, driver.now = len(client.messages), 0.53  # nobody has woken it at 0.5 and at 0.52
    driver.send({"type": message, "stream": "fap"} if message == "unsubscribe" else {"type": message})
    point, end, frame = client.messages[before : before + 3]
    assert 'id="b:w:end"' in point
    assert 'status="DONE"' in end
    assert unpack(frame).frame == 13
