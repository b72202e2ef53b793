"""Streaming speeches: spoken as text arrives, with syncs and behaviours, and interrupted immediately."""

from __future__ import annotations

import asyncio
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.asyncio.client import connect

from bml_schema.feedback import (
    BlockProgress,
    PredictionFeedback,
    SyncPointProgress,
    WarningFeedback,
    parse_feedback,
)
from realizer.core.settings import Settings
from realizer.protocol.wire import ClipPiece, pack_clip, unpack
from realizer.server.serve import Server
from realizer.server.session.effects import Effect, Speak
from realizer.server.speech import speech_streams
from realizer.server.speech.speech_streams import PATIENCE
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import Phoneme, Utterance, Word
from tests.realizer.server.conftest import RATE, Client, Driver
from tests.waiting import LIMIT

EACH = 0.5  # s a piece
NUMBER = re.compile(r"\d+(?:\.\d+)?")


class Talker(Driver):
    """A voice that speaks each chunk in half a second, with evenly spaced words and marks."""

    def do(self, effect: Effect) -> None:
        if not isinstance(effect, Speak) or self.mute:
            super().do(effect)
            return
        self.spoken.append(effect)
        self.session.on_speech(effect.id, said(effect), self.opened + self.now)
        self.collect()

    def append(self, text: str = "", **more) -> Client:
        return self.send({"type": "speech", "id": "turn", "append": text, **more})


def said(order: Speak) -> Utterance:
    if order.request.recording is not None:
        return speak_to_length(SilentVoice(), order.request)
    silent = SilentVoice().say(order.request)
    part = EACH / (silent.duration or 1.0)
    ends = np.linspace(0, EACH, len(silent.words) + 1)
    words = tuple(Word(*span, w.text) for *span, w in zip(ends, ends[1:], silent.words, strict=False))
    marks = {name: time * part for name, time in silent.marks.items()}
    pcm = (np.arange(round(EACH * RATE)) % 20000 + 100).astype(np.int16)
    return Utterance(EACH, words, (), marks, RATE, pcm)


def times(client: Client) -> dict[str, float]:
    """Return the times of all feedback."""
    progress = (f for f in client.feedback if isinstance(f, BlockProgress | SyncPointProgress))
    return {f.id: f.global_time for f in progress}


def texts(driver: Driver) -> list[str]:
    return [order.request.ssml.strip() for order in driver.spoken]


def test_speech_streams_speak_each_complete_sentence() -> None:
    driver = Talker()
    for token in ("Hel", "lo the", "re.", " How are", " you", "?"):
        driver.append(token)
        driver.run(driver.now + 0.1)
    assert texts(driver) == ["Hello there."]
    driver.append(close=True)
    at = times(driver.run(5))
    assert texts(driver) == ["Hello there.", "How are you?"]
    assert at["turn:start"] == 0
    assert at["turn.1:start"] == pytest.approx(0.3)
    assert at["turn.2:start"] == pytest.approx(at["turn.1:end"])
    assert at["turn:end"] == pytest.approx(at["turn.2:end"], abs=2e-3)
    assert list(at)[-1] == "turn:end"


def test_speech_streams_speak_late_text_when_it_arrives() -> None:
    driver = Talker()
    driver.append("One. ")
    driver.run(3.0)
    driver.append("Two.", close=True)
    at = times(driver.run(9))
    assert at["turn.2:start"] == pytest.approx(3.0)
    assert at["turn:end"] == pytest.approx(3.5, abs=2e-3)


def test_speech_streams_place_behaviours_and_syncs_of_the_text() -> None:
    driver = Talker()
    driver.append('One. Yes <sync id="m"/>two <head lexeme="NOD"/>three. ')
    driver.append('Four <head id="n" lexeme="NOD" stroke="turn:m + 1"/>five.', close=True)
    at = times(driver.run(9))
    assert 0.5 < at["turn.2:turn:m"] < at["turn.2:b1:start"] < 1.0
    assert at["turn.3:n:stroke"] == pytest.approx(at["turn.2:turn:m"] + 1)


def test_with_links_resolves_syncs_before_and_after_they_arrive() -> None:
    driver = Talker()
    driver.append("One. ")
    for n in (1, 2):
        driver.send(f'<bml id="b{n}"><head id="n" lexeme="NOD" stroke="turn:turn:m"/></bml>')
        assert [b["status"] for b in driver.send({"type": "state"}).of("state")[-1]["blocks"]][-1] == (
            "IN_PREP" if n == 1 else "IN_EXEC"
        )
        if n == 1:
            driver.append('Two words more <sync id="m"/>here.', close=True)
    at = times(driver.run(9))
    assert at["b1:n:stroke"] == at["b2:n:stroke"] == pytest.approx(at["turn.2:turn:m"])


