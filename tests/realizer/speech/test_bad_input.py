"""Bad texts and dead engines in documents: one clear warning, and everything else plays."""

import os
import signal
import threading
from typing import Any

import pytest

import realizer
from bml_schema import Speech
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import VOCABULARY
from realizer.behaviours.speech import speech_request
from realizer.core.errors import RealizerError, VoiceError
from realizer.scheduling.timing import Schedule
from realizer.server.runtime.engines import Engines
from realizer.server.session.effects import Speak
from realizer.speech import engine_voice
from realizer.speech.espeak.voice import EspeakVoice
from realizer.speech.hibari.voice import HibariVoice
from realizer.speech.registry import VOICES
from realizer.speech.utterance import SpeechRequest, Utterance, Voice
from tests.waiting import LIMIT

pytestmark = pytest.mark.xdist_group("voices")

SSML = "application/ssml+xml"


def document(speech: str) -> str:
    return (
        '<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="b">'
        f'<speech id="s">{speech}</speech><head id="h" lexeme="NOD" start="0" end="1"/></bml>'
    )


def played(speech: str, voice: Voice | str) -> Schedule:
    schedule = realizer.schedule(document(speech), voice=voice)
    assert points(schedule, "h")["end"] == 1.0
    return schedule


def points(schedule: Schedule, behaviour: str) -> dict[str, float]:
    return schedule.to_json()["behaviours"][behaviour]  # type: ignore[no-any-return]


def warned(schedule: Schedule) -> list[str]:
    assert {w.id for w in schedule.warnings} <= {"b:s"}
    return [w.text for w in schedule.warnings]


BAD = [
    ("<text></text>", "empty"),
    ("<text>  </text>", "empty"),
    ("<text>...</text>", "empty"),
    ("<text>😀</text>", "emoji"),
    ("<text>one 😀 two</text>", "emoji"),
    (f"<text>{'word ' * 40_000}</text>", "at most 20000 characters, got 200000"),
]


@pytest.mark.espeak
@pytest.mark.parametrize(("speech", "words"), BAD, ids=range(len(BAD)))
def test_speech_of_a_bad_text_gives_one_warning(voice: EspeakVoice, speech: str, words: str) -> None:
    warnings = warned(played(speech, voice))
    assert len(warnings) == 1
    assert words in warnings[0]
    assert "line 1" in warnings[0]
    assert not warned(played("<text>and now?</text>", voice))


@pytest.mark.hibari
@pytest.mark.parametrize(("speech", "words"), BAD, ids=range(len(BAD)))
def test_speech_of_a_bad_text_gives_one_warning_by_hibari(
    neural: HibariVoice, speech: str, words: str
) -> None:
    warnings = warned(played(speech, neural))
    assert len(warnings) == 1
    assert words in warnings[0]


@pytest.mark.parametrize(
    "text", ["one &#9; two", "one \x7f\u202e\u200b two", "Привет 你好 مرحبا שלום नमस्ते end"]
)
@pytest.mark.espeak
def test_speech_of_mixed_scripts_gives_no_warning(voice: EspeakVoice, text: str) -> None:
    schedule = played(f"<text>{text}</text>", voice)
    assert not schedule.warnings
    assert points(schedule, "s")["end"] > 0.5


def test_speech_without_words_has_a_length() -> None:
    times = points(played('<text>... <sync id="a"/></text>', "silent"), "s")
    assert times["start"] == 0
    assert times["end"] == pytest.approx(0.1)


@pytest.mark.espeak
def test_speech_of_odd_ssml_gives_one_warning(voice: EspeakVoice) -> None:
    ssml = (
        '<speak><prosody rate="banana" pitch="+10Hz">one</prosody><nonsense>two</nonsense><break time="x"/>'
        '<break time="3600s"/><mark name="m"/>three <mark name=""/>four <mark name="m"/>five</speak>'
    )
    schedule = played(f'<text>a</text><description priority="1" type="{SSML}">{ssml}</description>', voice)
    (warnings,) = warned(schedule)
    odd = (
        'rate="banana"',
        "<nonsense>",
        'time="x"',
        "a break of 3600 s is cut to 10 s",
        "without a name",
        "'m'",
    )
    assert [words for words in odd if words not in warnings] == []
    assert "Hz" not in warnings
    assert list(points(schedule, "s")) == ["start", "m", "end"]
    assert points(schedule, "s")["end"] > points(schedule, "s")["m"] + 0.6


