"""The silent voice: vowel units, marks, phonemes; the list of voices."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.lips.lip_sync import lip_channels
from realizer.speech.letter_to_sound import letters_to_phonemes, syllable_facts, vowel_units
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import SpeechRequest

COUNTED = {
    "en": "hello 2 banana 3 pleased 1 the 1 make 1 makes 1 table 2 tables 2 wanted 2 needed 2 houses 2 "
    "boxes 2 walked 1 nation 2 beautiful 3 people 2 something 2 family 3 question 2 ice 1 played 1 are 1 "
    "queen 1 you 1 language 2 different 3 chocolate 3 university 5 faces 2 smile 1 smiles 1 careful 2",
    "nl": "mooi 1 huis 1 ijs 1 lopen 2 eeuw 1 vandaag 2 koeien 2 gezellig 3 moeilijk 2",
    "de": "haus 1 häuser 2 familie 4 schön 1 freundlich 2 bier 1 heute 2 quelle 2",
    "fr": "bonjour 2 table 1 eau 1 aujourd'hui 3 maison 2 parle 1 parlent 1 le 1 château 2 question 2",
    "es": "hola 2 bueno 2 tierra 2 país 2 guitarra 3 ciudad 2 día 2 buenos 2",
    "pl": "dziękuję 3 niebo 2 wiem 1 dzień 1 dobry 2 polska 2 miasto 2 w 1",
    "ru": "привет 2 молоко 3",
    "el": "καλημέρα 4",
    "ja": "あ 1",
}


@pytest.mark.parametrize("language", COUNTED)
def test_words_have_as_many_units_as_syllables(language: str) -> None:
    words = COUNTED[language].split()
    wrong = {
        w: vowel_units(w, language)
        for w, n in zip(words[::2], words[1::2], strict=True)
        if vowel_units(w, language) != int(n)
    }
    assert not wrong


def test_words_last_their_units_and_punctuation_one() -> None:
    said = SilentVoice().say(SpeechRequest("Banana, dog."))
    unit = syllable_facts()["unit"]
    assert [(w.text, round((w.end - w.start) / unit)) for w in said.words] == [("Banana", 3), ("dog", 1)]
    assert said.words[1].start - said.words[0].end == pytest.approx(unit)
    assert said.pcm is None
    assert said.sample_rate == 0


def test_marks_are_at_the_next_word_or_the_end() -> None:
    said = SilentVoice().say(
        SpeechRequest('<mark name="a"/>One, <mark name="b"/>two.<mark name="c"/>', ("a", "b", "c"))
    )
    assert said.marks == {"a": said.words[0].start, "b": said.words[1].start, "c": said.words[1].end}


def test_breaks_and_prosody_take_their_time() -> None:
    plain = SilentVoice().say(SpeechRequest("one two")).duration
    assert SilentVoice().say(SpeechRequest('one <break time="700ms"/> two')).duration == pytest.approx(
        plain + 0.7
    )
    slow = SilentVoice().say(SpeechRequest('one <prosody rate="50%">two</prosody>'))
    assert slow.words[1].end - slow.words[1].start == pytest.approx(0.4)
    assert SilentVoice().say(SpeechRequest('<sub alias="World Wide Web">WWW</sub>')).words[2].text == "Web"


def test_rate_divides_time() -> None:
    spans = [
        (said.words[-1].end - said.words[0].start)
        for said in (SilentVoice().say(SpeechRequest("one, two banana", rate=rate)) for rate in (0.5, 1, 2))
    ]
    assert spans[0] == pytest.approx(2 * spans[1])
    assert spans[1] == pytest.approx(2 * spans[2])


def test_digits_are_read_by_their_names() -> None:
    assert vowel_units("104", "en") == 4
    assert letters_to_phonemes("2", "fr") == letters_to_phonemes("deux", "fr")


@pytest.mark.parametrize(
    ("word", "language", "ipa"),
    [
        ("ship", "en", "ʃ ɪ p"), ("phone", "en", "f oʊ n"), ("names", "en", "n eɪ m z"),
        ("happy", "en", "h æ p i"),
        ("schön", "de", "ʃ ø n"), ("beau", "fr", "b o"), ("szczyt", "pl", "ʃ tʃ ɨ t"),
        ("huis", "nl", "h œ y s"),
        ("queso", "es", "k ɛ s ɔ"), ("мама", "ru", "m a m a"),
    ],
)  # fmt: skip
def test_letters_become_phonemes(word: str, language: str, ipa: str) -> None:
    assert " ".join(letters_to_phonemes(word, language)) == ipa


def test_an_empty_text_takes_no_time() -> None:
    said = SilentVoice().say(SpeechRequest('<mark name="m"/> '))
    assert (said.duration, said.marks) == (0.0, {"m": 0.0})
    assert said.warnings


@given(st.text(max_size=80), st.sampled_from(["en", "nl", "fr", "de", "es", "pl", "zh", "xx", ""]))
def test_any_text_has_times_in_order(text: str, language: str) -> None:
    said = SilentVoice().say(SpeechRequest(text, language=language))
    edges = [said.phonemes[0].start, *(p.end for p in said.phonemes)] if said.phonemes else [0.0]
    assert edges == sorted(edges)
    assert edges[-1] == pytest.approx(said.duration)
    assert all(a.end == b.start for a, b in zip(said.phonemes, said.phonemes[1:], strict=False))
    assert all(a.end <= b.start + 1e-9 for a, b in zip(said.words, said.words[1:], strict=False))
    lip_channels(said.phonemes, 0.0)