def test_awaits_sync_ends_when_the_speech_is_closed() -> None:
    driver = Talker()
    driver.append("One. ")
    driver.send(
        '<bml id="b"><head id="n" lexeme="NOD" stroke="turn:turn:m"/><wait id="w" duration="1"/></bml>'
    )
    driver.append("Two.", close=True)
    client = driver.run(9)
    at = times(client)
    assert "b:w:end" in at
    assert "b:n:stroke" not in at
    assert "turn:end" in at


@pytest.mark.parametrize("id", ["3f2504e0-4f89-11d3-9a0c-0305e82c3301", "9", "1e5"])
def test_speech_streams_take_an_id_that_begins_with_a_digit(id: str) -> None:
    driver = Talker()
    driver.send({"type": "speech", "id": id, "append": 'One <sync id="m"/>two. ', "close": True})
    client = driver.send(f'<bml id="b"><head id="n" lexeme="NOD" stroke="{id}:{id}:m"/></bml>')
    driver.run(4)
    at = times(client)
    assert not client.of("error")
    assert at["b:n:stroke"] == pytest.approx(at[f"{id}.1:{id}:m"])
    assert f"{id}:end" in at


def test_speech_streams_suggest_a_sync_for_one_that_never_came() -> None:
    driver = Talker()
    driver.append('One <sync id="important"/>two. ')
    driver.send('<bml id="b"><head id="n" lexeme="NOD" stroke="turn:turn:importent"/></bml>')
    (block,) = [b for b in driver.send({"type": "state"}).of("state")[-1]["blocks"] if b["id"] == "b"]
    assert block["waits_for"] == ["turn:turn:importent"]
    driver.append("", close=True)
    (warning,) = [f for f in driver.run(3).feedback if isinstance(f, WarningFeedback) and f.id == "b:n"]
    assert "turn has no importent, only start, important, end" in warning.text


def test_awaits_sync_ends_when_the_speech_is_cut_off() -> None:
    driver = Talker()
    driver.append("One two three. ")
    driver.send(
        '<bml id="b"><head id="n" lexeme="NOD" stroke="turn:turn:m"/><wait id="w" duration="1"/></bml>'
    )
    driver.send({"type": "stop", "blocks": ["turn"]})
    at = times(driver.run(2))
    assert "b:w:end" in at
    assert "b:n:stroke" not in at


def test_speech_streams_accept_a_speech_without_words() -> None:
    driver = Talker()
    received = [
        *driver.send({"type": "speech", "id": "turn", "close": True}).feedback,
        *driver.run(1).feedback,
    ]
    assert [f.status for f in received if isinstance(f, BlockProgress) and f.id == "turn:end"] == ["DONE"]
    assert not [f for f in received if isinstance(f, WarningFeedback)]


def test_speech_streams_are_followed_as_one_block() -> None:
    driver = Talker()
    driver.append("One. ")
    driver.send('<bml id="after" composition="APPEND"><wait id="w" duration="1"/></bml>')
    driver.send('<bml id="with"><wait id="w" start="turn:turn:end" duration="1"/></bml>')
    driver.append("Two.", close=True)
    at = times(driver.run(9))
    assert at["after:start"] == pytest.approx(at["turn:end"])
    assert at["with:w:start"] == pytest.approx(at["turn:end"])


def test_speech_streams_follow_playing_blocks() -> None:
    driver = Talker()
    driver.send('<bml id="first"><wait id="w" duration="2"/></bml>')
    driver.append("One. Two.", close=True)
    at = times(driver.run(9))
    assert at["turn:start"] == at["turn.1:start"] == pytest.approx(2.0)
    driver.append("Three.", close=True, composition="MERGE")
    assert driver.run(12).feedback[-1].id == "turn:end"


def test_next_prepares_a_few_chunks_ahead() -> None:
    driver = Talker(max_blocks=12)
    driver.append("".join(f"This is {n}. " for n in range(40)), close=True)
    assert len(driver.spoken) == speech_streams.AHEAD
    at = times(driver.run(30))
    assert texts(driver) == [f"This is {n}." for n in range(40)]
    ends = [at[f"turn.{n}:end"] for n in range(1, 41)]
    assert np.allclose(np.diff(ends), EACH, atol=1e-3), "no gaps"
    assert at["turn:end"] == pytest.approx(20.0, abs=2e-3)