@pytest.mark.espeak
@pytest.mark.parametrize(
    "speech",
    [
        '<text xml:lang="xx-YY">hello there</text>',
        f'<text>a</text><description priority="1" type="{SSML}">'
        '<speak xml:lang="xx-YY">hello</speak></description>',
    ],
)
def test_speech_in_an_unknown_language_gives_a_warning(voice: EspeakVoice, speech: str) -> None:
    warnings = warned(played(speech, voice))
    assert warnings == [
        "line 1, /bml/speech[1]: speech: espeak-ng does not speak 'xx-YY': spoken as English",
    ]


def test_speech_request_has_the_language_of_the_text() -> None:
    from bml_schema import parse

    for given, wanted in ((' xml:lang="nl-NL"', "nl-NL"), ("", "fr-FR")):
        node = parse(document(f"<text{given}>hallo</text>"), VOCABULARY).behaviours[0]
        assert isinstance(node, Speech)
        asked = speech_request(node, PlanningContext(language="fr-FR"))
        assert asked is not None
        assert asked.language == wanted


def test_schedule_refuses_an_unknown_voice() -> None:
    with pytest.raises(VoiceError, match=f"wanted one of {', '.join(VOICES)}, got 'nobody'"):
        realizer.schedule(document("<text>one</text>"), voice="nobody")


@pytest.mark.espeak
@pytest.mark.parametrize("name", ["espeak", "espeak:nl", "espeak:en-gb+f3"])
def test_engines_speak_by_the_named_voice(name: str) -> None:
    studio = Engines()
    alone = EspeakVoice(name.partition(":")[2] or None)
    try:
        said = studio.speak(Speak(1, SpeechRequest("een twee", voice=name)))
        assert not isinstance(said, RealizerError)
        assert said.warnings == ()
        assert said.phonemes == alone.say(SpeechRequest("een twee")).phonemes
    finally:
        studio.close()
        alone.close()


@pytest.mark.parametrize(
    "name",
    [pytest.param("espeak", marks=pytest.mark.espeak), pytest.param("hibari", marks=pytest.mark.hibari)],
)
@pytest.mark.slow
def test_engines_lose_one_sound_when_a_process_is_killed(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    studio = Engines()
    answers: list[object] = []
    exchange, begun = engine_voice._exchange, threading.Event()

    def announced(process: Any, request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
        begun.set()
        return exchange(process, request)

    try:
        first = studio.speak(Speak(1, SpeechRequest("One two three.", voice=name)))
        engine = studio._voices[name]
        assert isinstance(engine, EspeakVoice | HibariVoice)
        pid = engine.pid
        assert pid is not None
        os.kill(pid, signal.SIGSTOP)  # so that it can never answer before it dies
        order = Speak(2, SpeechRequest("It is raining here today. " * 50, voice=name))
        asking = threading.Thread(target=lambda: answers.append(studio.speak(order)))
        monkeypatch.setattr(engine_voice, "_exchange", announced)
        asking.start()
        assert begun.wait(LIMIT)
        os.kill(pid, signal.SIGKILL)
        asking.join()
        again = studio.speak(Speak(3, SpeechRequest("Four five six.", voice=name)))
    finally:
        studio.close()
    assert not isinstance(first, RealizerError)
    assert isinstance(answers[0], VoiceError)
    assert not isinstance(again, RealizerError)
    assert again.duration > 0.5
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert "going on without sound" in lines[0]


@pytest.mark.espeak
def test_engine_killed_between_requests_is_replaced(voice: EspeakVoice) -> None:
    voice.say(SpeechRequest("Before it died."))
    engine = voice._process._running
    assert engine is not None
    engine.process.kill()
    engine.process.wait()
    assert voice.say(SpeechRequest("After it died.")).duration > 0.5


def test_speech_of_a_broken_voice_is_silent_with_a_warning() -> None:
    class Broken:
        name = "broken"

        def say(self, request: SpeechRequest) -> Utterance:
            raise VoiceError("it died")

        def close(self) -> None:
            pass

    schedule = played('<text>one <sync id="a"/>two</text>', Broken())
    assert warned(schedule) == ["line 1, /bml/speech[1]: speech: it died; the silent voice is used instead"]
    assert points(schedule, "s")["end"] > points(schedule, "s")["a"] > 0
