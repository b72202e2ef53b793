"""The worker of espeak-ng, which is only loaded in a process of its own."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from realizer.core.errors import VoiceError
from realizer.speech.engine_voice import RUN
from realizer.speech.espeak.voice import ENGINE, EspeakVoice, choose_voice
from realizer.speech.utterance import SpeechRequest, Utterance
from tests.waiting import LIMIT

pytestmark = pytest.mark.espeak

HELLO = SpeechRequest('Hello, I am <mark name="s1"/>very pleased to <mark name="s2"/>meet you.', ("s1", "s2"))


def same(a: Utterance, b: Utterance) -> bool:
    return (a.words, a.phonemes, a.marks) == (b.words, b.phonemes, b.marks) and np.array_equal(a.pcm, b.pcm)


def test_worker_gives_the_same_sound_in_every_fork(voice: EspeakVoice) -> None:
    process = voice._process
    name, _ = choose_voice(process.hello(), None, "en-US")
    request = {"op": "say", "text": "<speak>Hello, I am here.</speak>", "voice": name, "wpm": 175}
    other = {**request, "text": "<speak>Something else in between.</speak>"}
    first = process.ask(request)
    for _ in range(12):
        process.ask(other)
        assert process.ask(request) == first


def test_worker_gives_the_same_sound_without_fork(voice: EspeakVoice) -> None:
    alone = EspeakVoice(options=("--no-fork",))
    try:
        assert same(alone.say(HELLO), voice.say(HELLO))
        assert alone.say(SpeechRequest("Again, I am."))  # each request its own process
        assert alone.pid is None
    finally:
        alone.close()


def test_worker_ends_with_its_parent() -> None:
    worker = subprocess.Popen(
        [sys.executable, "-P", str(RUN), str(ENGINE.worker)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert worker.stdin is not None
    assert worker.stdout is not None
    assert worker.stdout.readline().startswith(b'{"rate"')
    worker.stdin.close()  # as the system does when the parent dies
    assert worker.wait(LIMIT) == 0
    worker.stdout.close()


def test_worker_finds_data_with_a_long_path(tmp_path: Path, voice: EspeakVoice) -> None:
    import espeakng_loader  # the folder's name only; the engine stays in the worker

    folder = tmp_path.joinpath(*["a" * 60] * 4)
    folder.mkdir(parents=True)
    data = folder / "espeak-ng-data"
    data.symlink_to(espeakng_loader.get_data_path())
    assert len(str(data)) > 200
    lone = EspeakVoice(options=("--data", str(data)))
    try:
        assert same(lone.say(HELLO), voice.say(HELLO))
        assert same(
            lone.say(SpeechRequest("hallo", language="nl")), voice.say(SpeechRequest("hallo", language="nl"))
        )
    finally:
        lone.close()


def test_worker_reports_missing_data(tmp_path: Path) -> None:
    lone = EspeakVoice(options=("--data", str(tmp_path)))
    with pytest.raises(VoiceError, match="does not start"):
        lone.say(HELLO)


def test_worker_speaks_a_long_text(voice: EspeakVoice) -> None:
    lone = EspeakVoice()
    said = lone.say(SpeechRequest("I am here, and it is late. " * 100 + '<mark name="end"/>', ("end",)))
    lone.close()
    assert len(said.words) == 700
    assert said.words[-1].end <= said.marks["end"] <= said.duration
    assert all(a.end <= b.start for a, b in zip(said.words, said.words[1:], strict=False))


def test_worker_divides_phonemes_of_several_clauses(voice: EspeakVoice) -> None:
    words = ["hello", "one. two.", "3"]
    head, _ = voice._process.ask({"op": "phonemes", "voice": "gmw/en-US", "words": words})
    hello, clauses, three = head["phonemes"]
    assert hello == ["h", "ə", "l", "ˈoʊ"]
    assert [sound.strip("ˈ") for sound in clauses] == ["w", "ʌ", "n", "t", "uː"]
    assert three[0] == "θ"


def test_worker_refuses_an_unknown_voice(voice: EspeakVoice) -> None:
    with pytest.raises(VoiceError, match="espeak-ng has no voice 'nobody'"):
        voice._process.ask({"op": "say", "text": "<speak>a</speak>", "voice": "nobody", "wpm": 175})
    assert voice.say(HELLO).duration > 1


def test_worker_lists_voices_and_variants(voice: EspeakVoice) -> None:
    hello = voice._process.hello()
    assert hello["rate"] == 22050
    assert "f3" in hello["variants"]
    tags = {entry["id"]: [tag for _, tag in entry["languages"]] for entry in hello["voices"]}
    assert "en-us" in tags["gmw/en-US"]
    assert "nl" in tags["gmw/nl"]
