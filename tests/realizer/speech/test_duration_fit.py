"""Speech of a given length."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.lips.lip_sync import lip_channels
from realizer.speech.duration_fit import shortened, speak_to_length, stretched, with_volumes
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import WARP, Phoneme, SpeechRequest, Utterance, Word

SAY = SpeechRequest('one two <mark name="m"/>three four five', ("m",))


@pytest.mark.parametrize("ratio", [0.7, 0.95, 1.0, 1.3, 1.6])
def test_speak_to_length_has_exactly_that_length(ratio: float) -> None:
    voice = SilentVoice()
    natural = voice.say(SAY)
    made = speak_to_length(voice, SpeechRequest(SAY.ssml, SAY.marks, seconds=natural.duration * ratio))
    assert made.duration == pytest.approx(natural.duration * ratio)
    assert made.phonemes[-1].end == pytest.approx(made.duration)
    assert made.marks["m"] / made.duration == pytest.approx(natural.marks["m"] / natural.duration, abs=0.05)
    assert made.stretch == WARP, "what is left can be warped"


def test_speak_to_length_without_a_length_is_the_voices_own() -> None:
    voice = SilentVoice()
    assert speak_to_length(voice, SAY).duration == voice.say(SAY).duration
    assert voice.say(SAY).stretch[0] < 1 < voice.say(SAY).stretch[1]


@pytest.mark.espeak
@pytest.mark.parametrize("ratio", [0.75, 1.4])
def test_speak_to_length_stretches_sound_and_times(ratio: float) -> None:
    from realizer.speech.registry import find_voice

    voice = find_voice("espeak")
    try:
        natural = voice.say(SAY)
        made = speak_to_length(voice, SpeechRequest(SAY.ssml, SAY.marks, seconds=natural.duration * ratio))
        assert made.pcm is not None
        assert len(made.pcm) == round(made.duration * made.sample_rate)
        assert made.words[-1].end == pytest.approx(natural.words[-1].end * ratio, rel=0.1)
        loud = np.abs(made.pcm.astype(float))
        assert loud[: int(made.words[0].end * made.sample_rate)].max() > 1000
    finally:
        voice.close()


def test_stretched_sound_keeps_its_loudness() -> None:
    wave = (8000 * np.sin(np.arange(22050) * 0.1)).astype(np.int16)
    made = stretched(Utterance(1.0, (), (), {"m": 0.5}, 22050, wave), {"end": 1.005})
    assert made.pcm is not None
    assert np.abs(made.pcm).max() == pytest.approx(8000, rel=0.01)
    assert made.marks["m"] == pytest.approx(0.5025)


def test_stretched_sound_has_marks_at_given_times() -> None:
    loud = np.zeros(22050, np.int16)
    loud[11025:11035] = 9000  # a click at the mark
    made = stretched(Utterance(1.0, (), (), {"m": 0.5}, 22050, loud), {"m": 0.53, "end": 1.02})
    assert (made.duration, made.marks["m"]) == (1.02, 0.53)
    assert made.pcm is not None
    assert int(np.argmax(made.pcm)) / 22050 == pytest.approx(0.53, abs=0.001)


@pytest.mark.espeak
@pytest.mark.parametrize("seconds", [1.3, 1.8, 2.3, 3.1])
def test_speak_to_length_tries_rates_until_little_is_left(seconds: float) -> None:
    from realizer.speech.registry import find_voice

    class Heard:
        """A voice that records the durations of its utterances."""

        name = "heard"

        def __init__(self) -> None:
            self.voice = find_voice("espeak")
            self.lengths: list[float] = []

        def say(self, request: SpeechRequest) -> Utterance:
            said = self.voice.say(request)
            self.lengths.append(said.duration)
            return said

        def close(self) -> None:
            self.voice.close()

    voice = Heard()
    try:
        text = "Hello, I am very pleased to meet you."
        made = speak_to_length(voice, SpeechRequest(text, seconds=seconds))
    finally:
        voice.close()
    assert made.duration == pytest.approx(seconds)
    assert min(abs(length / seconds - 1) for length in voice.lengths) < 0.012


def test_speak_to_length_stops_at_the_limit_of_a_voice() -> None:
    asked = []

    class Rigid:
        name = "rigid"

        def say(self, request: SpeechRequest) -> Utterance:
            asked.append(request.rate)
            return Utterance(1.0, (), (), {})

        def close(self) -> None:
            pass

    assert speak_to_length(Rigid(), SpeechRequest("x", seconds=3.0)).duration == 3.0
    assert len(asked) == 2


def test_stretched_utterance_has_no_sections() -> None:
    made = SilentVoice().say(SAY)
    whole = replace(made, sections=((0.0, made),))
    assert stretched(whole, {"end": 1.1 * made.duration}).sections == ()


def volumes(ssml: str, seconds: float | None = None) -> list[set[float]]:
    """The volumes of the phonemes of each word."""
    said = speak_to_length(SilentVoice(), SpeechRequest(ssml, seconds=seconds))
    return [
        {p.volume for p in said.phonemes if p.ipa and w.start <= (p.start + p.end) / 2 < w.end}
        for w in said.words
    ]


def test_with_volumes_changes_words_inside_prosody() -> None:
    assert volumes('one <prosody volume="x-loud">two three</prosody> four') == [{1.0}, {2.0}, {2.0}, {1.0}]
    assert volumes('<prosody volume="+6dB">one</prosody>')[0].pop() == pytest.approx(1.995, abs=0.01)


def test_with_volumes_multiplies_nested_prosody() -> None:
    nested = '<prosody volume="soft">a <prosody volume="50%">b</prosody></prosody>'
    assert volumes(nested) == [{0.5}, {0.25}]


def test_with_volumes_survives_stretching() -> None:
    assert volumes('one <prosody volume="loud">two</prosody>', seconds=2.5) == [{1.0}, {1.4}]


def test_with_volumes_keeps_other_speech() -> None:
    said = SilentVoice().say(SpeechRequest("the volume is <prosody rate='fast'>high</prosody>"))
    assert with_volumes(SpeechRequest("the volume is <prosody rate='fast'>high</prosody>"), said) is said


def test_with_volumes_scales_indices_of_merged_words() -> None:
    merged = (Word(0.0, 0.4, "I am"), Word(0.4, 0.8, "very glad"))
    sounds = (Phoneme(0.0, 0.4, "a"), Phoneme(0.4, 0.8, "e"), Phoneme(0.8, 1.0, ""))
    said = with_volumes(
        SpeechRequest('I am <prosody volume="loud">very glad</prosody>'), Utterance(1.0, merged, sounds, {})
    )
    assert [p.volume for p in said.phonemes] == [1.0, 1.4, 1.0]


def test_with_volumes_opens_the_mouth_by_volume() -> None:
    jaws = []
    for volume in ("x-soft", "medium", "x-loud"):
        said = speak_to_length(SilentVoice(), SpeechRequest(f'<prosody volume="{volume}">papa car</prosody>'))
        jaws.append(
            max(c.values.max() for c in lip_channels(said.phonemes, 0.0) if c.target.name == "open_jaw")
        )
    assert jaws[0] < 0.8 * jaws[1]
    assert jaws[2] > 1.2 * jaws[1]


@given(st.text(max_size=60), st.integers(0, 5))
def test_with_volumes_keeps_times_and_phonemes(text: str, count: int) -> None:
    words = tuple(Word(k * 0.2, k * 0.2 + 0.2, "x") for k in range(count))
    sounds = tuple(Phoneme(k * 0.1, k * 0.1 + 0.1, "a") for k in range(2 * count))
    say = SpeechRequest(f'<prosody volume="loud">{text}</prosody>')
    said = with_volumes(say, Utterance(count * 0.2, words, sounds, {}))
    assert [(p.start, p.end, p.ipa) for p in said.phonemes] == [(p.start, p.end, p.ipa) for p in sounds]
    assert {p.volume for p in said.phonemes} <= {1.0, 1.4}


def test_shortened_utterance_loses_its_closing_pause() -> None:
    pause = Phoneme(0.8, 1.2, "")
    pcm = np.ones(1200, np.int16)
    whole = Utterance(1.2, (Word(0.0, 0.8, "oh"),), (Phoneme(0.0, 0.8, "o"), pause), {"m": 1.1}, 1000, pcm)
    assert whole.silent_from == 0.8
    short = shortened(whole, 0.9001)
    assert (short.duration, len(short.pcm), short.marks["m"]) == (0.9, 900, 0.9)
    assert [p.end for p in short.phonemes] == [0.8, 0.9]
    assert [w.end for w in short.words] == [0.8]
    assert shortened(whole, 0.5).silent_from == 0.5


@pytest.mark.parametrize(("off", "again"), [(0.004, False), (0.008, True)])
def test_speak_to_length_tries_another_rate_over_6_parts_in_1000(off: float, again: bool) -> None:
    rates = []

    class Counting(SilentVoice):
        def say(self, request: SpeechRequest) -> Utterance:
            rates.append(request.rate)
            return super().say(request)

    natural = SilentVoice().say(SAY).duration
    speak_to_length(Counting(), replace(SAY, seconds=natural * (1 + off)))
    assert (len(rates) > 1) is again
