"""Times from the events of espeak-ng, made up and real."""

import ctypes
import importlib.util
from pathlib import Path

import numpy as np
import pytest

from realizer.speech.espeak.document import Document
from realizer.speech.espeak.espeak_worker import Event as Struct
from realizer.speech.espeak.events import END, MARK, PHONEME, WORD, Event, read_answer, timeline
from realizer.speech.espeak.voice import EspeakVoice
from realizer.speech.utterance import Phoneme, SpeechRequest, Utterance, Word
from realizer.speech.words import PlacedMark

RATE = 1000
END_EVENT = (END, 1000, 0, "")
HELLO = SpeechRequest("Hello, I am very pleased to meet you.")
SPOKEN = pytest.mark.espeak
SENTENCE = 2


def starts(utterance: Utterance) -> dict[str, float]:
    return {word.text: word.start for word in utterance.words}


def document(*words: str, marks: tuple[PlacedMark, ...] = ()) -> Document:
    """Return a document whose words are ten characters apart."""
    return Document("", tuple((word, 10 * k) for k, word in enumerate(words)), marks)


def times_of(document: Document, events: list[Event], alone: dict[str, list[str]] | None = None) -> Utterance:
    pcm = np.full(1000, 1000, np.int16)
    return timeline(document, events, pcm, RATE, lambda words: [(alone or {})[word] for word in words])


def word(sample: int, index: int) -> Event:
    return WORD, sample, 10 * index, ""


def sound(sample: int, ipa: str) -> Event:
    return PHONEME, sample, 0, ipa


def test_timeline_has_words_phonemes_and_their_stress() -> None:
    events = [word(100, 0), sound(100, "ˈaɪ"), word(300, 1), sound(300, "m"), sound(500, ""), END_EVENT]
    found = times_of(document("I", "am"), events)
    assert found.words == (Word(0.1, 0.3, "I"), Word(0.3, 0.5, "am"))
    assert found.phonemes == (
        Phoneme(0.0, 0.1, ""),
        Phoneme(0.1, 0.3, "aɪ", 1),
        Phoneme(0.3, 0.5, "m"),
        Phoneme(0.5, 1.0, ""),
    )


def test_timeline_orders_the_starts_of_sounds() -> None:
    starts = zip((100, 300, 250, 400), "piko", strict=True)
    events = [word(100, 0), *(sound(at, ipa) for at, ipa in starts), END_EVENT]
    found = times_of(document("pico"), events).phonemes
    assert [(p.ipa, p.start, p.end) for p in found[1:]] == [
        ("p", 0.1, 0.25), ("i", 0.25, 0.3), ("k", 0.3, 0.4), ("o", 0.4, 1.0)
    ]  # fmt: skip


def test_timeline_divides_words_that_were_merged() -> None:
    events = [word(0, 0), sound(0, "aɪ"), sound(200, "ɐ"), sound(400, "m"), sound(600, "h"), END_EVENT]
    found = times_of(document("I", "am", "h"), events, {"I": ["aɪ"], "am": ["æ", "m"], "h": ["h"]})
    assert [(w.start, w.end) for w in found.words] == [(0.0, 0.2), (0.2, 0.6), (0.6, 1.0)]


def test_timeline_moves_words_that_are_too_early_to_their_phoneme() -> None:
    events = [word(0, 0), sound(0, "n"), word(0, 1), sound(300, "ə"), END_EVENT]
    assert [w.start for w in times_of(document("an", "a"), events).words] == [0.0, 0.3]


def test_timeline_places_marks_at_words_and_before_breaks() -> None:
    marks = (PlacedMark("a", 1, False), PlacedMark("b", 1, True), PlacedMark("c", 2, False))
    events = [
        word(0, 0), sound(0, "a"), (MARK, 150, 0, "m1"), sound(200, ""), word(400, 1), sound(400, "o"),
        (MARK, 900, 0, "m2"), END_EVENT,
    ]  # fmt: skip
    # Names are in the order of the text, so times do not fall.
    assert times_of(document("a", "o", marks=marks), events).marks == {"a": 0.4, "b": 0.4, "c": 0.9}
    assert times_of(document("a", "o", marks=marks[1:2]), [(MARK, 150, 0, "m0"), *events]).marks == {
        "b": 0.15
    }