def test_next_does_not_count_sentences_whose_expressions_go_on() -> None:
    driver = Talker()
    driver.append('<faceLexeme lexeme="SMILE" end="8"/>One. ' * 12, close=True)
    assert len(driver.spoken) == speech_streams.AHEAD
    at = times(driver.run(20))
    assert [at[f"turn.{n}:start"] for n in range(1, 13)] == pytest.approx(EACH * np.arange(12))


def test_is_streaming_shortens_pauses_inside_a_sentence() -> None:
    class Slow(Talker):
        """A voice that ends whatever it says as it ends a sentence."""

        def do(self, effect: Effect) -> None:
            if isinstance(effect, Speak):
                self.spoken.append(effect)
                pause = (Phoneme(0.0, EACH - 0.4, "a"), Phoneme(EACH - 0.4, EACH, ""))
                answer = replace(said(effect), phonemes=pause)
                self.session.on_speech(effect.id, answer, self.opened + self.now)
                self.collect()
            else:
                super().do(effect)

    driver = Slow()
    driver.append("When all of them had come to the old house, they sat down. Then, ", close=True)
    at = times(driver.run(9))
    assert [t[-3:] for t in texts(driver)] == ["se,", "wn.", "en,"]
    assert at["turn.1:end"] - at["turn.1:start"] == pytest.approx(EACH - 0.4 + 0.15, abs=1e-3)
    assert at["turn.2:end"] - at["turn.2:start"] == pytest.approx(EACH)
    assert at["turn.3:end"] - at["turn.3:start"] == pytest.approx(EACH), "nothing follows the last one"


SMILE = '<faceLexeme id="s" lexeme="SMILE" amount="1" start="{}" end="turn:turn:end"/>'


def test_advance_leaves_unknown_times_out() -> None:
    driver = Talker(idle=False)
    driver.append("One. Two")
    driver.send({"type": "subscribe", "stream": "schedule"})
    driver.send(f'<bml id="smile">{SMILE.format("turn:turn:start")}</bml>')
    driver.send('<bml id="after"><head id="n" lexeme="NOD" start="turn:turn:end"/></bml>')
    driver.send('<bml id="next" composition="APPEND"><head id="n" lexeme="NOD"/></bml>')
    client = driver.run(0.1)
    predictions = [f for f in client.feedback if isinstance(f, PredictionFeedback)]
    newest = {p.blocks[0].id: p for p in predictions if p.behaviours}
    assert newest["turn"].blocks[0].global_start == 0
    assert newest["turn"].blocks[0].global_end is None
    assert list(newest["turn"].behaviours[0].syncs) == ["start"]
    assert list(newest["smile"].behaviours[0].syncs) == ["start", "attackPeak"]
    assert "after" not in newest
    assert [p.blocks[0].global_end for p in predictions if p.blocks[0].id == "after"] == [None] * 3
    # The start of this block is not known: as if it started now.
    assert newest["next"].blocks[0].global_start == 0
    assert newest["next"].blocks[0].global_end == pytest.approx(0.72)
    state = driver.send({"type": "state"}).of("state")[-1]
    blocks = {block["id"]: block for block in state["blocks"]}
    assert "end" not in blocks["turn"]
    assert "start" not in blocks["next"]
    far = [
        float(number) for text in client.messages if isinstance(text, str) for number in NUMBER.findall(text)
    ]
    assert max(far) < 50_000, "a sample rate at most"


def test_advance_predicts_what_waits_for_the_end() -> None:
    driver = Talker(idle=False)
    driver.append("One. Two")
    driver.send(f'<bml id="smile">{SMILE.format(0)}</bml>')
    driver.send('<bml id="next" composition="APPEND"><head id="n" lexeme="NOD"/></bml>')
    driver.run(3)
    driver.append(close=True)
    client = driver.run(3.1)
    ends = {
        p.blocks[0].id: p.blocks[0].global_end for p in client.feedback if isinstance(p, PredictionFeedback)
    }
    assert ends["turn"] == pytest.approx(3 + EACH, abs=0.01)
    assert ends["smile"] == ends["turn"]
    assert ends["next"] == pytest.approx(ends["turn"] + 0.72)


@pytest.mark.parametrize("start", ["0", "turn:turn:start"])
def test_advance_lets_expressions_last_until_the_end(start) -> None:
    driver = Talker(idle=False)
    names = driver.send({"type": "subscribe", "stream": "au"}).of("subscribed")[0]["names"]
    driver.append("One. Two")
    driver.send(f'<bml id="smile">{SMILE.format(start)}</bml>')
    smile = [frame.values[names.index("12L")] for frame in driver.run(30).frames]
    assert min(smile[20:]) == max(smile), "it is there after 0.8 s, and stays"
    assert max(smile) > 0.3
    driver.append(close=True)
    frames = driver.run(33).frames
    assert frames[-1].values[names.index("12L")] == 0


