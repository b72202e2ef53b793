"""Long texts synthesized in parts: exact times, seams without clicks, estimates of the rest."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.server.speech.long_text import PART, LongText
from realizer.speech.espeak.voice import EspeakVoice
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import Phoneme, SpeechRequest, Utterance, Word

SENTENCES = [
    "When all of them had come to the house by the sea, they sat down and waited for him.",
    'Nobody said <mark name="a"/>a word!',
    'Then, after an hour, <mark name="b"/>the door was opened: who was it?',
    "It was <emphasis level='strong'>late. Very late</emphasis> &amp; nobody knew it.",
] * 6
TEXT = " ".join(s.replace('"a"', f'"a{n}"').replace('"b"', f'"b{n}"') for n, s in enumerate(SENTENCES))
MARKS = tuple(f"{'a' if n % 4 == 1 else 'b'}{n}" for n in range(24) if n % 4 in (1, 2))


@pytest.fixture(scope="module")
def voice():
    voice = EspeakVoice()
    yield voice
    voice.close()


def grown(voice, say: SpeechRequest) -> tuple[list[SpeechRequest], list[Utterance]]:
    """Return the parts, and the utterance after each of them."""
    growing, parts, made = LongText(say), [], []
    while (part := growing.next()) is not None:
        parts.append(part)
        made.append(growing.add_part(voice.say(part)))
    return parts, made


def test_next_returns_a_clause_first_and_the_whole_text_in_parts() -> None:
    parts, _ = grown(SilentVoice(), SpeechRequest(TEXT, MARKS))
    assert parts[0].ssml == "When all of them had come to the house by the sea,"
    assert "".join(p.ssml for p in parts) == TEXT
    assert tuple(m for p in parts for m in p.marks) == MARKS
    assert all(PART <= len(p.ssml) < 2 * PART for p in parts[1:-1])


def test_next_repeats_prosody_around_each_part(voice) -> None:
    slow = SpeechRequest(f'<prosody rate="slow">{TEXT}</prosody>', MARKS)
    parts, made = grown(voice, slow)
    assert parts[0].ssml.count(" ") < 15
    assert len(parts) > 4
    assert all(abs(u.duration / made[-1].duration - 1) < 0.25 for u in made[1:])
    assert [p.ssml.count("<prosody") - p.ssml.count("</prosody") for p in parts] == [0] * len(parts)
    assert made[-1].duration == pytest.approx(voice.say(slow).duration, rel=0.01)
    assert set(made[-1].marks) == set(MARKS)
    twice = SpeechRequest(
        f'<prosody rate="slow">{TEXT}</prosody> And <prosody rate="fast">{TEXT}</prosody>', MARKS
    )
    assert all(p.ssml.count("<prosody") == p.ssml.count("</prosody") for p in grown(SilentVoice(), twice)[0])


def test_add_part_does_not_change_earlier_parts(voice) -> None:
    _, made = grown(voice, SpeechRequest(TEXT, MARKS))
    for before, after in pairwise(made):
        length = len(before.pcm)
        assert np.array_equal(after.pcm[:length], before.pcm)
        assert after.words[: len(before.words)] == before.words
        done = {m: t for m, t in before.marks.items() if t <= length / before.sample_rate - 0.001}
        assert {m: after.marks[m] for m in done} == done
    assert made[-1].duration == pytest.approx(len(made[-1].pcm) / made[-1].sample_rate)
    assert [w.text for w in made[-1].words] == [w.text for w in voice.say(SpeechRequest(TEXT, MARKS)).words]


def test_add_part_places_marks_exactly(voice) -> None:
    """Check that parts have their own sound and marks at their places in the whole."""
    parts, made = grown(voice, SpeechRequest(TEXT, MARKS))
    whole = made[-1]
    assert set(whole.marks) == set(MARKS)
    for part, (start, utterance) in zip(parts, whole.sections, strict=True):
        first = start * whole.sample_rate
        assert first == pytest.approx(round(first), abs=1e-6), "to the sample"
        assert np.array_equal(whole.pcm[round(first) :][: len(utterance.pcm)], utterance.pcm)
        alone = voice.say(part)
        for mark in part.marks:
            assert whole.marks[mark] - start == pytest.approx(alone.marks[mark], abs=1e-9)


def test_add_part_joins_parts_at_pauses(voice) -> None:
    said, (parts, made) = voice.say(SpeechRequest(TEXT, MARKS)), grown(voice, SpeechRequest(TEXT, MARKS))
    joined = made[-1]
    assert joined.duration == pytest.approx(said.duration, abs=0.02 * len(parts))
    late = np.array([b.start - a.start for a, b in zip(said.words, joined.words, strict=True)])
    assert np.abs(np.diff(late)).max() < 0.02, "no pause is longer or shorter by more"
    pcm = joined.pcm.astype(float)
    steps = np.abs(np.diff(pcm))
    for start, _ in joined.sections[1:]:
        at = round(start * joined.sample_rate)
        assert np.abs(pcm[at - 20 : at]).max() < 30, "it ends in silence"
        assert steps[at - 1] < 0.01 * steps.max(), "and begins softly"


def test_add_part_estimates_the_end_and_missing_marks(voice) -> None:
    _, made = grown(voice, SpeechRequest(TEXT, MARKS))
    end = made[-1].duration
    assert [abs(u.duration / end - 1) < 0.25 for u in made] == [True] * len(made)
    assert abs(made[1].duration / end - 1) < 0.1
    assert all(abs(made[1].marks[m] - made[-1].marks[m]) < 0.1 * end for m in MARKS)
    for u in made:
        assert sorted(u.marks, key=lambda m: u.marks[m]) == list(MARKS)


def test_add_part_estimates_marks_by_the_characters_before_them() -> None:
    text = 'They sat down. <mark name="m"/>When <mark name="n"/>' + "all of them had come, they waited. " * 8
    growing = LongText(SpeechRequest(text, ("m", "n")))
    first = growing.next()
    assert first is not None
    assert first.ssml == "They sat down."
    marks = growing.add_part(SilentVoice().say(first)).marks
    blank = marks["m"] - growing.ready_until
    assert blank > 0
    assert marks["n"] - marks["m"] == pytest.approx(len("When ") * blank)


def test_add_part_leaves_silence_before_a_late_part(voice) -> None:
    growing = LongText(SpeechRequest(TEXT, MARKS))
    first = growing.add_part(voice.say(growing.next()))
    made = growing.ready_until
    second = growing.add_part(voice.say(growing.next()), made + 1.0)
    start = second.sections[1][0]
    assert start == pytest.approx(made + 1.0, abs=1e-3)
    between = second.pcm[len(first.pcm) : round(start * second.sample_rate)]
    assert len(between) == pytest.approx(second.sample_rate, abs=40)
    assert not between.any()
    assert second.words[len(first.words)].start >= start


def test_add_part_accepts_a_part_without_sound(voice) -> None:
    growing = LongText(SpeechRequest(TEXT))
    growing.add_part(SilentVoice().say(growing.next()))
    made = growing.ready_until
    loud = growing.add_part(voice.say(growing.next()))
    assert loud.sample_rate
    assert not loud.pcm[: round(made * loud.sample_rate) - 1].any()
    assert loud.pcm[round(made * loud.sample_rate) :].any()


def test_add_part_resamples_to_the_rate_of_the_first_part() -> None:
    growing = LongText(SpeechRequest(TEXT))
    growing.next()
    tone = np.full(800, 1000, np.int16)
    growing.add_part(Utterance(0.1, (Word(0, 0.1, "a"),), (Phoneme(0, 0.1, "a"),), {}, 8000, tone))
    growing.next()
    both = growing.add_part(Utterance(0.05, (), (), {}, 16000, tone))
    assert both.sample_rate == 8000
    assert len(both.pcm) == 1200


@given(
    st.lists(
        st.sampled_from(['<mark name="m"/>', "One. ", "two, ", "<p>", "</p>", "&amp;", " "]), max_size=80
    )
)
def test_long_text_completes_any_text(pieces) -> None:
    say = SpeechRequest("".join(pieces), ("m",))
    parts, made = grown(SilentVoice(), say)
    assert "".join("".join(p.ssml for p in parts).split()) == "".join(say.ssml.split())
    if made:
        assert made[-1].duration == pytest.approx(sum(u.duration for _, u in made[-1].sections))
        assert replace(made[-1], sections=()).sections == ()


def test_add_part_keeps_volumes() -> None:
    class Loud(SilentVoice):
        def say(self, request: SpeechRequest) -> Utterance:
            made = super().say(request)
            return replace(made, phonemes=tuple(replace(p, volume=2.0) for p in made.phonemes))

    _, made = grown(Loud(), SpeechRequest(TEXT, MARKS))
    assert {p.volume for p in made[-1].phonemes} == {2.0}