def test_timeline_adds_closures_to_their_stops() -> None:
    pcm = np.full(1000, 1000, np.int16)
    pcm[150:200] = 0
    events = [word(0, 0), sound(0, "a"), sound(200, "p"), sound(300, "a"), END_EVENT]
    found = timeline(document("apa"), events, pcm, RATE, lambda words: [])
    assert [p.start for p in found.phonemes] == [0.0, 0.15, 0.3]
    pcm[:200] = 0  # a vowel keeps a part of its time
    assert [p.start for p in timeline(document("apa"), events, pcm, RATE, lambda words: []).phonemes] == [
        0.0,
        0.08,
        0.3,
    ]


def test_timeline_without_words_or_events_is_a_pause() -> None:
    found = times_of(document(), [END_EVENT])
    assert (found.words, found.phonemes, found.marks) == ((), (Phoneme(0.0, 1.0, ""),), {})
    assert times_of(document("x"), []).words == (Word(0.0, 0.0, "x"),)


@SPOKEN
def test_phonemes_cover_the_sound(voice: EspeakVoice) -> None:
    said = voice.say(HELLO)
    assert said.phonemes[0].start == 0
    assert said.phonemes[-1].end == said.duration
    assert [p.end for p in said.phonemes[:-1]] == [p.start for p in said.phonemes[1:]]
    assert all(p.end > p.start for p in said.phonemes)
    assert [p.ipa for p in said.phonemes if p.stress == 1] == ["oʊ", "ɛ", "iː", "iː"]


@SPOKEN
def test_phonemes_sound_and_pauses_are_silent(voice: EspeakVoice) -> None:
    said = voice.say(HELLO)
    assert said.pcm is not None
    for phoneme in said.phonemes:
        part = said.pcm[round(phoneme.start * said.sample_rate) : round(phoneme.end * said.sample_rate)]
        loud = np.abs(part.astype(int)).max()
        if phoneme.ipa:
            assert loud > 100, phoneme
        elif phoneme.end - phoneme.start > 0.1:
            assert np.sqrt(np.mean(part.astype(float) ** 2)) < 100, phoneme


@SPOKEN
def test_closures_belong_to_their_stops(voice: EspeakVoice) -> None:
    said = voice.say(SpeechRequest("My happy puppy."))
    stops = [p for p in said.phonemes if p.ipa == "p"]
    assert said.pcm is not None
    assert len(stops) == 3
    for stop in stops:
        first = round(stop.start * said.sample_rate)
        assert np.abs(said.pcm[first + 20 : first + 400].astype(int)).max() < 100
        assert stop.end - stop.start > 0.06


@SPOKEN
def test_merged_words_are_divided(voice: EspeakVoice) -> None:
    said = voice.say(SpeechRequest("I am in the house, and it would have been the one of the best."))
    assert [w.text for w in said.words] == [
        *("I", "am", "in", "the", "house", "and", "it", "would"),
        *("have", "been", "the", "one", "of", "the", "best"),
    ]
    assert all(word.end - word.start > 0.04 for word in said.words)
    spans = {w.text: (w.start, w.end) for w in said.words[:2]}
    within = lambda word: [p.ipa for p in said.phonemes if spans[word][0] <= p.start < spans[word][1]]  # noqa: E731
    assert within("I") == ["aɪ"]
    assert within("am") in (["ɐ", "m"], ["æ", "m"])


@SPOKEN
@pytest.mark.parametrize(
    ("language", "text", "word"),
    [
        ("en-US", 'I <mark name="m"/>am here.', "am"),
        ("pl-PL", 'nie <mark name="m"/>wiem tego', "wiem"),
        ("fr-FR", 'Je ne sais <mark name="m"/>pas.', "pas"),
    ],
)
def test_marks_inside_merged_words_are_at_their_word(
    voice: EspeakVoice, language: str, text: str, word: str
) -> None:
    said = voice.say(SpeechRequest(text, ("m",), language))
    assert said.marks["m"] == starts(said)[word] > 0.05
    assert said.marks["m"] in {phoneme.start for phoneme in said.phonemes} | {w.end for w in said.words}