@pytest.mark.parametrize("text", ['<sync id="m"/>I am happy. And you?', "Well. " * 9 + '<sync id="m"/>Bye.'])
def test_speech_streams_do_not_wait_for_an_expression_up_to_their_end(text) -> None:
    driver = Talker()
    driver.append("Hello! ")
    driver.send(f'<bml id="smile">{SMILE.format("turn:turn:m")}</bml>')
    driver.append(text + " And more. " * 9, close=True)
    client = driver.run(60)
    at = times(client)
    (chunk,) = (id.removesuffix(":turn:m") for id in at if id.endswith(":turn:m"))
    spoken = len(driver.spoken)
    assert [at[f"turn.{n}:start"] for n in range(1, spoken + 1)] == pytest.approx(EACH * np.arange(spoken))
    assert at["smile:s:start"] == pytest.approx(at[f"{chunk}:turn:m"])
    assert at["smile:s:end"] == pytest.approx(at["turn:end"])
    assert not [f for f in client.feedback if isinstance(f, WarningFeedback)]


FACE, HEAD = 'faceLexeme id="f" lexeme="SMILE"', 'head id="f" lexeme="NOD"'
LATE = [
    f'<{FACE} start="turn:turn:start" end="turn:turn:end"/>',
    f'<{FACE} end="turn:turn:end"/>',
    f'<{FACE} start="0" end="turn:turn:end-0.5"/>',
    f'<{FACE} start="0" relax="turn:turn:end"/>',
    f'<{HEAD} stroke="turn:turn:end"/>',
    f'<{FACE} end="g:end"/><head id="g" lexeme="NOD" end="turn:turn:end"/>',
    f'<{FACE}/><constraint id="c"><synchronize ref="turn:turn:end"><sync ref="f:end"/></synchronize>'
    "</constraint>",
]


def closed_late(body: str) -> Client:
    """Play a speech beside a block; it is closed 2 s after its last sentence."""
    driver = Talker()
    driver.append("Hello there. ")
    driver.send(f'<bml id="b">{body}</bml>')
    driver.run(2.5)
    driver.append(close=True)
    return driver.run(12)


@pytest.mark.parametrize("body", LATE)
def test_advance_ends_what_is_tied_to_a_speech_that_is_closed_late(body) -> None:
    client = closed_late(body)
    at = times(client)
    assert 2.5 <= at["turn:end"] < 2.7, "as soon as the motion can end"
    assert at["b:end"] < 3.5
    assert not [f for f in client.feedback if isinstance(f, WarningFeedback)]


def test_advance_ends_a_speech_that_is_closed_too_late_for_others() -> None:
    client = closed_late(f'<{FACE} start="turn:turn:end-3" end="turn:turn:end"/>')
    assert "b:end" in times(client)
    assert times(client)["turn:end"] < 3.5
    assert {f.type for f in client.feedback if isinstance(f, WarningFeedback)} == {"IMPOSSIBLE_TO_SCHEDULE"}


@pytest.mark.parametrize("target", ["turn", "turn,turn.2"])
def test_with_links_interrupts_the_chunks_of_a_speech(target) -> None:
    driver = Talker()
    driver.append("This is a long story. And more. ")
    driver.run(0.2)
    names = f'xmlns:bmla="http://www.asap-project.org/bmla" bmla:interrupt="{target}"'
    driver.send(f'<bml id="r" {names}><speech id="x" start="0"><text>Stop</text></speech></bml>')
    client = driver.run(5)
    at = times(client)
    assert at["turn:end"] == at["r:x:start"] == pytest.approx(0.2)
    assert "turn.2:start" not in at
    assert not [f for f in client.feedback if isinstance(f, WarningFeedback)]


def test_advance_predicts_the_end_once_it_is_known() -> None:
    driver = Talker()
    driver.append("One. Two.")
    driver.append(close=True)
    ends = [
        b.global_end
        for f in driver.clients[1].feedback
        if isinstance(f, PredictionFeedback)
        for b in f.blocks
        if b.id == "turn" and b.global_end is not None
    ]
    assert ends[-1] == pytest.approx(1.001, abs=1e-3)


CUTS = [
    {"type": "stop", "blocks": ["turn"]},
    {"type": "stop"},
    '<bml id="i"><bmla:interrupt xmlns:bmla="http://www.asap-project.org/bmla" id="x" target="turn"/></bml>',
    '<bml id="i" composition="REPLACE"><head id="n" lexeme="NOD"/></bml>',
]


