"""The silent voice: times of words, marks and phonemes."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.lips.lip_sync import lip_channels
from realizer.speech.letter_to_sound import syllable_facts
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import SpeechRequest


def test_silent_words_last_their_units() -> None:
    said = SilentVoice().say(SpeechRequest("Banana, dog."))
    unit = syllable_facts()["unit"]
    assert [(w.text, round((w.end - w.start) / unit)) for w in said.words] == [("Banana", 3), ("dog", 1)]
    assert said.words[1].start - said.words[0].end == pytest.approx(unit)
    assert said.pcm is None
    assert said.sample_rate == 0


def test_silent_marks_are_at_the_next_word_or_the_end() -> None:
    said = SilentVoice().say(
        SpeechRequest('<mark name="a"/>One, <mark name="b"/>two.<mark name="c"/>', ("a", "b", "c"))
    )
    assert said.marks == {"a": said.words[0].start, "b": said.words[1].start, "c": said.words[1].end}


def test_silent_voice_supports_breaks_and_prosody() -> None:
    plain = SilentVoice().say(SpeechRequest("one two")).duration
    assert SilentVoice().say(SpeechRequest('one <break time="700ms"/> two')).duration == pytest.approx(
        plain + 0.7
    )
    slow = SilentVoice().say(SpeechRequest('one <prosody rate="50%">two</prosody>'))
    assert slow.words[1].end - slow.words[1].start == pytest.approx(0.4)
    assert SilentVoice().say(SpeechRequest('<sub alias="World Wide Web">WWW</sub>')).words[2].text == "Web"


def test_silent_rate_divides_time() -> None:
    spans = [
        (said.words[-1].end - said.words[0].start)
        for said in (SilentVoice().say(SpeechRequest("one, two banana", rate=rate)) for rate in (0.5, 1, 2))
    ]
    assert spans[0] == pytest.approx(2 * spans[1])
    assert spans[1] == pytest.approx(2 * spans[2])


def test_silent_empty_text_has_no_length() -> None:
    said = SilentVoice().say(SpeechRequest('<mark name="m"/> '))
    assert (said.duration, said.marks) == (0.0, {"m": 0.0})
    assert said.warnings


@given(st.text(max_size=80), st.sampled_from(["en", "nl", "fr", "de", "es", "pl", "zh", "xx", ""]))
def test_silent_times_of_any_text_are_in_order(text: str, language: str) -> None:
    said = SilentVoice().say(SpeechRequest(text, language=language))
    edges = [said.phonemes[0].start, *(p.end for p in said.phonemes)] if said.phonemes else [0.0]
    assert edges == sorted(edges)
    assert edges[-1] == pytest.approx(said.duration)
    assert all(a.end == b.start for a, b in zip(said.phonemes, said.phonemes[1:], strict=False))
    assert all(a.end <= b.start + 1e-9 for a, b in zip(said.words, said.words[1:], strict=False))
    lip_channels(said.phonemes, 0.0)
