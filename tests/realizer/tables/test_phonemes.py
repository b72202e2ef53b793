"""Tests of `realizer.tables.phonemes`."""

from realizer.tables.phonemes import phoneme_features, symbols, vowels


def test_phonemes_vowels_alone_have_a_height() -> None:
    assert vowels() == {ipa for ipa, row in phoneme_features().items() if row.height is not None}


def test_phonemes_vowels_are_one_letter_each() -> None:
    # `is_vowel` looks at the first letter of a phoneme.
    assert all(len(ipa) == 1 for ipa in vowels())
    assert set("aeiouəɪʊɑɔ") < vowels()
    assert not set("pbtdkgszʃʒlɹmnŋ") & vowels()


def test_symbols_of_a_string_are_its_sounds() -> None:
    assert symbols("tʃʷãː") == [("tʃ", True), ("a", False)]
    assert symbols("?!") == symbols("7") == symbols("ˈ") == []