@pytest.mark.parametrize("how", CUTS)
def test_process_feedback_reports_the_words_of_an_interrupted_speech(how) -> None:
    driver = Talker()
    driver.send({"type": "subscribe", "stream": "audio", "rate": RATE})
    driver.append("One two three. Four five six. Seven eight. ")
    driver.run(0.85)
    driver.send(how)
    driver.append("And more of it. ")
    driver.append("And more. ", close=True)
    client = driver.run(6.0)
    heard = np.zeros(RATE * 6)
    for frame in (f for f in client.frames if f.stream == "audio"):
        first = round(frame.time * RATE)
        heard[first : None if frame.flush else first + len(frame.values)] = 0 if frame.flush else frame.values
    assert heard[round(0.8 * RATE) : round(0.84 * RATE)].all()
    assert not heard[round(0.9 * RATE) :].any()
    end = next(f for f in client.feedback if getattr(f, "id", "") == "turn:end")
    assert (end.status, end.global_time) == ("INTERRUPTED", pytest.approx(0.85))
    assert end.said == "One two three Four five"
    assert end.last_word == "five"
    assert len(driver.spoken) == 3, "what came later was not spoken"
    assert not [b for b in driver.send({"type": "state"}).of("state")[-1]["blocks"] if b["id"] != "i"]
    driver.append("Again.", close=True)
    assert "turn:end" in [getattr(f, "id", "") for f in driver.run(9.0).feedback[-1:]]


def test_speech_streams_relax_the_face_after_an_interruption() -> None:
    driver = Talker(idle=False)
    driver.append('<faceLexeme lexeme="SMILE" end="turn:end"/>One two three. Four five six. ')
    driver.run(0.3)
    assert driver.session.player.frames(np.array([0.3])).aus.any()
    driver.send({"type": "stop"})
    driver.run(2.0)
    shown = driver.session.player.frames(np.arange(1.5, 2.0, 0.04))
    assert not shown.aus.any()
    assert not shown.faps.any()


def test_speech_streams_continue_after_an_interrupted_chunk() -> None:
    driver = Talker()
    driver.append("One two. Three four. ", close=True)
    driver.run(0.2)
    driver.send({"type": "stop", "blocks": ["turn.1"]})
    at = times(driver.run(5))
    assert at["turn.2:start"] == pytest.approx(0.2)
    assert at["turn:end"] == pytest.approx(0.7, abs=2e-3)


def test_speech_streams_leave_no_gap_behind_an_expression() -> None:
    driver = Talker()
    driver.append('<faceLexeme lexeme="SMILE"/>One. Two. Three.', close=True)
    at = times(driver.run(9))
    assert [at[f"turn.{n}:start"] for n in (1, 2, 3)] == pytest.approx([0, EACH, 2 * EACH])
    assert at["turn.1:b1:end"] > 3 * EACH
    assert at["turn:end"] == pytest.approx(at["turn.1:b1:end"], abs=2e-3)


def test_speech_streams_begin_a_clip_with_the_expression_before_it() -> None:
    driver = Talker()
    driver.session.receive(1, pack_clip(ClipPiece("c", 0, 8000, SLOW.tobytes())), driver.opened)
    driver.collect()
    driver.append('<faceLexeme lexeme="SMILE"/>', clip="c", close=True)
    at = times(driver.run(9))
    assert at["turn.1:b1:start"] == at["turn.2:start"] == 0


@pytest.mark.parametrize("more", ["", ' ready="turn:m + 0.6"'])
def test_speech_streams_end_a_motion_that_the_next_sentence_needs(more) -> None:
    driver = Talker()
    driver.append('One <sync id="m"/><gaze target="camera"/>two. ')
    driver.append(f'<gaze target="camera"{more}/>Three four. ', close=True)
    client = driver.run(9)
    at = times(client)
    assert at["turn.2:start"] == pytest.approx(EACH)
    assert at["turn.1:b1:end"] == pytest.approx(EACH + 0.3, abs=0.01), "it relaxes"
    assert "turn.2:b1:end" in at
    assert not [f for f in client.feedback if isinstance(f, WarningFeedback)]


def test_process_feedback_reports_spoken_words_in_order() -> None:
    driver = Talker()
    driver.append('<faceLexeme lexeme="SMILE"/>One. Two. Three four. Five. ')
    driver.run(1.4)
    driver.send({"type": "stop", "blocks": ["turn"]})
    (end,) = (f for f in driver.run(3).feedback if getattr(f, "id", "") == "turn:end")
    assert end.said == "One Two Three"


