"""Vowel units and phonemes of written words."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.speech.letter_to_sound import letters_to_phonemes, vowel_units

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
def test_vowel_units_counts_syllables(language: str) -> None:
    words = COUNTED[language].split()
    wrong = {
        w: vowel_units(w, language)
        for w, n in zip(words[::2], words[1::2], strict=True)
        if vowel_units(w, language) != int(n)
    }
    assert not wrong


def test_vowel_units_and_phonemes_of_digits_are_their_names() -> None:
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
def test_letters_to_phonemes_of_a_word(word: str, language: str, ipa: str) -> None:
    assert " ".join(letters_to_phonemes(word, language)) == ipa


def test_letters_to_phonemes_joins_doubled_letters_and_folds_diacritics() -> None:
    assert letters_to_phonemes("mamma", "xx") == letters_to_phonemes("mama", "xx")
    assert letters_to_phonemes("á", "xx") == letters_to_phonemes("a", "xx") != ()


def test_letters_to_phonemes_opens_the_mouth_for_unknown_scripts() -> None:
    assert letters_to_phonemes("ꀀ", "en") == ("a",)
    assert letters_to_phonemes("☃", "en") == ()


@given(st.text(max_size=20), st.sampled_from(["en", "nl", "fr", "pl", "xx", ""]))
def test_vowel_units_are_at_least_one(word: str, language: str) -> None:
    assert vowel_units(word, language) >= 1


@pytest.mark.parametrize("word", ["", "_"])
def test_vowel_units_are_at_least_1(word: str) -> None:
    assert vowel_units(word, "en") == 1