@SPOKEN
@pytest.mark.parametrize(
    ("language", "text", "word"),
    [
        ("de-DE", 'Das sind 42 Äpfel <mark name="m"/>und Birnen.', "und"),
        ("nl-NL", 'Dat zijn 42 appels <mark name="m"/>en peren.', "en"),
        ("pl-PL", 'To są 42 jabłka <mark name="m"/>i gruszki.', "i"),
    ],
)
def test_marks_are_after_the_short_pause_before_a_word(
    voice: EspeakVoice, language: str, text: str, word: str
) -> None:
    said = voice.say(SpeechRequest(text, ("m",), language))
    assert said.marks["m"] == starts(said)[word]
    assert said.marks["m"] in {phoneme.start for phoneme in said.phonemes if phoneme.ipa}


@SPOKEN
def test_marks_of_five_languages_are_exact_to_five_milliseconds(
    voice: EspeakVoice,
) -> None:
    path = Path(__file__).parents[4] / "benchmarks" / "marks.py"
    spec = importlib.util.spec_from_file_location("marks", path)
    assert spec is not None
    assert spec.loader is not None
    marks = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(marks)
    found = list(marks.errors(voice, 60))
    assert len(found) == 60
    assert {language for language, _, _ in found} == set(marks.TEXTS)
    assert max(ms for _, ms, _ in found) < 5


@SPOKEN
def test_marks_before_a_break_are_before_the_silence(voice: EspeakVoice) -> None:
    said = voice.say(
        SpeechRequest('one <mark name="a"/><break time="800ms"/><mark name="b"/>two', ("a", "b"))
    )
    assert said.marks["a"] == pytest.approx(said.words[0].end, abs=0.05)
    assert said.marks["b"] == said.words[1].start > said.marks["a"] + 0.7


@SPOKEN
def test_phonemes_exclude_language_flags(voice: EspeakVoice) -> None:
    said = voice.say(SpeechRequest("c'est un weekend", language="fr"))
    assert not any("(" in phoneme.ipa for phoneme in said.phonemes)


def struct(kind: int, sample: int = 0, place: int = 0, text: bytes = b"") -> bytes:
    event = Struct(type=kind, sample=sample, text_position=place)
    ctypes.memmove(ctypes.addressof(event.id), text, len(text))
    return bytes(event)


def read(*structs: bytes, marks: tuple[str, ...] = (), sound: bytes = b"") -> list[Event]:
    records = b"".join(structs)
    return read_answer({"events": len(records), "marks": list(marks)}, records + sound)[0]


def test_read_answer_returns_type_sample_place_and_text() -> None:
    assert read(struct(WORD, 10, 8), struct(PHONEME, 20, 9, "aɪ".encode()), struct(END, 30)) == [
        (WORD, 10, 8, ""),
        (PHONEME, 20, 9, "aɪ"),
        (END, 30, 0, ""),
    ]


def test_read_answer_ignores_other_events() -> None:
    assert read(struct(SENTENCE), struct(WORD, 5), struct(8)) == [(WORD, 5, 0, "")]


def test_read_answer_names_marks_by_the_head() -> None:
    events = read(struct(MARK, 1), struct(WORD, 2), struct(MARK, 3), marks=("m0", "m1"))
    assert [(sample, text) for _, sample, _, text in events] == [(1, "m0"), (2, ""), (3, "m1")]


@pytest.mark.parametrize(
    ("raw", "ipa"),
    [
        ("ˈaɪəɹ".encode()[:8], "ˈaɪə\ufffd"),  # eight bytes, no end: nothing of what follows is read
        ("ˈaʊə".encode(), "ˈaʊə"),
        (b"a\0t\0", "a"),  # what an earlier one left behind its end
        (b"", ""),
    ],
)
def test_read_answer_ends_phonemes_at_0_or_after_eight_bytes(raw: bytes, ipa: str) -> None:
    assert read(struct(PHONEME, 0, 0, raw)) == [(PHONEME, 0, 0, ipa)]


def test_read_answer_returns_read_only_samples() -> None:
    records = struct(WORD) + struct(END)
    _, pcm = read_answer(
        {"events": len(records), "marks": []}, records + np.array([1, -2, 3], "<i2").tobytes()
    )
    assert pcm.tolist() == [1, -2, 3]
    assert not pcm.flags.writeable