def test_speech_streams_play_clips_between_texts() -> None:
    driver = Talker()
    sound = (np.arange(8000) % 9000).astype("<i2").tobytes()
    driver.session.receive(1, pack_clip(ClipPiece("c", 0, 8000, sound)), driver.opened)
    driver.collect()
    driver.append("Listen", clip="c")
    driver.append("Well?", close=True)
    at = times(driver.run(5))
    starts = [at[f"turn.{n}:start"] for n in (1, 2, 3)]
    assert starts == pytest.approx([0, EACH, EACH + 1.0])


def test_on_disconnect_speaks_the_rest_of_the_text() -> None:
    driver = Talker(named=True)
    driver.join(2)
    driver.send({"type": "speech", "id": "turn", "append": "One. Two and"})
    driver.leave(1)
    at = times(driver.run(5) and driver.clients[2])
    assert texts(driver) == ["One.", "Two and"]
    assert at["turn:end"] == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize(
    ("messages", "where"),
    [
        ([{"append": "One. "}, {"close": True}, {"append": "Two."}], "speech.id"),
        ([{"clip": "none"}], "speech.clip"),
        ([{"append": "x" * 30}], "speech.append"),
    ],
)
def test_handle_names_the_field_of_an_invalid_message(monkeypatch, messages, where) -> None:
    monkeypatch.setattr(speech_streams, "MOST", 20)
    driver = Talker()
    for message in messages:
        client = driver.send({"type": "speech", "id": "turn", **message})
    assert [e["where"] for e in client.of("error")] == [where]


def test_on_refused_ends_a_speech_with_the_id_of_a_block() -> None:
    driver = Talker()
    driver.send('<bml id="turn"><wait id="w" duration="3"/></bml>')
    driver.append("One. ")
    driver.append("Two. ", close=True)
    assert driver.spoken == []
    driver.append("Three.", close=True)
    assert driver.run(9).feedback[-1].id == "turn:end"


ACTS = st.lists(
    st.one_of(
        st.tuples(
            st.just("append"),
            st.sampled_from(["One. ", "Two", " three? ", '<sync id="m"/>', '<gaze target="camera"/>', "..."]),
        ),
        st.tuples(st.just("close"), st.just("")),
        st.tuples(st.just("stop"), st.sampled_from(["turn", "turn.1", "turn.2", "b"])),
        st.tuples(st.just("bml"), st.sampled_from(["turn:turn:m", "turn:turn:end", "turn.1:turn:end"])),
        st.tuples(st.just("smile"), st.sampled_from(["turn:turn:m", "turn:turn:start"])),
        st.tuples(st.just("run"), st.sampled_from([0.1, 0.4, 1.0])),
    ),
    max_size=20,
)


@given(ACTS)
def test_speech_streams_end_every_block_in_any_order(acts) -> None:
    driver = Talker()
    for act, what in acts:
        match act:
            case "append":
                driver.append(what)
            case "close":
                driver.append(close=True)
            case "stop":
                driver.send({"type": "stop", "blocks": [what]})
            case "bml":
                driver.send(f'<bml id="b"><head id="n" lexeme="NOD" start="{what}"/></bml>')
            case "smile":
                driver.send(f'<bml id="c">{SMILE.format(what)}</bml>')
            case "run":
                driver.run(driver.now + float(what))
    driver.append(close=True)
    client = driver.run(driver.now + 60)
    ids = [f.id for f in client.feedback if isinstance(f, BlockProgress)]
    assert sorted(i[:-6] for i in ids if i.endswith(":start")) == sorted(
        f.id[:-4]
        for f in client.feedback
        if isinstance(f, BlockProgress) and f.id.endswith(":end") and f.status != "REVOKED"
    )
    assert driver.send({"type": "state"}).of("state")[-1]["blocks"] == []
    assert not driver.session.player.blocks.anticipators  # a session that speaks for days keeps nothing of it


async def spoken_over(socket, last: str) -> list[str | bytes]:
    """Return the messages up to the block progress `last`."""
    got: list[str | bytes] = []
    async for message in socket:
        got.append(message)
        if isinstance(message, str) and f'id="{last}"' in message:
            break
    return got


def streamed(test) -> list[str | bytes]:
    """Return the messages that a client received from a service."""

    async def run() -> list[str | bytes]:
        async with (
            asyncio.timeout(LIMIT),
            Server(Settings(port=0, voice="espeak")) as server,
            connect(server.url) as socket,
        ):
            await socket.send(json.dumps({"type": "subscribe", "stream": "audio"}))
            return await test(socket)

    return asyncio.run(run())


def told_at(messages: list[str | bytes]) -> dict[str, float]:
    feedback = [parse_feedback(m) for m in messages if isinstance(m, str) and m.startswith("<")]
    return {f.id: f.global_time for f in feedback if isinstance(f, BlockProgress | SyncPointProgress)}


