"""Tests of the sound of other voices, against the real service."""

from __future__ import annotations

import asyncio
import io
import wave
from typing import Any

import numpy as np
import pytest

from bml_schema.feedback import BlockProgress
from realizer.client import Client, ClientError, connect
from realizer.client.voice import LONGEST, Timed, Voice, samples_of, timed
from realizer.protocol.wire import unpack_clip
from realizer.speech.registry import find_voice
from realizer.speech.utterance import SpeechRequest
from tests.realizer.client.service import serving

RATE = 8000
TONE = (9000 * np.sin(np.arange(RATE) * 0.3)).astype(np.int16)  # 1 s
SAY_WORDS: list[Timed] = [(0.1, "mama"), (0.5, "papa")]


def wav() -> bytes:
    buffer = io.BytesIO()
    with wave.open(buffer, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(RATE)
        file.writeframes(TONE.tobytes())
    return buffer.getvalue()


async def lips(client: Client, until: asyncio.Task[Any]) -> float:
    """Return how far the inner lips part while something is said."""
    most = 0
    async for frame in client.faps(ahead=0, fps=25):
        most = max(most, int(np.abs(frame.values[3:5]).max()))
        if until.done():
            return most
    return most


@pytest.mark.parametrize(
    "description",
    [
        {"words": SAY_WORDS},
        {"phonemes": [(0.1, 0.4, "m"), (0.4, 0.9, "\u0251")]},
        {"visemes": [(0.1, "PP"), (0.4, "aa"), (0.9, "sil")]},
        {"text": "Mama, papa."},
    ],
    ids=["words", "phonemes", "visemes", "text"],
)
def test_say_plays_sound_and_moves_the_lips(description: dict[str, Any]) -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            saying = asyncio.create_task(client.say(TONE, RATE, language="en", **description))
            opened = await lips(client, saying)
            end = await saying
            assert isinstance(end, BlockProgress)
            assert end.status == "DONE"
            assert opened > 20

    serving(test)


@pytest.mark.espeak
def test_say_moves_the_lips_by_the_sound_alone() -> None:
    said = find_voice("espeak").say(SpeechRequest("Mama, papa."))
    assert said.pcm is not None

    async def test(url: str) -> None:
        async with connect(url) as client:
            saying = asyncio.create_task(client.say(said.pcm, said.sample_rate))
            assert await lips(client, saying) > 20
            assert (await saying).status == "DONE"

    serving(test)


def test_say_takes_the_bytes_of_a_file() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            end = await client.say(wav(), words=SAY_WORDS)
            assert end.status == "DONE"

    serving(test)


def test_say_is_heard_by_subscribers() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            packets = client.sound(rate=RATE)
            first = asyncio.create_task(anext(packets))
            await client.ask("ping")
            await client.say(TONE, RATE)
            packet = await first
            assert packet.rate == RATE
            assert packet.values.dtype == np.int16
            assert np.abs(packet.values.astype(int)).max() > 1000

    serving(test)


def test_voice_speaks_sound_as_it_comes() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            voice = client.voice(rate=RATE)
            await voice.words(SAY_WORDS)
            for part in np.split(TONE, 10):
                await voice.write(part)
            await voice.close()
            await voice.close()
            end = await voice.ended()
            assert end.status == "DONE"
            with pytest.raises(ClientError, match="was closed: nothing can follow"):
                await voice.write(TONE)

    serving(test)


def test_voice_reports_the_words_that_were_heard_before_a_stop() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            async with client.voice(rate=RATE) as voice:
                await voice.words([(0.0, "one"), (0.4, "two"), (2.5, "three")])
                await voice.write(np.tile(TONE, 3))
            faps = client.faps(ahead=0)
            started = None
            async for frame in faps:
                if started is None and np.abs(frame.values[3:5]).max() > 20:
                    started = frame.time
                if started is not None and frame.time > started + 0.6:
                    break
            await voice.stop()
            end = await voice.ended()
            assert end.status == "INTERRUPTED"
            assert end.said is not None
            assert end.said.startswith("one")
            assert "three" not in end.said

    serving(test)


def test_speech_and_voice_end_when_stopped_before_anything_was_sent() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            voice = client.voice(rate=RATE)
            await voice.write(TONE[:100])
            for each in (voice, client.speech("s")):
                await each.stop()
                assert (await each.ended()).status in ("INTERRUPTED", "REVOKED")  # it may not have started

    serving(test)


@pytest.mark.parametrize(
    ("sound", "rate", "options", "words"),
    [
        (b"", RATE, {}, "wanted sound, got none"),
        (b"", RATE, {"words": [(0.0, "a")]}, "wanted sound, got none"),
        (b"no file", None, {}, "wanted"),
        (TONE, 10, {}, "Hz"),
        (TONE, RATE, {"words": [(0.5, "b"), (0.1, "a")]}, "wanted times that rise"),
        (TONE, RATE, {"visemes": [(0.1, "QQ")]}, "QQ"),
        (
            TONE,
            RATE,
            {"visemes": [(0, "aa")], "phonemes": [(0, "a")]},
            "wanted phonemes or visemes, got both",
        ),
    ],
)
def test_say_raises_what_the_service_refuses(
    sound: Any, rate: int | None, options: dict[str, Any], words: str
) -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            with pytest.raises(ClientError, match=words):
                await client.say(sound, rate, **options)
            assert (await client.say(TONE[:2000], RATE)).status == "DONE"

    serving(test)


@pytest.mark.parametrize(
    ("sound", "rate", "error"),
    [
        (TONE, None, TypeError),
        (TONE, 8000.5, TypeError),
        (TONE, 0, ValueError),
        (TONE.reshape(2, -1), RATE, ValueError),
        (TONE.astype(np.int32), RATE, TypeError),
        (b"abc", RATE, ValueError),
    ],
)
def test_say_refuses_what_is_no_sound(sound: Any, rate: Any, error: type[Exception]) -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            with pytest.raises(error, match="wanted"):
                await client.say(sound, rate)

    serving(test)


def test_samples_of_floats_are_scaled_and_clipped() -> None:
    assert samples_of(np.array([0.0, 1.0, -2.0])).tolist() == [0, 32767, -32767]
    assert samples_of(b"\x01\x00\xff\xff").tolist() == [1, -1]


@pytest.mark.parametrize(
    ("loudest", "got"), [(12000.0, r"up to 12000: int16\?"), (np.nan, "up to nan$"), (-np.inf, "up to inf$")]
)
def test_samples_of_refuses_floats_far_beyond_one(loudest: float, got: str) -> None:
    with pytest.raises(ValueError, match=f"sound: wanted floats from -1 to 1, got {got}"):
        samples_of(np.array([0.0, loudest]))


def test_timed_takes_starts_with_or_without_ends() -> None:
    assert timed("words", [(0, "a"), (0.5, 1, "b")]) == [
        {"start": 0.0, "text": "a"},
        {"start": 0.5, "end": 1.0, "text": "b"},
    ]
    fields = [{"start": 0.0, "text": "a"}, {"start": 0.5, "end": 1.0, "text": "b"}]
    assert timed("words", fields) == fields
    for wrong in (["hello", 0.0, 1.0], "ab", (True, "a"), 3, (), {"text": "a"}, {"start": 0, "word": "a"}):
        with pytest.raises(TypeError, match="words: wanted"):
            timed("words", [wrong])  # type: ignore[list-item]
    for start in (-0.1, np.inf, np.nan):
        with pytest.raises(ValueError, match="words: wanted seconds from 0 on, got"):
            timed("words", [(start, "h")])


class Sent:
    """A voice without a service: the lengths and the words of its clips."""

    def __init__(self) -> None:
        self.clips: list[tuple[float, list[tuple[float, str]]]] = []
        self.voice = Voice(1000, {}, self._send, self._control, self._wait)
        self.order: list[str] = []
        self._lengths: list[float] = []
        self._words: list[tuple[float, str]] = []

    async def _send(self, message: bytes) -> None:
        piece = unpack_clip(message)
        self.order.append(f"sound {piece.number}")
        self._lengths.append(len(piece.sound) / 2000)
        if piece.final:
            self.clips.append((sum(self._lengths), self._words))
            self._lengths, self._words = [], []

    async def _control(self, type: str, **fields: Any) -> None:
        self.order.append(" ".join(["speech", *(name for name in ("words", "close") if name in fields)]))
        self._words = [(round(w["start"], 3), w["text"]) for w in fields.get("words", ())]

    async def _wait(self, condition: Any) -> None: ...


def second(seconds: float) -> Any:
    return np.zeros(round(seconds * 1000), np.int16)


def test_voice_cuts_clips_where_a_word_begins() -> None:
    async def test() -> None:
        sent = Sent()
        await sent.voice.words([(0.1, "one"), (0.5, "two")])
        await sent.voice.write(second(0.7))
        assert sent.clips == [(0.5, [(0.1, "one")])]
        await sent.voice.words([(0.8, "three")])
        await sent.voice.write(second(0.4))
        assert sent.clips[1:] == [(0.3, [(0.0, "two")])]
        await sent.voice.close()
        assert sent.clips[2:] == [(0.3, [(0.0, "three")])]

    asyncio.run(test())


def test_voice_sends_words_before_their_sound() -> None:
    async def test() -> None:
        sent = Sent()
        await sent.voice.words([(0.1, "one"), (0.5, "two")])
        await sent.voice.write(second(0.7))
        assert sent.order == ["speech words", "sound 0"]

    asyncio.run(test())


def test_clip_of_unknown_words_is_spoken_from_its_first_piece_on() -> None:
    async def test() -> None:
        sent = Sent()
        await sent.voice.clip(bytes(5 * LONGEST // 2), 1000, close=True)
        assert sent.order == ["sound 0", "speech close", "sound 1", "sound 2"]

    asyncio.run(test())


def test_voice_does_not_wait_long_for_the_end_of_a_word() -> None:
    async def test() -> None:
        sent = Sent()
        await sent.voice.words([(0.0, "well")])
        await sent.voice.write(second(0.9))
        assert sent.clips == []
        await sent.voice.write(second(0.2))
        assert sent.clips == [(1.1, [(0.0, "well")])]
        await sent.voice.words([(1.1, 1.3, "now")])
        await sent.voice.write(second(0.6))
        assert sent.clips[1:] == [(0.6, [(0.0, "now")])]

    asyncio.run(test())


def test_voice_sends_sound_without_words_in_short_clips() -> None:
    async def test() -> None:
        sent = Sent()
        for _ in range(5):
            await sent.voice.write(second(0.1))
        assert sent.clips == [(0.2, []), (0.2, [])]
        await sent.voice.close()
        assert sent.clips[2:] == [(0.1, [])]

    asyncio.run(test())


def test_voice_sends_longer_clips_when_much_was_sent_ahead() -> None:
    async def test() -> None:
        sent = Sent()
        await sent.voice.write(second(1000))
        for _ in range(30):
            await sent.voice.write(second(0.1))
        assert [length for length, _ in sent.clips] == [1000, 2.0]

    asyncio.run(test())


@pytest.mark.parametrize("words", [[(0.1, "late")], [(0.9, "b"), (0.5, "a")]])
def test_voice_refuses_words_that_come_too_late_or_go_back(words: list[Timed]) -> None:
    async def test() -> None:
        sent = Sent()
        await sent.voice.write(second(0.4))
        with pytest.raises(ValueError, match="wanted times from"):
            await sent.voice.words(words)

    asyncio.run(test())


def test_voice_works_without_an_event_loop() -> None:
    async def test(url: str) -> None:
        def run() -> list[str]:
            with connect(url) as client:
                with client.voice(rate=RATE) as voice:
                    voice.words(SAY_WORDS)
                    voice.write(TONE)
                return [client.say(TONE[:2000], RATE).status, voice.ended().status]

        assert await asyncio.to_thread(run) == ["DONE", "DONE"]

    serving(test, real_time=True)


def test_say_and_voice_report_each_word_when_it_is_spoken() -> None:
    words: list[Timed] = [{"start": 0.1, "text": "mama"}, {"start": 0.5, "end": 0.8, "text": "papa"}]
    said: list[dict[str, Any]] = []

    async def test(url: str) -> None:
        async with connect(url) as client:
            end = await client.say(TONE, RATE, words=words, language="en", on_word=said.append)
            assert end.warnings == ()
            assert [(word["start"], word["text"]) for word in said] == [(0.1, "mama"), (0.5, "papa")]
            assert said[1]["time"] - said[0]["time"] == pytest.approx(0.4, abs=1e-3)
            async with client.voice(rate=RATE, language="en", on_word=said.append) as voice:
                await voice.words(words)
                for at in range(0, RATE, RATE // 5):
                    await voice.write(TONE[at : at + RATE // 5])
            await voice.ended()
            assert [word["text"] for word in said[2:]] == ["mama", "papa"]

    serving(test)


def test_say_takes_words_in_milliseconds_with_a_warning() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            end = await client.say(TONE, RATE, words=[(100, "mama"), (500, "papa")], language="en")
            (warning,) = end.warnings
            assert "taken as milliseconds" in warning.text

    serving(test)


def test_play_and_say_tell_that_nothing_was_heard_or_moved(caplog: pytest.LogCaptureFixture) -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            end = await client.play('<bml id="b"><head id="n" lexeme="NODD"/></bml>')
            assert not end.shown
            assert [warning.id for warning in end.warnings] == ["b:n"]
            assert not (await client.say(np.zeros(RATE // 4, np.int16), RATE)).shown
            assert (await client.play('<bml id="b"><head id="n" lexeme="NOD"/></bml>')).shown

    serving(test)
    lines = [r.getMessage() for r in caplog.records if "nothing of it was heard or moved" in r.getMessage()]
    assert len(lines) == 2