def packets(messages: list[str | bytes]):
    return [f for f in (unpack(m) for m in messages if isinstance(m, bytes)) if f.stream == "audio"]


@pytest.mark.espeak
def test_speech_streams_run_over_a_websocket() -> None:
    async def talk(socket) -> list[str | bytes]:
        for token in ("One ", 'and <sync id="m"/>', "two. ", "And ", "three."):
            await socket.send(json.dumps({"type": "speech", "id": "turn", "append": token}))
        await socket.send('<bml id="b"><head id="n" lexeme="NOD" start="turn:turn:m"/></bml>')
        await socket.send(json.dumps({"type": "speech", "id": "turn", "close": True}))
        return await spoken_over(socket, "turn:end")

    messages = streamed(talk)
    at = told_at(messages)
    assert at["b:n:start"] == pytest.approx(at["turn.1:turn:m"])
    assert at["turn.2:start"] == pytest.approx(at["turn.1:end"])
    loud = [f.time for f in packets(messages) if len(f.values) and np.abs(f.values).max() > 1000]
    assert at["turn.1:start"] - 0.02 < loud[0] < at["turn.1:start"] + 0.15
    assert loud[-1] < at["turn.2:end"]


@pytest.mark.espeak
def test_speech_streams_stop_within_50_ms_over_a_websocket() -> None:
    async def barge_in(socket) -> list[str | bytes]:
        text = 'Well, <sync id="m"/>this is a rather long sentence, which nobody wants to hear to its end. '
        await socket.send(json.dumps({"type": "speech", "id": "turn", "append": text * 3}))
        before = await spoken_over(socket, "turn.1:turn:m")
        await socket.send(json.dumps({"type": "stop", "blocks": ["turn"]}))
        before += await spoken_over(socket, "turn:end")
        await socket.send('<bml id="later"><wait id="w" duration="0.5"/></bml>')
        return before + await spoken_over(socket, "later:end")

    messages = streamed(barge_in)
    end = told_at(messages)["turn:end"]
    played: dict[int, float] = {}  # packet -> when its sound ends, as a client keeps it
    for packet in packets(messages):
        if packet.flush:
            played = {frame: until for frame, until in played.items() if frame < packet.frame}
        if len(packet.values):
            last = np.flatnonzero(np.append(1, packet.values))[-1]
            played[packet.frame] = packet.time + last / RATE
    assert played, "it was heard"
    assert max(played.values()) < end + 0.05
    feedback = [parse_feedback(m) for m in messages if isinstance(m, str) and m.startswith("<")]
    (end,) = (f for f in feedback if getattr(f, "id", "") == "turn:end")
    assert (end.status, (end.said or "").split()[:1]) == ("INTERRUPTED", ["Well"])


# clips that arrive slowly ----------------------------------------------------------------------------------

WORDS = [{"start": 0.1, "text": "One"}, {"start": 0.7, "text": "two"}, {"start": 1.2, "text": "three"}]
SLOW = (np.arange(16000) % 9000 + 50).astype("<i2")  # 2 s at 8 kHz


def arrive(driver: Driver, pieces: list[int], *, last: bool = True, seconds: float = 0.1) -> None:
    """Send these of 20 pieces of a clip, one each tenth of a second."""
    for number in pieces:
        piece = SLOW[number * 800 :][:800].tobytes()
        final = last and number == 19
        message = pack_clip(ClipPiece("c", number, 8000, piece, final=final))
        driver.session.receive(1, message, driver.opened + driver.now)
        driver.collect()
        driver.run(driver.now + seconds)


def heard(client: Client, rate: int = 8000) -> np.ndarray:
    """Return the sound of all packets, on a clock of samples."""
    out = np.zeros(10 * rate, np.int16)
    for frame in client.frames:
        if frame.stream == "audio":
            at = round(frame.time * rate)
            if frame.flush:
                out[at:] = 0
            out[at : at + len(frame.values)] = frame.values
    return out


@pytest.mark.parametrize("words", [[], WORDS], ids=["sound", "words"])
def test_clip_that_comes_slowly_is_spoken_as_it_arrives(words) -> None:
    driver = Talker()
    driver.send({"type": "subscribe", "stream": "audio", "rate": 8000})
    if words:
        driver.send({"type": "speech", "id": "turn", "clip": "c", "words": words, "close": True})
        arrive(driver, [0])
    else:
        arrive(driver, [0])
        driver.send({"type": "speech", "id": "turn", "clip": "c", "close": True})
    arrive(driver, list(range(1, 20)), seconds=0.05)
    at = times(driver.run(9))
    assert at["turn.1:start"] < 0.6, "long before the last piece"
    assert "turn:end" in at
    assert not [f for f in driver.clients[1].feedback if isinstance(f, WarningFeedback)]
    sound = heard(driver.clients[1])
    start = round(at["turn.1:start"] * 8000)
    assert np.array_equal(sound[start : start + len(SLOW)], SLOW), "without a gap"
    parts = [id for id in at if re.fullmatch(r"turn\.\d+:start", id)]
    assert len(parts) > 2


def test_clip_that_arrives_keeps_its_place_between_texts() -> None:
    driver = Talker()
    arrive(driver, [0, 1])
    driver.append("Listen", clip="c")
    driver.append("Well. ", close=True)
    driver.run(2)
    assert [order.request.recording is None for order in driver.spoken] == [True, False]
    arrive(driver, list(range(2, 20)))
    driver.run(9)
    assert [order.request.recording is None for order in driver.spoken][-1] is True
    assert texts(driver)[0] == "Listen"
    assert texts(driver)[-1] == "Well."


def test_clip_that_arrives_is_warned_of_when_its_sender_leaves() -> None:
    driver = Talker(named=True)
    driver.join(2)
    driver.send({"type": "subscribe", "stream": "audio", "rate": 8000}, 2)
    driver.send({"type": "speech", "id": "turn", "clip": "c", "words": WORDS})
    arrive(driver, [0, 1, 2, 3, 4, 5], last=False)
    driver.leave(1)
    driver.run(9)
    client = driver.clients[2]
    (warning,) = [f for f in client.feedback if isinstance(f, WarningFeedback) and f.id == "turn:turn"]
    assert warning.text.endswith("clip 'c': its last piece was not sent")
    assert "turn:end" in times(client)
    start = round(times(client)["turn.1:start"] * 8000)
    assert np.array_equal(heard(client)[start : start + 4800], SLOW[:4800])


def test_clip_that_arrives_no_further_ends_with_a_warning() -> None:
    driver = Talker()
    driver.send({"type": "speech", "id": "turn", "clip": "c", "words": WORDS, "close": True})
    arrive(driver, [0, 1, 2, 3, 4, 5], last=False)
    last = driver.now - 0.1
    driver.run(last + PATIENCE - 0.01)
    assert not [f for f in driver.clients[1].feedback if isinstance(f, WarningFeedback)]
    client = driver.run(last + PATIENCE + 2)
    (warning,) = [f for f in client.feedback if isinstance(f, WarningFeedback)]
    assert warning.id == "turn:turn"
    assert warning.text.endswith("clip 'c': no piece of it has come for 20 s")
    assert last + PATIENCE < times(client)["turn:end"] < last + PATIENCE + 1


@pytest.mark.parametrize(
    ("piece", "says"),
    [
        (ClipPiece("c", 0, 8000, b"ab"), "wanted piece 3 of the clip that is spoken, got piece 0"),
        (ClipPiece("c", 3, 16000, b"ab"), "wanted 8000 Hz as in piece 0, got 16000"),
        (ClipPiece("c", 5, 8000, b"ab"), "wanted piece 3, got 5"),
    ],
)
def test_clip_that_arrives_wrongly_is_an_error_and_a_warning(piece, says) -> None:
    driver = Talker()
    driver.send({"type": "speech", "id": "turn", "clip": "c", "words": WORDS, "close": True})
    arrive(driver, [0, 1, 2])
    driver.session.receive(1, pack_clip(piece), driver.opened + driver.now)
    driver.collect()
    client = driver.run(9)
    assert [error["message"] for error in client.of("error")] == [says]
    assert [f.id for f in client.feedback if isinstance(f, WarningFeedback)] == ["turn:turn"]
    assert "turn:end" in times(client)


def test_clip_that_arrives_can_be_interrupted_and_spoken_again() -> None:
    driver = Talker()
    driver.send({"type": "speech", "id": "turn", "clip": "c", "words": WORDS, "close": True})
    twice = driver.send({"type": "speech", "id": "other", "clip": "c", "close": True}).of("error")
    assert [error["message"] for error in twice] == ["wanted a clip that no speech waits for, got 'c'"]
    arrive(driver, list(range(12)))
    driver.run(driver.now + 0.4)
    driver.send({"type": "stop", "blocks": ["turn"]})
    arrive(driver, list(range(12, 20)))
    (end,) = [f for f in driver.run(5).feedback if isinstance(f, BlockProgress) and f.id == "turn:end"]
    assert (end.status, end.said) == ("INTERRUPTED", "One")
    driver.send({"type": "speech", "id": "again", "clip": "c", "close": True})
    at = times(driver.run(9))
    assert at["again:end"] - at["again:start"] == pytest.approx(2.0, abs=0.01)
